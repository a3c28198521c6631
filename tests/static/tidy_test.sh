#!/usr/bin/env bash
# clang-tidy finds nothing in the files that it gets to within the time (tidy.py says how many those are).
#   tidy_test.sh [SECONDS=100]
source "$(dirname "$0")/../harness.sh"
command -v clang-tidy >/dev/null || skip "no clang-tidy (scripts/setup.sh --tests installs it)"
# GCC's precompiled headers mean nothing to clang.
cmake -S "$SKEIN_ROOT" -B "$SKEIN_BUILD/tidy" -G Ninja -DCMAKE_BUILD_TYPE=Release -DSKEIN_UNITY=ON -DSKEIN_PRECOMPILED=OFF \
  >"$SKEIN_BUILD/tidy_configure.log" 2>&1 || { cat "$SKEIN_BUILD/tidy_configure.log" >&2; fail "cmake failed"; }
ninja -C "$SKEIN_BUILD/tidy" lcmtypes_cpp >/dev/null || fail "no message types"
python3 "$(dirname "$0")/tidy.py" "$SKEIN_ROOT" "$SKEIN_BUILD/tidy" "${1:-100}" || fail "see above: mend it, or say in .clang-tidy why not"
