#!/usr/bin/env bash
# A phone as an agent, played by a headless Chromium (tests/page/phone.mjs): photos through the file input without TLS,
# offline and back, a reload in the middle of an upload, a dead server; over TLS the camera view, with a film for a
# camera, and the position; the word on a blurred view, and the screen that stays on; then the view of one who looks.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../page.sh"
enter_network_namespace "$@"
require_page
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session steps=$workspace/steps skein=$SKEIN_BUILD/bin/skein
mkdir -p "$steps"
# Loopback's own address counts as safe: without TLS a page is tried by another one.
ip addr add 10.77.0.1/32 dev lo

page_pid=''
page_has() {
  [[ -e $steps/$1 ]] && return 0
  kill -0 "$page_pid" 2>/dev/null || { cat "$workspace/page.log"; fail "the page's side ended before '$1'"; }
  return 1
}
start_services "$session" "$url" --web 8600 --web-public 10.77.0.1 --web-public-port 8700 --web-plain 8701 --dense off >"$workspace/launch.log"
# link ROLE NAME LINE [OPTION...]: https is line 1, http line 2
link() {
  local role=$1 name=$2 line=$3
  shift 3
  "$skein" invite --session "$session" --role "$role" --name "$name" --browser "$@" | sed -n "${line}p"
}
{
  echo "plain $(link agent anna 2)"
  echo "secure $(link agent bert 1)"
  echo "shaky $(link agent carl 1)"
  echo "viewer $(link viewer vera 1)"
  echo "expired $(link viewer late 1 --expires 1s)"
} >"$workspace/links"
cat "$place"/images/agent-2/* >"$workspace/film.mjpeg" # a JPEG a frame
TMPDIR=$workspace node "$SKEIN_ROOT/tests/page/phone.mjs" "$workspace/links" "$steps" "$place/images/agent-1" "$workspace/film.mjpeg" >"$workspace/page.log" 2>&1 &
page_pid=$!

wait_until 200 "four photos are placed" page_has placed
wait_until 120 "the phone has reloaded" page_has kill
pid=$(<"$session/run/web.pid")
kill -STOP "$launch_pid" # so that it is not started again at once
kill -9 "$pid"
touch "$steps/dead"
wait_until 60 "a photo waits" page_has revive
kill -CONT "$launch_pid"
wait "$page_pid" || { cat "$workspace/page.log"; fail "the page's side failed"; }
cat "$workspace/page.log"

[[ $(ls "$session/images/anna" | wc -l) == 8 ]] || fail "not 8 photos of anna, each once: $(ls "$session/images/anna")"
for photo in "$place"/images/agent-1/*; do cmp "$photo" "$session/images/anna/$(basename "$photo")" || fail "a photo was changed"; done
photo=$(ls "$session"/images/bert/* | head -n 1)
[[ $(od -An -tx1 -N 2 "$photo") == ' ff d8' ]] || fail "the camera's photo is no JPEG"
gps=$(curl -fsS http://127.0.0.1:8600/api/events?from=1 | jq -c '[.events[] | select(.kind == "photo" and .agent == "bert")][0].gps[:2]')
[[ $gps == '[47.5,8.25]' ]] || fail "the camera's photo is at $gps"
echo "positions and bytes are as the phone sent them"
