#!/usr/bin/env bash
# Fuzzes the decoders of what others send: libFuzzer with AddressSanitizer and UndefinedBehaviorSanitizer.
#
#   tests/fuzz/run.sh [--seconds N] [--runs N] [--jobs N] [TARGET...]
#
#   --seconds N   time for each target (default 60)
#   --runs N      executions of each target, at most (default: as many as the time is for)
#   --jobs N      targets at a time (default: the cores)
#   TARGET...     default: all; a source of tests/fuzz names each: SKEIN_FUZZ_TARGET
#
# Builds build/fuzz with clang. Each target starts with the seeds of write_seeds and the corpus of earlier runs,
# build/fuzz/corpus/TARGET. Inputs that make it fail are kept in build/fuzz/findings/TARGET-*; reproduce one by
# `build/fuzz/bin/fuzz_TARGET FILE`. Prints a row for each target: executions of all runs in build/fuzz, edges covered,
# CPU minutes of all runs and of this run, findings.
# Exit codes: 0 nothing found, 1 something was found or a target did not run, 2 bad usage, 77 no clang.
source "$(dirname "$0")/../../scripts/lib.sh"

seconds=60 runs=-1 jobs=$(nproc) targets=()
while (($#)); do
  case $1 in
    --seconds | --runs | --jobs)
      [[ ${2:-} =~ ^[1-9][0-9]*$ ]] || usage_error "$1 wants a number"
      printf -v "${1#--}" %s "$2"
      shift 2 ;;
    -h | --help) print_help; exit 0 ;;
    -*) usage_error "unknown option $1" ;;
    *) targets+=("$1"); shift ;;
  esac
done

can_fuzz() {
  local source
  source=$(mktemp --suffix .cc) || return 1
  printf 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }' >"$source"
  clang++ -fsanitize=fuzzer,address,undefined "$source" -o "$source.out" 2>/dev/null
  local status=$?
  rm -f "$source" "$source.out"
  return $status
}
can_fuzz || { echo "SKIPPED: no clang with libFuzzer here (Debian: clang, libclang-rt-14-dev; scripts/setup.sh --tests)"; exit 77; }

fuzz_build=$SKEIN_ROOT/build/fuzz
mkdir -p "$SKEIN_DEPS"
build_skein fuzz fuzzers
corpus=$fuzz_build/corpus seeds=$fuzz_build/seeds findings=$fuzz_build/findings logs=$fuzz_build/logs
mkdir -p "$corpus" "$findings" "$logs"
rm -rf "$seeds"
"$fuzz_build/bin/write_seeds" "$seeds"
if ((${#targets[@]} == 0)); then
  for program in "$fuzz_build"/bin/fuzz_*; do targets+=("${program##*/fuzz_}"); done
fi
for target in "${targets[@]}"; do
  [[ -x $fuzz_build/bin/fuzz_$target ]] || usage_error "there is no target $target"
  [[ -d $seeds/$target ]] || die "write_seeds makes no seeds of $target"
done

# Libraries without AddressSanitizer resize vectors without telling its container checks, so these are off. A codec of
# OpenCV that asks for too much memory gets null, not a finding.
export ASAN_OPTIONS=detect_container_overflow=0:allocator_may_return_null=1:${ASAN_OPTIONS:-}
export OPENCV_LOG_LEVEL=SILENT

# run_target TARGET: its log and the shell's times in $logs
run_target() {
  local target=$1
  mkdir -p "$corpus/$target"
  local status=0
  { TIMEFORMAT='cpu %U %S'; time nice -n 19 "$fuzz_build/bin/fuzz_$target" "$corpus/$target" "$seeds/$target" \
      -max_total_time="$seconds" -runs="$runs" -timeout=20 -rss_limit_mb=3000 -use_value_profile=1 -print_final_stats=1 \
      -artifact_prefix="$findings/$target-" -reload=0 >"$logs/$target.log" 2>&1 || status=$?; } 2>"$logs/$target.time"
  echo "$status" >"$logs/$target.status"
  echo "$(executions_of "$target") $(awk '/^cpu/ { print $2 + $3 }' "$logs/$target.time")" >>"$logs/$target.runs"
}
executions_of() { sed -n 's/^stat::number_of_executed_units: *//p' "$logs/$1.log"; }

say "fuzzing ${#targets[@]} targets, at most $seconds s each, $jobs at a time"
for target in "${targets[@]}"; do
  while (($(jobs -rp | wc -l) >= jobs)); do sleep 0.2; done
  run_target "$target" &
done
wait

failed=0
printf '%-20s %14s %8s %8s %10s %9s\n' target executions edges 'CPU min' 'this run' findings
for target in "${targets[@]}"; do
  edges=$(grep -oE 'cov: [0-9]+' "$logs/$target.log" | tail -n 1 | cut -d' ' -f2) || true
  # one that ended early tells no executions
  read -r executions minutes now < <(awk '{ n += NF > 1 ? $1 : 0; s += $NF; last = $NF } END { printf "%d %.2f %.2f\n", n, s / 60, last / 60 }' "$logs/$target.runs")
  found=$(find "$findings" -name "$target-*" | wc -l)
  printf '%-20s %14s %8s %8s %10s %9s\n' "$target" "$executions" "${edges:--}" "$minutes" "$now" "$found"
  if (($(<"$logs/$target.status") != 0)); then
    failed=1
    warn "$target ended with $(<"$logs/$target.status"): $(grep -m 1 -E 'ERROR|runtime error|does not hold|libFuzzer' "$logs/$target.log" || tail -n 1 "$logs/$target.log")"
  fi
done
exit "$failed"
