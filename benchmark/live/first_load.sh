#!/usr/bin/env bash
# What the live view's page costs a browser that was never here: bytes, seconds to the first panels, points, and all.
#
#   benchmark/live/first_load.sh --session DIR [--runs N]
#
#   --session DIR   a finished session
#   --runs N        fresh browsers, one after the other (default 3)
#
# A row a run. Chromium draws without a GPU here, on the cores that serve the page, too. Fails if another host is asked.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/page.sh"

session='' runs=3
take_options "session runs" "$@"
[[ -d $session ]] || usage_error "--session: give a finished session's folder"
enter_network_namespace "$@"
require_page
new_workspace
"$SKEIN_BUILD/bin/skein" view "$session" --port 8470 >"$workspace/view.log" 2>&1 &
view_pid=$!
is_served() { curl -sf http://127.0.0.1:8470/api/session >/dev/null; }
wait_until 60 "the view answers" is_served
TMPDIR=$workspace node "$SKEIN_ROOT/tests/page/first_load.mjs" http://127.0.0.1:8470/ "$runs" >"$workspace/loads"
kill -TERM "$view_pid"
wait "$view_pid" || fail "skein view ends with $?"
echo '| s to panels | to points | to all | points | page, KB | points and poses, KB | facts, KB | thumbnails, KB |'
echo '|---|---|---|---|---|---|---|---|'
jq -r 'def kb: . / 1000 | round;
  "| \(.panels_s) | \(.points_s) | \(.all_s) | \(.points) | \(.bytes.page | kb) | \(.bytes.points | kb) | \(.bytes.facts | kb) | \(.bytes.thumbnails | kb) |"' "$workspace/loads"
jq -se 'all(.hosts == ["127.0.0.1:8470"])' "$workspace/loads" >/dev/null || fail "another host was asked: $(jq -c .hosts "$workspace/loads")"
