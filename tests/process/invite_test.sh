#!/usr/bin/env bash
# The view's button "Invite" in a headless Chromium: the QR code on the screen is read as a phone reads it, and lets in who opens it.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../page.sh"
enter_network_namespace "$@"
require_page
command -v zbarimg >/dev/null || skip "no zbarimg (scripts/setup.sh --tests installs it)"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
ip addr add 10.77.0.1/32 dev lo
for plain in '' '--web-plain 8701'; do # with a link that is not encrypted the code is that one
  start_services "$session" "$url" --web 8600 --web-public 10.77.0.1 --web-public-port 8700 $plain --features 0 --matching 0 --mappers 0 --guide off --dense off >"$workspace/launch.log"
  TMPDIR=$workspace node "$SKEIN_ROOT/tests/page/invite.mjs" http://127.0.0.1:8600/ "$workspace" \
    "$place/images/agent-1/$(ls "$place/images/agent-1" | head -n 1)" || fail "the page's side failed"
  [[ -z ${PAGE_PICTURES:-} ]] || cp "$workspace"/*.png "$PAGE_PICTURES/"
  stop_services
  rm -rf "$session"
done
