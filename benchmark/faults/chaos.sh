#!/usr/bin/env bash
# Chaos: processes are killed and stopped at random, agents vanish and come back, datagrams are lost, links
# are cut, the disk fills, the clock jumps, all from one seed; then the session finishes, and an independent
# checker reads what is left.
#
#   benchmark/faults/chaos.sh [--seeds "LIST"] [--seconds S] [--agents N] [--photos N] [--keep DIR]
#
#   --seeds "LIST"  a session each (default "1 2 3")
#   --seconds S     the photos are sent over S seconds (default 60), and agents are killed for as long; the
#                   other faults go on until the finish is over
#   --agents N --photos N   of the synthetic place (default 3 and 12)
#   --keep DIR      keeps the sessions there
#
# An even seed goes over tcpq and its relays, an odd one over udpm. Every third loses 20 % of its
# datagrams. A fault every 0.5 to 3 s, every 3 to 8 s during the finish. Of twenty, eleven kill a process
# (kill -9), a relay as any other; three stop one (SIGSTOP) for up to 15 s; three kill an agent, which is
# started again at once; one each cuts every link for up to 5 s, fills the disk for up to 8 s, and sets the
# clock of all processes by up to an hour, ahead or back (Debian: libfaketime; without it, no clock jumps).
#
# A row: kills, stops, agents killed, cuts, full disks, clock jumps; photos that agents sent and that the ledger lacks; breaches that
# session_invariants found; registered photos and position RMSE, beside those of seed 0, which nothing
# disturbs. Exits 1 if anything is lost or broken, a session does not finish within 10 minutes, or its
# RMSE is above twice the undisturbed one. Needs a network namespace of its own, so root or user
# namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

seeds="1 2 3" seconds=60 agents=3 photos=12 keep=''
readonly finish_limit_s=600 disk_mib=600
take_options "seeds seconds agents photos keep" "$@"
enter_network_namespace "$@"
new_workspace
use_place "$agents" "$photos" --seed 1
keep=${keep:-$workspace}
disk=$workspace/disk
mkdir -p "$keep" "$disk"
broken=0
clock_shim=$(find /usr/lib -name libfaketimeMT.so.1 -print -quit)

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

# The link that carries both transports.
cut_links() {
  below 5
  num_cuts=$((num_cuts + 1))
  ip link set lo down
  sleep $((1 + drawn))
  ip link set lo up multicast on
  ip route replace 224.0.0.0/4 dev lo src 127.0.0.1
}

fill_disk() {
  below 8
  num_full=$((num_full + 1))
  dd if=/dev/zero of="$disk/ballast" bs=64k 2>/dev/null || true
  sleep $((1 + drawn))
  rm -f "$disk/ballast"
}

set_clock() {
  [[ -n $clock_shim ]] || return 0
  below 7201
  num_jumps=$((num_jumps + 1))
  printf '%+d\n' $((drawn - 3600)) >"$workspace/clock.new"
  mv "$workspace/clock.new" "$workspace/clock"
}
use_clock() {
  [[ -n $clock_shim ]] || return 0
  echo '+0' >"$workspace/clock"
  export LD_PRELOAD=${LD_PRELOAD:+$LD_PRELOAD:}$clock_shim FAKETIME_TIMESTAMP_FILE=$workspace/clock
  export FAKETIME_CACHE_DURATION=1 FAKETIME_DONT_FAKE_MONOTONIC=1 DONT_FAKE_MONOTONIC=1 NO_FAKE_STAT=1
}

# start_agent FOLDER: repeats until all of it is acknowledged
start_agent() {
  "$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name "$(basename "$1")" --images "$1" \
    --rate "$rate" >>"$workspace/agents.log" 2>&1 &
  agent_of[$1]=$!
}
# One that begins anew again and again would never come to its last photo.
kill_agent() {
  ((SECONDS - session_started < seconds)) || return 0
  local folders=("$place"/images/*/)
  below ${#folders[@]}
  local folder=${folders[drawn]}
  kill -9 "${agent_of[$folder]}" 2>/dev/null || return 0 # it has sent all
  num_agents_killed=$((num_agents_killed + 1))
  start_agent "$folder"
}

fault() {
  below 20
  case $drawn in
    0) cut_links ;;
    1) fill_disk ;;
    2) set_clock ;;
    [3-5]) ! draw_process || stop_process ;;
    [6-8]) kill_agent ;;
    *) ! draw_process || { kill -9 "$pid" 2>/dev/null && num_kills=$((num_kills + 1)); } || true ;;
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
  num_kills=0 num_stops=0 num_agents_killed=0 num_cuts=0 num_full=0 num_jumps=0 RANDOM=$seed
  declare -gA agent_of=()
  session_started=$SECONDS
  url='udpm://239.255.76.67:7667?ttl=0'
  ((seed % 2)) || url=tcpq://127.0.0.1:7700
  unset LD_PRELOAD
  ((seed == 0 || seed % 3)) || lose_datagrams 20 "$seed"
  use_clock
  mount -t tmpfs -o "size=${disk_mib}m" none "$disk"
  start_services "$session" "$url" --hang-after 5
  local folder rate
  rate=$(jq -n "$photos / $seconds")
  for folder in "$place"/images/*/; do start_agent "$folder"; done
  disturb 5 30 any_agent_sends || return 1
  "$SKEIN_BUILD/bin/skein" finish --session "$session" --lcm-url "$url" >"$keep/seed-$seed.finish" 2>&1 &
  finish_pid=$! finish_started=$SECONDS
  disturb 30 80 kill -0 "$finish_pid" 2>/dev/null || return 1
  wait "$finish_pid"
}

row() {
  seed=$1 session=$disk/seed-$1
  local verdict=ok lost='-' rmse='-'
  run_session >"$keep/seed-$1.log" 2>&1 || verdict="not finished"
  local finish_s=$((SECONDS - finish_started))
  stop_services >>"$keep/seed-$1.log" 2>&1
  unset LD_PRELOAD
  rm -rf "$keep/seed-$1"
  cp -a "$session" "$keep/"
  umount "$disk"
  session=$keep/seed-$1
  "$SKEIN_BUILD/bin/session_invariants" "$session" "$place"/images/*/ >"$session.invariants" 2>&1 || verdict="broken"
  lost=$(grep -c 'is in the ledger 0 times' "$session.invariants" || true)
  [[ ! -e $session/report.json ]] || rmse=$(position_rmse "$session" || echo -)
  if [[ $1 == 0 ]]; then base_rmse=$rmse; fi
  jq -en "$rmse <= 2 * $base_rmse" >/dev/null 2>&1 || [[ $verdict != ok ]] || verdict="other poses"
  [[ $verdict == ok ]] || broken=1
  printf '| %s | %s | %s | %s, %s, %s, %s, %s, %s | %s | %s | %s/%s | %s | %s | %s |\n' "$1" "${url%%:*}" \
    "$( ((seed == 0 || seed % 3)) && echo 0 || echo 20)" "$num_kills" "$num_stops" "$num_agents_killed" "$num_cuts" "$num_full" "$num_jumps" "$lost" \
    "$(grep -c ^breach: "$session.invariants" || true)" "$(jq .images.registered "$session/report.json" 2>/dev/null || echo 0)" \
    "$num_photos" "$rmse" "$finish_s" "$verdict"
}

print_machine
echo '| seed | transport | loss, % | kills, stops, agents killed, cuts, full disks, clock jumps | photos lost | breaches | registered | position RMSE, % | finish, s | verdict |'
echo '|---|---|---|---|---|---|---|---|---|---|'
for seed in 0 $seeds; do row "$seed"; done
exit "$broken"
