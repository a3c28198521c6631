#!/usr/bin/env bash
# Small captures of many kinds, made of a synthetic place and of ../shared/cases: what becomes of each is what captures.txt
# says. No session may end without its report, or restart a process.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
make_capture=$SKEIN_BUILD/bin/make_capture cases=$SKEIN_ROOT/../shared/cases
[[ -x $make_capture ]] || skip "no make_capture in this build: it comes with the benchmarks (SKEIN_BENCHMARKS)"
use_place 2 8 --seed 1

failures=$workspace/failures
touch "$failures"
# capture_of NAME KIND: sets `capture`, a folder of photos called like the place's first agent
capture_of() {
  local photos
  capture=$workspace/$1-$2/agent-1
  case $1 in
    place) mapfile -t photos < <(ls "$place"/images/agent-1/*) ;;
    *) mapfile -t photos < <(ls "$cases/$1"/*) ;;
  esac
  case $2 in
    as-is) mkdir -p "$capture" && cp "${photos[@]}" "$capture/" ;;
    rotation*) "$make_capture" "$2" "$capture" "${photos[0]}" || fail "make_capture $2" ;;
    *) "$make_capture" "$2" "$capture" "${photos[@]}" || fail "make_capture $2" ;;
  esac
}

# run_capture NAME: sets `report`
run_capture() {
  local session=$workspace/session-$1
  report=$session/report.json
  start_services "$session" "$url" --web "$web_port" --max-size 1000 >"$workspace/$1.log" 2>&1
  publish_agent "$session" "$capture"
  await_agents
  finish "$session"
  stop_services
  ! grep ' ended (' "$workspace/$1.log" || fail "$1: a process was restarted"
  is_accounted_for "$report" || fail "$1: photos are not accounted for: $(jq -c .images "$report")"
}

# error_of NAME SESSION: of its largest map, position RMSE in % of the truth's extent; null where there is none
error_of() {
  local truth=$place/truth
  [[ $1 == place ]] || truth=$SKEIN_ROOT/../shared/datasets/south-building/reference
  "$SKEIN_BUILD/bin/skein" evaluate --json "$2/sparse/0" "$truth" 2>/dev/null | jq '.position_rmse_percent * 1000 | round / 1000' | grep . || echo null
}

# check_row NAME KIND LARGEST MAPS ERROR CAUSE
check_row() {
  local started=$SECONDS found error=null
  capture_of "$1" "$2"
  run_capture "$1-$2"
  [[ $5 == - ]] || error=$(error_of "$1" "${report%/*}")
  found=$(jq -r --argjson error "$error" '"\([.submaps[].images] | max // 0) in \(.submaps | length) maps, error \($error // "-"), left out: \([.deferred[].cause] | unique | join("+"))"' "$report")
  printf '%-24s %-16s %3d photos: %s (%d s)\n' "$1" "$2" "$(jq .images.received "$report")" "$found" $((SECONDS - started))
  jq -e --argjson largest "$3" --argjson maps "$4" --argjson error "$error" --arg limit "$5" --arg cause "${6//-/ }" '
    ([.submaps[].images] | max // 0) >= $largest and (.submaps | length) <= $maps
    and ($limit == "-" or $error != null and $error <= ($limit | tonumber))
    and ($cause == "any" or all(.deferred[]; .cause == $cause))' "$report" >/dev/null ||
    echo "$1 $2: $found; not $3 in $4, error $5, left out: $6" >>"$failures"
}

# check_export NAME CAMERA_MODEL: the model is written with its camera as it is, or refused
check_export() {
  local out=$workspace/export-$1
  if ! "$SKEIN_BUILD/bin/skein" export --model "$cases/$1" --output "$out" --format nerfstudio >"$workspace/export.log" 2>&1; then
    printf '%-24s refused: %s\n' "$1" "$(tail -n 1 "$workspace/export.log")"
    return
  fi
  find "$out" -name transforms.json -exec jq -se --arg model "$2" 'length > 0 and all(.[]; .camera_model == $model and .fl_x != .fl_y)' {} + >/dev/null ||
    echo "$1: not written as $2, nor refused" >>"$failures"
}

# run_row NUMBER: of `rows`
run_row() {
  local name kind largest maps error cause
  read -r name kind largest maps error cause <<<"${rows[$1]}"
  if [[ $name != place && ! -d $cases/$name ]]; then
    echo "$name: no $cases/$name: left out"
  elif [[ $kind == export ]]; then
    check_export "$name" "$largest"
  else
    check_row "$name" "$kind" "$largest" "$maps" "$error" "$cause"
  fi
}

mapfile -t rows < <(grep -v '^ *\(#\|$\)' "$SKEIN_ROOT/tests/process/captures.txt")
side_by_side 2 "${#rows[@]}" run_row
[[ ! -s $failures ]] || fail "$(<"$failures")"
