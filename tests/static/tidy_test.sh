#!/usr/bin/env bash
# clang-tidy finds nothing in the files that it gets to within the time (tidy.py says how many those are).
#   tidy_test.sh [SECONDS=230]
source "$(dirname "$0")/../harness.sh"
command -v clang-tidy >/dev/null || skip "no clang-tidy (scripts/setup.sh --tests installs it)"
python3 "$(dirname "$0")/tidy.py" "$SKEIN_ROOT" "$SKEIN_BUILD" "${1:-230}" || fail "see above: mend it, or say in .clang-tidy why not"
