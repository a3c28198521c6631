#!/usr/bin/env bash
# The live view's page in a headless Chromium, against its own test server: what is shown, picked, told and replayed, a
# server that goes and comes, a phone, the keyboard, contrasts. No process of Skein takes part.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../page.sh"
enter_network_namespace "$@"
require_page
new_workspace
TMPDIR=$workspace node "$SKEIN_ROOT/tests/page/synthetic.mjs" "$SKEIN_ROOT/web/test_server/server.mjs" "$SKEIN_BUILD/web"
