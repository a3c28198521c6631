#!/usr/bin/env bash
# What faults cost: each service killed (kill -9) in mid-session, 5 % of datagrams lost, everything
# killed at once; registered photos and position error beside those of an undisturbed run.
#
#   benchmark/faults/faults.sh [--datasets DIR] [--faults "LIST"] [--places "synthetic fountain"]
#
#   --datasets DIR   holds fountain-P11 (default: ../shared/datasets beside the tree; left out if absent)
#   --faults "LIST"  of: ingest features-1 retrieval matching-1 mapper-1 merger loss everything
#
# Needs a network namespace of its own, so root or user namespaces. Exits 1 if a limit is broken:
# photos not accounted for, < 98 % of the photos, or > 1.2 x the error of the undisturbed run.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

datasets=$SKEIN_ROOT/../shared/datasets places="synthetic fountain"
faults="ingest features-1 retrieval matching-1 mapper-1 merger loss everything"
take_options "datasets faults places" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
broken=0

choose_place() {
  case $1 in
    synthetic) use_place 3 20 --seed 1 ;;
    fountain) use_photos fountain "$datasets"/fountain-P11/{images,gt_dense_cameras} ;;
    *) usage_error "unknown place $1" ;;
  esac
}

# inject SESSION FAULT: when a third of the photos are registered
inject() {
  [[ $2 != none && $2 != loss ]] || return 0
  wait_until 300 "a third of the photos are registered" has_facts "$1" registration $((num_photos / 3))
  if [[ $2 == everything ]]; then
    kill_everything "$1"
    start_services "$1" "$url" --mappers 1
    publish "$1"
  else
    kill_service "$1" "$2"
  fi
}

run_session() {
  local session=$1 fault=$2
  [[ $fault != loss ]] || lose_datagrams 5 1
  start_services "$session" "$url" --mappers 1
  publish "$session"
  inject "$session" "$fault"
  await_agents
  finish "$session"
  stop_services
  [[ $fault != loss ]] || report_losses >&2
}

# row PLACE FAULT: one run, one line of the table
row() {
  local session=$workspace/$1-$2 registered rmse verdict=ok start=$SECONDS
  run_session "$session" "$2" >"$workspace/$1-$2.log" 2>&1 || { cat "$workspace/$1-$2.log" >&2; return 1; }
  registered=$(jq .images.registered "$session/report.json")
  rmse=$(position_rmse "$session")
  if [[ $2 == none ]]; then
    base_registered=$registered base_rmse=$rmse
  fi
  is_accounted_for "$session/report.json" || verdict="not accounted for"
  jq -en "$registered >= 0.98 * $base_registered and $rmse <= 1.2 * $base_rmse" >/dev/null || verdict="beyond the limit"
  [[ $verdict == ok ]] || broken=1
  printf '| %s | %s | %s/%s | %s | %s | %s |\n' "$1" "$2" "$registered" "$num_photos" "$rmse" \
    "$((SECONDS - start))" "$verdict"
}

print_machine
echo '| photos | fault | registered | position RMSE, % of extent | wall s | verdict |'
echo '|---|---|---|---|---|---|'
for name in $places; do
  [[ $name != fountain || -d $datasets/fountain-P11 ]] || { echo "no $datasets/fountain-P11: left out"; continue; }
  choose_place "$name"
  for fault in none $faults; do row "$name" "$fault"; done
done
exit "$broken"
