#!/usr/bin/env bash
# Some thousand executions of each decoder of what others send, over its seeds and the corpus of earlier runs.
source "$(dirname "$0")/../harness.sh"
status=0
"$SKEIN_ROOT/tests/fuzz/run.sh" --seconds 3 --runs 10000 || status=$?
((status != 77)) || skip "no clang with libFuzzer here"
((status == 0)) || fail "see above"
