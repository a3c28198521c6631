#!/usr/bin/env bash
# Chaos: processes are killed and stopped at random, agents vanish and come back, datagrams are lost, all
# from one seed; then the session finishes, and an independent checker reads what is left.
#
#   benchmark/chaos.sh [--seeds "LIST"] [--seconds S] [--agents N] [--photos N] [--keep DIR]
#
#   --seeds "LIST"  a session each (default "1 2 3")
#   --seconds S     the photos are sent over S seconds (default 60); the faults go on until the finish
#                   is over
#   --agents N --photos N   of the synthetic place (default 3 and 12)
#   --keep DIR      keeps the sessions there
#
# An even seed goes over tcpq and its relays, an odd one over udpm. Every third loses 20 % of its
# datagrams. A fault every 0.5 to 3 s, every 3 to 8 s during the finish: of ten, six kill a process
# (kill -9), two stop one (SIGSTOP) for up to 15 s, two kill an agent, which is started again at once.
#
# A row: kills, stops, agents killed; photos that agents sent and that the ledger lacks; breaches that
# session_invariants found; registered photos and position RMSE, beside those of seed 0, which nothing
# disturbs. Exits 1 if anything is lost or broken, a session does not finish within 10 minutes, or its
# RMSE is above twice the undisturbed one. Needs a network namespace of its own, so root or user
# namespaces.
source "$(dirname "$0")/../tests/harness.sh"
source "$(dirname "$0")/../tests/session.sh"

seeds="1 2 3" seconds=60 agents=3 photos=12 keep=''
readonly finish_limit_s=600
take_options "seeds seconds agents photos keep" "$@"
enter_network_namespace "$@"
new_workspace
use_place "$agents" "$photos" --seed 1
keep=${keep:-$workspace}
mkdir -p "$keep"
broken=0

# below N: a number from 0 to N - 1, from the seed
below() { drawn=$((RANDOM % $1)); }

# Sets `instance` and `pid` of a process that runs.
draw_process() {
  local files=("$session"/run/*.pid)
  below ${#files[@]}
  instance=$(basename "${files[drawn]}" .pid) pid=$(cat "${files[drawn]}" 2>/dev/null) && [[ -n $pid ]]
}

stop_process() {
  below 15
  local for_s=$((1 + drawn))
  kill -STOP "$pid" 2>/dev/null || return 0
  num_stops=$((num_stops + 1))
  (sleep "$for_s" && kill -CONT "$pid") 2>/dev/null &
}

# start_agent FOLDER: repeats until all of it is acknowledged
start_agent() {
  "$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name "$(basename "$1")" --images "$1" \
    --rate "$rate" >>"$workspace/agents.log" 2>&1 &
  agent_of[$1]=$!
}
kill_agent() {
  local folders=("$place"/images/*/)
  below ${#folders[@]}
  local folder=${folders[drawn]}
  kill -9 "${agent_of[$folder]}" 2>/dev/null || return 0 # it has sent all
  num_agents_killed=$((num_agents_killed + 1))
  start_agent "$folder"
}

fault() {
  below 10
  case $drawn in
    [0-5]) ! draw_process || { kill -9 "$pid" 2>/dev/null && num_kills=$((num_kills + 1)); } || true ;;
    [67]) ! draw_process || stop_process ;;
    *) kill_agent ;;
  esac
}

any_agent_sends() {
  local folder
  for folder in "${!agent_of[@]}"; do kill -0 "${agent_of[$folder]}" 2>/dev/null && return 0; done
  return 1
}

# disturb MIN_DS MAX_DS COMMAND...: a fault every so many tenths of a second while the command holds
disturb() {
  local min_ds=$1 span_ds=$(($2 - $1)) started=$SECONDS
  shift 2
  while "$@"; do
    ((SECONDS - started < seconds + finish_limit_s)) || return 1
    below "$span_ds"
    local pause_ds=$((min_ds + drawn))
    sleep "$((pause_ds / 10)).$((pause_ds % 10))"
    [[ $seed == 0 ]] || fault
  done
}

run_session() {
  session=$keep/seed-$seed num_kills=0 num_stops=0 num_agents_killed=0 RANDOM=$seed
  declare -gA agent_of=()
  url='udpm://239.255.76.67:7667?ttl=0'
  ((seed % 2)) || url=tcpq://127.0.0.1:7700
  unset LD_PRELOAD
  ((seed == 0 || seed % 3)) || lose_datagrams 20 "$seed"
  rm -rf "$session"
  start_services "$session" "$url" --hang-after 5
  local folder rate
  rate=$(jq -n "$photos / $seconds")
  for folder in "$place"/images/*/; do start_agent "$folder"; done
  disturb 5 30 any_agent_sends || return 1
  "$SKEIN_BUILD/bin/skein" finish --session "$session" --lcm-url "$url" >"$session.finish" 2>&1 &
  finish_pid=$! finish_started=$SECONDS
  disturb 30 80 kill -0 "$finish_pid" 2>/dev/null || return 1
  wait "$finish_pid"
}

row() {
  seed=$1
  local verdict=ok lost='-' rmse='-'
  run_session >"$keep/seed-$1.log" 2>&1 || verdict="not finished"
  local finish_s=$((SECONDS - finish_started))
  stop_services >>"$keep/seed-$1.log" 2>&1
  unset LD_PRELOAD
  "$SKEIN_BUILD/bin/session_invariants" "$session" "$place"/images/*/ >"$session.invariants" 2>&1 || verdict="broken"
  lost=$(grep -c 'is in the ledger 0 times' "$session.invariants" || true)
  [[ ! -e $session/report.json ]] || rmse=$(position_rmse "$session" || echo -)
  if [[ $1 == 0 ]]; then base_rmse=$rmse; fi
  jq -en "$rmse <= 2 * $base_rmse" >/dev/null 2>&1 || [[ $verdict != ok ]] || verdict="other poses"
  [[ $verdict == ok ]] || broken=1
  printf '| %s | %s | %s | %s, %s, %s | %s | %s | %s/%s | %s | %s | %s |\n' "$1" "${url%%:*}" \
    "$( ((seed == 0 || seed % 3)) && echo 0 || echo 20)" "$num_kills" "$num_stops" "$num_agents_killed" "$lost" \
    "$(grep -c ^breach: "$session.invariants" || true)" "$(jq .images.registered "$session/report.json" 2>/dev/null || echo 0)" \
    "$num_photos" "$rmse" "$finish_s" "$verdict"
}

print_machine
echo '| seed | transport | loss, % | kills, stops, agents killed | photos lost | breaches | registered | position RMSE, % | finish, s | verdict |'
echo '|---|---|---|---|---|---|---|---|---|---|'
for seed in 0 $seeds; do row "$seed"; done
exit "$broken"
