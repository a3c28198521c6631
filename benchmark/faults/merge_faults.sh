#!/usr/bin/env bash
# Many runs of one place by several agents, in each of which a mapper or the merger, by chance, is
# killed (kill -9) while two submaps merge: is the map complete all the same?
#
#   benchmark/faults/merge_faults.sh [--runs N] [--only RUN] [--scenario S] [--agents N] [--photos N] [--size WxH] [--keep DIR]
#
#   --runs N         how many (default 20); run 0, undisturbed, comes first
#   --only RUN       only this one: a run's dice are its number's
#   --scenario S, --agents N, --photos N (of each agent), --size WxH    of skein sim: default disjoint, 3,
#                    20, 960x720; seed 1
#   --keep DIR       keeps the sessions whose map is not complete
#
# Needs a network namespace of its own, so root or user namespaces. Exits 1 if a run's map is not
# complete: one submap with every photo, position RMSE at most 0.1 % of the extent.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

runs=20 only='' keep='' scenario=disjoint agents=3 photos=20 size=960x720
take_options "runs only scenario agents photos size keep" "$@"
[[ -z $keep ]] || { mkdir -p "$keep" && keep=$(realpath "$keep"); }
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place "$agents" "$photos" --scenario "$scenario" --size "$size" --seed 1
broken=0

# count_merges SESSION STEP: facts of merges so far; STEP: ordered, frozen, end
count_merges() {
  sqlite3 "file:$1/ledger.db?mode=ro" ".timeout 5000" \
    "SELECT COUNT(*) FROM facts WHERE kind = 'merge' AND fact_id LIKE 'merge/%/$2%'" 2>/dev/null || echo 0
}
are_ordered() { (($(count_merges "$1" ordered) >= $2)); }
is_over() { ! kill -0 "$1" 2>/dev/null; }

# By chance: which order it is that is disturbed, how long after, and who.
throw_dice() {
  RANDOM=$((1000 + $1))
  order=$((1 + RANDOM % 2)) delay_ms=$((RANDOM % 2000)) die=$RANDOM
}

# Kills at the dice's word, unless the session is over before; says whom, and where the merge was.
disturb() {
  local session=$1 finish_pid=$2 candidates
  throw_dice "$3"
  until are_ordered "$session" "$order"; do
    ! is_over "$finish_pid" || { echo "nobody, there was no order $order"; return; }
    sleep 0.05
  done
  sleep "$(printf '0.%03d' $((delay_ms % 1000)))"
  ((delay_ms < 1000)) || sleep 1
  candidates=(merger $(cd "$session/run" && ls mapper-*.pid | sed 's/\.pid$//'))
  victim=${candidates[die % ${#candidates[@]}]}
  if (($(count_merges "$session" end) >= $(count_merges "$session" ordered))); then
    where="after its end"
  elif (($(count_merges "$session" frozen) > $(count_merges "$session" end))); then
    where="frozen"
  else
    where="ordered"
  fi
  kill -9 "$(<"$session/run/$victim.pid")"
  echo "$victim, $delay_ms ms after order $order ($where)"
}

run_session() {
  local session=$1 run=$2 finish_pid
  start_services "$session" "$url"
  publish "$session"
  await_agents
  finish "$session" &
  finish_pid=$!
  ((run == 0)) || disturb "$session" "$finish_pid" "$run" >"$workspace/killed"
  wait "$finish_pid" || fail "finish failed"
  stop_services
}

# row RUN: one run, one line of the table
row() {
  local session=$workspace/run-$1 report=$workspace/run-$1/report.json start=$SECONDS verdict=complete rmse
  echo nobody >"$workspace/killed"
  run_session "$session" "$1" >"$workspace/run-$1.log" 2>&1 || { cat "$workspace/run-$1.log" >&2; return 1; }
  rmse=$(position_rmse "$session")
  jq -e --argjson n "$num_photos" --argjson rmse "$rmse" \
    '[.submaps[].images] == [$n] and .images.registered == $n and $rmse <= 0.1' "$report" >/dev/null ||
    {
      verdict="not complete: $(jq -c '[.submaps[].images], [.merges[] | select(.state == "undone") | .reason]' "$report" | tr '\n' ' ')"
      broken=1
      [[ -z $keep ]] || cp -r "$session" "$keep/"
    }
  printf '| %s | %s | %s | %s | %s | %.4f | %s | %s |\n' "$1" "$(<"$workspace/killed")" \
    "$(jq '[.merges[] | select(.state == "done")] | length' "$report")" \
    "$(jq '[.merges[] | select(.state == "undone")] | length' "$report")" \
    "$(jq .images.registered "$report")/$num_photos" "$rmse" "$((SECONDS - start))" "$verdict"
  rm -rf "$session"
}

if [[ -n $only ]]; then
  row "$only"
  exit "$broken"
fi
print_machine
echo '| run | killed | merges done | undone | registered | position RMSE, % of extent | wall s | map |'
echo '|---|---|---|---|---|---|---|---|'
for ((run = 0; run <= runs; run++)); do row "$run"; done
exit "$broken"
