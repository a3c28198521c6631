#!/usr/bin/env bash
# kill -9 of the source's mapper, the target's mapper and the merger at every step of a merge: what was
# two submaps is one map in the end, of all photos, without anybody's help.
#
# A session with two submaps is made once, without merging; each case goes on from a copy of it. A shim
# stops the process that is about to submit the step's fact, or has just done so; then the victim is
# killed, and the stopped one goes on.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
url=$(test_lcm_url)
use_place 2 12 --scenario disjoint --seed 2 --size 800x600

# make_two_submaps SESSION: the first halves of the walks see nothing in common, so each begins a submap;
# only then come the photos between them.
make_two_submaps() {
  start_reconstruction "$1" "$url" --mappers 2 --no-merge
  publish_part "$1" 1 6
  wait_until 120 "each walk has its submap" two_submaps_have "$1" 5
  publish_part "$1" 7 12
  finish "$1"
  stop_services
  [[ $(jq '.submaps | length' "$1/report.json") == 2 ]] || fail "not two submaps to merge: $(jq -c '[.submaps[].images]' "$1/report.json")"
}

has_fact_like() {
  [[ -n $(sqlite3 "file:$1/ledger.db?mode=ro" ".timeout 5000" "SELECT 1 FROM facts WHERE fact_id LIKE '$2' LIMIT 1" 2>/dev/null) ]]
}

# Of a merge, the process that submits the step's fact is known: the merger orders, the source's mapper
# freezes, the target's mapper ends it. So the other mapper is the other side.
pid_of() { cat "$session/run/$1.pid"; }
other_mapper() { [[ $(pid_of mapper-1) == "$1" ]] && echo mapper-2 || echo mapper-1; }
mapper_of() { [[ $(pid_of mapper-1) == "$1" ]] && echo mapper-1 || echo mapper-2; }

# victim_instance STEP WHO STOPPED_PID
victim_instance() {
  case $1-$2 in
    *-merger) echo merger ;;
    ordered-source) echo mapper-1 ;; # before the order either may become it: both are killed in turn
    ordered-target) echo mapper-2 ;;
    frozen-source | end-target) mapper_of "$3" ;;
    frozen-target | end-source) other_mapper "$3" ;;
  esac
}

# kill_at WHEN STEP WHO: one case
kill_at() {
  local mark=$workspace/mark stopped victim
  session=$workspace/$1-$2-$3
  "$SKEIN_BUILD/bin/skein" clone "$workspace/two" "$session" 2>/dev/null
  rm -f "$mark"
  LD_PRELOAD=$stop_shim SKEIN_STOP_AT=$1 SKEIN_STOP_TEXT="SKEIN_SUBMIT_MERGE /$2" SKEIN_STOP_MARK=$mark \
    start_reconstruction "$session" "$url" --mappers 2 --hang-after 0 # the stopped one goes on
  wait_until 120 "somebody submits a merge's '$2'" test -s "$mark"
  stopped=$(<"$mark")
  [[ $1 == before ]] || wait_until 20 "'$2' is in the ledger" has_fact_like "$session" "merge/%/$2%"
  [[ $1 == after ]] || ! has_fact_like "$session" "merge/%/$2%" || fail "'$2' is in the ledger before it was submitted"
  victim=$(victim_instance "$2" "$3" "$stopped")
  kill_service "$session" "$victim"
  kill -CONT "$stopped" 2>/dev/null || true
  # The finish may map all photos anew into one map; then nothing is left to merge.
  wait_until 120 "the merge is done" status_holds "$session" '.merges.done == 1 and .merges.open == 0'
  finish "$session"
  stop_services
  expect_one_map
  rm -rf "$session"
}

expect_one_map() {
  local report=$session/report.json
  [[ $(jq -c '[.submaps[].images]' "$report") == "[$num_photos]" ]] ||
    fail "not one map of $num_photos photos: $(jq -c '[.submaps, .merges]' "$report")"
  [[ $(jq -c '[.merges[] | select(.state == "done")] | length' "$report") == 1 ]] ||
    fail "not done once: $(jq -c .merges "$report")"
  jq -e '[.merges[] | select(.state == "ordered" or .state == "frozen")] == []' "$report" >/dev/null ||
    fail "a merge is open: $(jq -c .merges "$report")"
  expect_model "$session" 1
}

make_two_submaps "$workspace/two"
for step in ordered frozen end; do
  for who in source target merger; do
    for when in before after; do
      start=$SECONDS log=$workspace/$when-$step-$who.log
      kill_at "$when" "$step" "$who" >"$log" 2>&1
      echo "$when '$step' was submitted, $who killed: $(tail -n 1 "$log"), $((SECONDS - start)) s"
      rm "$log"
    done
  done
done
