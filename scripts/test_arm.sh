#!/usr/bin/env bash
# Compiles the kernels of matching, retrieval and the depth sweep for AArch64, with their tests, and runs these under emulation: on a
# processor with the dot product instructions, and on one without (Cortex-A53). Half a minute on two cores.
#
#   scripts/test_arm.sh
#
# Exit codes: 0 passed, 1 failed, 2 bad usage, 77 skipped: no cross compiler, emulator or source of GoogleTest.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
take_options '' "$@"

readonly googletest=/usr/src/googletest/googletest kernels=$SKEIN_ROOT/services/matching sweep=$SKEIN_ROOT/libs/dense/depth/sweep_kernels
readonly vector=$SKEIN_ROOT/services/retrieval/int8_vector
if ! type -P aarch64-linux-gnu-g++ >/dev/null || ! type -P qemu-aarch64 >/dev/null || [[ ! -e $googletest/src/gtest-all.cc ]]; then
  echo "SKIPPED: needs g++-aarch64-linux-gnu, qemu-user and libgtest-dev"
  exit 77
fi
work=$(mktemp -d "${TMPDIR:-/tmp}/skein_test.XXXXXX")
trap 'rm -rf "$work"' EXIT

# compile SOURCE [FLAG...]
compile() {
  aarch64-linux-gnu-g++ -std=c++17 -O3 -DNDEBUG -Wall -Wextra -Werror -I"$SKEIN_ROOT/services" -I"$SKEIN_ROOT/libs/base" \
    -I"$SKEIN_ROOT/libs/dense" -isystem "$googletest/include" -isystem "$googletest" "${@:2}" -c "$1" -o "$work/$(basename "$1" .cc).o"
}

compile_googletest() { compile "$googletest/src/gtest-all.cc" -O1 && compile "$googletest/src/gtest_main.cc" -O1; }

compile_kernels() {
  local name
  for name in kernel kernel_portable kernel_neon kernel_test; do compile "$kernels/$name.cc" || return; done
  compile "$kernels/kernel_neondot.cc" -march=armv8.2-a+dotprod && # as in services/matching/CMakeLists.txt
    compile "$SKEIN_ROOT/libs/base/core/instruction_set.cc" && compile "$sweep.cc" && compile "${sweep}_test.cc" &&
    compile "$vector.cc" && compile "${vector}_test.cc" &&
    compile "${sweep}_portable.cc" -Wno-psabi # as in libs/dense/depth/CMakeLists.txt
}

# run PROCESSOR TESTS OUTCOME OTHER: TESTS end in OUTCOME, none in OTHER
run() {
  local log; log=$(mktemp "$work/XXXXXX.log")
  qemu-aarch64 -L /usr/aarch64-linux-gnu -cpu "$1" "$work/kernels_test" --gtest_filter="$2" >"$log" 2>&1 &&
    grep -F "[ $3 ]" "$log" >/dev/null && ! grep -F "[ $4 ]" "$log" >/dev/null && say "$2 on $1: ${3##* }" && return
  tail -n 40 "$log" >&2
  return 1
}

compile_googletest &
compile_kernels || die "the kernels don't compile"
wait "$!" || die "GoogleTest doesn't compile"
aarch64-linux-gnu-g++ "$work"/*.o -o "$work/kernels_test" -lpthread
run max '*/neondot:Int8Vector.*' '      OK' ' SKIPPED' &
run cortex-a53 '*/neon:Int8Vector.*' '      OK' ' SKIPPED' || die "neon fails"
wait "$!" || die "neondot fails"
run cortex-a53 '*/portable-Versions/Kernel.*' '      OK' ' SKIPPED' || die "the depth sweep's kernels fail"
run cortex-a53 '*/neondot' ' SKIPPED' '      OK' || die "neondot is not refused where the processor lacks it"
