#!/usr/bin/env bash
# The live view's page in a headless Chromium while a session grows: two agents' maps begin apart and are joined, a photo
# is not placed, skein-web is killed and comes back, everything is stopped and started again. What the page counts is what the ledger comes to.
#
# The page runs in the background (tests/page/live.mjs). Each side tells the other how far it is by files: STEPS/NAME.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../page.sh"
enter_network_namespace "$@"
require_page
[[ -x $SKEIN_BUILD/bin/skein-web ]] || skip "no skein-web is built"
new_workspace
url=$(test_lcm_url)
use_place 2 12 --scenario disjoint --seed 2 --size 800x600
session=$workspace/session steps=$workspace/steps
mkdir -p "$steps" "$workspace/odd"
"$SKEIN_BUILD/bin/bad_photos" "$place/images/agent-1" "$workspace/photos" || fail "bad_photos"
cp "$workspace/photos/bad/flat.jpg" "$workspace/odd/<img src=x onerror=alert(1)>.jpg"

page_pid=''
# page_has NAME: fails at once when the page's side has ended
page_has() {
  [[ -e $steps/$1 ]] && return 0
  kill -0 "$page_pid" 2>/dev/null || { cat "$workspace/page.log"; fail "the page's side ended before '$1'"; }
  return 1
}

start_services "$session" "$url" --mappers 2 --web 8470 >"$workspace/launch.log"
view=$(sed -n 's|.*view: \(http://[^ ]*/\).*|\1|p' "$workspace/launch.log")
[[ -n $view ]] || fail "launch.sh did not say where the view is"
TMPDIR=$workspace node "$SKEIN_ROOT/tests/page/live.mjs" "$view" "$steps" "$session" >"$workspace/page.log" 2>&1 &
page_pid=$!

wait_until 60 "the page is open" page_has open
publish_part "$session" 1 6
wait_until 120 "each walk has its submap" two_submaps_have "$session" 5
publish_agent "$session" "$workspace/odd"
await_agents
touch "$steps/two_maps"
wait_until 300 "the page shows both maps" page_has both_shown
kill_service "$session" web
touch "$steps/killed"
wait_until 150 "the page is connected again" page_has back
stop_services
start_services "$session" "$url" --mappers 2 --web 8470 >>"$workspace/launch.log"
touch "$steps/restarted"
wait_until 150 "the page is connected after a restart of everything" page_has back_again
publish_part "$session" 7 12
finish "$session"
"$SKEIN_BUILD/bin/skein" status --session "$session" --lcm-url "$url" --once --json >"$steps/status.json"
touch "$steps/finished"
wait_until 300 "the page shows the finished session" page_has all_shown
stop_services
touch "$steps/stopped"
wait "$page_pid" || { cat "$workspace/page.log"; fail "the page's side failed"; }
cat "$workspace/page.log"
