#!/usr/bin/env bash
# Every script parses, is executable where it is meant to be run, and every JSON file is JSON.
source "$(dirname "$0")/../harness.sh"
cd "$SKEIN_ROOT"
tracked_files '*.sh' .ci/run | while IFS= read -r -d '' script; do
  bash -n "$script" || fail "$script doesn't parse"
  [[ $(head -c 2 "$script") != '#!' || -x $script ]] || fail "$script is not executable"
done
tracked_files '*.json' | while IFS= read -r -d '' file; do
  jq empty "$file" || fail "$file is no JSON"
done
