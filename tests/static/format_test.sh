#!/usr/bin/env bash
# Every tracked C++ file is formatted as .clang-format says.
source "$(dirname "$0")/../harness.sh"
command -v clang-format >/dev/null || skip "no clang-format (scripts/setup.sh --tests installs it)"
cd "$SKEIN_ROOT"
tracked_files '*.h' '*.cc' '*.c' | xargs -0 -r clang-format --dry-run -Werror || fail "run clang-format -i on the files above"
