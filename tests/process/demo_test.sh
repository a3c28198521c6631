#!/usr/bin/env bash
# demo.sh, with a build that is there: it prints the live view's address when it starts, which answers while the photos are
# worked on, and at its end one command, which shows the finished session. The session's path has a blank and quotes in it.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../page.sh"
enter_network_namespace "$@"
require_page
new_workspace
use_small_place
session="$workspace/Anna's \"first\" house"
mkdir -p "$workspace/photos"
cp $(ls -d "$place"/images/agent-1/* | head -n 6) "$workspace/photos/"

"$SKEIN_ROOT/scripts/demo.sh" --build "$SKEIN_BUILD" --session "$session" --images "$workspace/photos" --rate 1 >"$workspace/demo.log" 2>&1 &
demo=$!
# prints LINE_START FILE ADDRESS_VARIABLE: takes the address that follows
prints_address() {
  local found
  found=$(sed -n "s|^$1\(http://[^ ]*/\).*|\1|p" "$2" | head -n 1)
  [[ -n $found ]] || { kill -0 "$3" 2>/dev/null || fail "it ended without an address: $(tail -n 5 "$2")"; return 1; }
  address=$found
}
answers() { curl -fsS --max-time 5 "$@" 2>/dev/null; }
session_is() { answers "${address}api/session" | jq -e --arg folder "${session##*/}" ".live == $1 and .folder == \$folder" >/dev/null; }
wait_until 60 "the address of the live view" prints_address '== view: ' "$workspace/demo.log" "$demo"
! grep -q '^photos: ' "$workspace/demo.log" || fail "the address comes at the end"
wait_until 20 "the live view answers" session_is true
kill -0 "$demo" || fail "demo.sh had ended before the live view was looked at"
wait "$demo" || fail "demo.sh: $(tail -n 20 "$workspace/demo.log")"
grep -q '^photos: 6 received, 6 placed' "$workspace/demo.log" || fail "$(grep '^photos' "$workspace/demo.log")"
! answers "${address}api/session" || fail "the live view is still there after the demo"

command=$(sed -n 's/^== in a browser: //p' "$workspace/demo.log")
[[ -n $command ]] || fail "no command to look at the session with"
bash -c "exec $command" >"$workspace/view.log" 2>&1 &
view=$!
wait_until 30 "the command shows the session" prints_address 'view: ' "$workspace/view.log" "$view"
session_is false || fail "another session: $(answers "${address}api/session")"
TMPDIR=$workspace node "$SKEIN_ROOT/tests/page/finished.mjs" "$address" "$session/report.json" || fail "the page's side failed"
kill -INT "$view"
wait "$view" || fail "skein view ended with an error: $(<"$workspace/view.log")"
