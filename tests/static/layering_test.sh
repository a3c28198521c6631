#!/usr/bin/env bash
# Algorithm libraries (skein_core, skein_geometry, every skein_NAME_core) can't even see the
# generated messages or the messaging library.
source "$(dirname "$0")/../harness.sh"
commands=$SKEIN_BUILD/compile_commands.json
pattern='CMakeFiles/skein_([a-z_]+_)?(core|geometry)\.dir/'
files=$(jq -r --arg p "$pattern" '.[] | select(.output // .command | test($p)) | .file' "$commands")
[[ -n $files ]] || fail "no algorithm library found in $commands"
seeing=$(jq -r --arg p "$pattern" '.[] | select(.output // .command | test($p))
  | select(.command | test("generated/cpp")) | .file' "$commands")
[[ -z $seeing ]] || fail "compiled with the messages on the include path: $seeing"
including=$(grep -lE '#include "(messaging|lcm|skein)/' $files || true)
[[ -z $including ]] || fail "include messages or messaging: $including"
