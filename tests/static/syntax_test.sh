#!/usr/bin/env bash
# Every script parses, is executable where it is meant to be run, and ends no pipe in `grep -q`, which
# leaves at the first match: the writer then dies of SIGPIPE now and then, and with pipefail that reads
# as "not found". None uses `wait -n`: when a trapped signal ends it as a child ends, bash 5.2 forgets the
# child's end and waits for it for ever (scripts/launch.sh hung so). Every JSON file is JSON.
source "$(dirname "$0")/../harness.sh"
cd "$SKEIN_ROOT"
tracked_files '*.sh' .ci/run scripts/hooks/pre-commit | while IFS= read -r -d '' script; do
  bash -n "$script" || fail "$script doesn't parse"
  [[ $(head -c 2 "$script") != '#!' || -x $script ]] || fail "$script is not executable"
  ! grep -nE '[^|]\| *grep +-[a-zA-Z]*q' "$script" || fail "$script: a pipe into grep -q (send its output to /dev/null instead)"
  ! grep -nE '^[^#]*\bwait +-[a-z]*n' "$script" || fail "$script: wait -n (pause and look, as scripts/launch.sh does)"
done
tracked_files '*.json' | while IFS= read -r -d '' file; do
  jq empty "$file" || fail "$file is no JSON"
done
