#!/usr/bin/env bash
# Sets up, builds and runs every test but the slow ones. Ends with one line: N passed, N failed, N skipped.
#
#   scripts/test.sh [--preset release|asan|tsan] [--filter REGEX] [--label unit|process|static|slow] [--no-setup] [--speed]
#
#   --preset    what to build and test (default release)
#   --filter    only the tests whose name matches
#   --label     only the tests of one kind; slow: those that take minutes and want packages that setup.sh does not install
#   --no-setup  take the packages and COLMAP's part as they are
#   --speed     then tell each stage's speed beside that of docs/speed.json (benchmark/colmap/speed.sh)
#
# Exits 0 when all passed, 1 when one failed or the build broke, 2 on bad usage.
source "$(dirname "$0")/lib.sh"

preset=release setup=1 speed=0 selection=()
while (($#)); do
  case $1 in
    --preset | --filter | --label) (($# > 1)) || usage_error "$1 needs a value" ;;&
    --preset) preset=$2; shift ;;
    --filter) selection+=(-R "$2"); shift ;;
    --label) selection+=(-L "$2"); shift ;;
    --no-setup) setup=0 ;;
    --speed) speed=1 ;;
    -h | --help) print_help; exit 0 ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
((${#selection[@]})) || selection=(-LE '^slow$')
((!speed)) || [[ $preset == release ]] || usage_error "--speed is for the release build"

mkdir -p "$SKEIN_DEPS"
((setup == 0)) || "$SKEIN_ROOT/scripts/setup.sh" --tests
build_skein "$preset"

report=$SKEIN_ROOT/build/$preset/test_report.xml cases=$SKEIN_ROOT/build/$preset/test_cases
rm -rf "$report" "$cases"
say "testing"
status=0
ctest --test-dir "$SKEIN_ROOT/build/$preset" -j "$(nproc)" --output-on-failure --no-tests=error \
  --output-junit "$report" "${selection[@]}" || status=1
[[ -s $report ]] || die "ctest wrote no report"

# Told, never tested: machines are noisy.
if ((speed)); then
  say "measuring speed"
  timeout 900 "$SKEIN_ROOT/benchmark/colmap/speed.sh" --parts stages --compare "$SKEIN_ROOT/docs/speed.json" || warn "benchmark/colmap/speed.sh failed"
fi

python3 "$SKEIN_ROOT/scripts/count_cases.py" "$report" "$cases"
exit "$status"
