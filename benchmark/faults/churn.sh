#!/usr/bin/env bash
# Workers join and leave at random, as spot machines and preempted jobs do, while a session gets its photos.
#
#   benchmark/faults/churn.sh [--workers N] [--minutes M] [--seed N] [--agents N] [--photos N] [--images DIR [--truth DIR]] [--keep DIR]
#
#   --workers N     that join and leave (default 100), at most eight at a time
#   --minutes M     over which workers come, and photos (default 20)
#   --seed N        of when a worker joins, how long it stays and how it ends (default 1)
#   --agents N --photos N   of the synthetic place, photos of each agent (default 3 and 40)
#   --images DIR    one agent's photos instead: a folder that holds nothing else
#   --truth DIR     their ground truth, as `skein evaluate` takes it
#   --keep DIR      keeps the sessions there
#
# Over tcpq and its relays. The session's host has mappers alone. A worker is launch.sh --join by an invitation of its own, with
# one process for features and one for matching. It stays for 1 s to 8 M / N minutes. Then it ends: half of them are preempted
# (SIGTERM to launch.sh), half killed (SIGKILL to all its processes). After the last one, one more worker joins and stays
# until the finish is over. Where a truth is known, the same photos come first to a session with one worker that stays.
#
# A row: workers that joined, that were ready before they ended, preempted, killed, ended by themselves; the slowest to
# leave after SIGTERM; photos lost: sent and not in the ledger, or failed; breaches that session_invariants found; registered photos;
# placements (by each submap itself) a registered photo; position RMSE. Exits 1 if a photo is lost that the undisturbed session
# has, a breach is found, or a session does not finish within 30 minutes. Needs a network namespace of its own, so root or
# user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

workers=100 minutes=20 seed=1 agents=3 photos=40 images='' truth='' keep=''
readonly most_alive=8 finish_limit_s=1800
take_options "workers minutes seed agents photos images truth keep" "$@"
for name in workers minutes seed agents photos; do
  [[ ${!name} =~ ^[1-9][0-9]*$ ]] || usage_error "--$name needs a number from 1 on, not '${!name}'"
done
[[ -z $images || -d $images ]] || usage_error "--images: no folder $images"
[[ -z $truth || -n $images ]] || usage_error "--truth is the ground truth of --images"
readonly period_ds=$((minutes * 600 / workers)) # from a worker to the next, on average
((period_ds > 0)) || usage_error "$workers workers in $minutes minutes: ten a second at most"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || die "no network namespace may be made here"
new_workspace
url=tcpq://127.0.0.1:7700
if [[ -n $images ]]; then
  use_photos agent "$images" "${truth:-$images}"
else
  use_place "$agents" "$photos" --seed 1 --size 800x600
fi
folders=("$place"/images/*/)
keep=${keep:-$workspace}
mkdir -p "$keep"
skein=$SKEIN_BUILD/bin/skein
broken=0 base_lost=0

# below N: a number from 0 to N - 1, from the seed
below() { drawn=$((RANDOM % $1)); }
read_clock() { now_ms=$((${EPOCHREALTIME/[.,]/} / 1000)); }

# join_worker NAME: sets joined, its process and process group
join_worker() {
  local folder=$workspace/workers/$mode/$1 link
  mkdir -p "$folder"
  link=$("$skein" invite --session "$session" --lcm-url "$url" --role worker --name "$1" 2>/dev/null) || fail "skein invite --name $1"
  setpriv --pdeathsig TERM -- setsid "$SKEIN_ROOT/scripts/launch.sh" --join "$link" --session "$folder/session" --build "$SKEIN_BUILD" \
    --mappers 0 --features 1 --matching 1 --threads 1 --ready-file "$folder/ready" >"$folder/launch.log" 2>&1 &
  joined=$!
}
is_ready() { [[ -s $workspace/workers/$mode/$1/ready ]]; }

# All that is drawn of a worker is drawn when it joins: the order is the seed's, whatever the load.
add_worker() {
  num_joined=$((num_joined + 1))
  join_worker "worker-$num_joined"
  name_of[$joined]=worker-$num_joined
  below $((2 * period_ds))
  next_ms=$((next_ms + 100 * drawn))
  below $((most_alive * period_ds))
  ends_ms[$joined]=$((now_ms + 1000 + 100 * drawn))
  below 2
  is_killed[$joined]=$drawn
}

# end_worker PID
end_worker() {
  unset "ends_ms[$1]"
  ! is_ready "${name_of[$1]}" || num_ready=$((num_ready + 1))
  if ! kill -0 "$1" 2>/dev/null; then
    num_ended=$((num_ended + 1))
    warn "${name_of[$1]} ended by itself: $(tail -n 1 "$workspace/workers/$mode/${name_of[$1]}/launch.log")"
  elif ((${is_killed[$1]})); then
    kill -KILL -- "-$1"
    num_killed=$((num_killed + 1))
  else
    kill -TERM "$1"
    num_preempted=$((num_preempted + 1))
    leaving_ms[$1]=$now_ms
  fi
}

note_who_left() {
  local pid took_ms
  for pid in "${!leaving_ms[@]}"; do
    ! kill -0 "$pid" 2>/dev/null || continue
    took_ms=$((now_ms - ${leaving_ms[$pid]}))
    ((took_ms <= slowest_ms)) || slowest_ms=$took_ms
    unset "leaving_ms[$pid]"
  done
}

num_alive() { echo $((${#ends_ms[@]} + ${#leaving_ms[@]})); }

churn() {
  local pid next_ms
  local -A name_of=() ends_ms=() is_killed=() leaving_ms=()
  RANDOM=$seed
  read_clock
  next_ms=$now_ms
  while ((num_joined < workers || $(num_alive) > 0)); do
    read_clock
    note_who_left
    for pid in "${!ends_ms[@]}"; do ((now_ms < ${ends_ms[$pid]})) || end_worker "$pid"; done
    ((num_joined >= workers || now_ms < next_ms || $(num_alive) >= most_alive)) || add_worker
    sleep 0.2
  done
}

# stay: one worker that nothing disturbs
stay() {
  join_worker stays
  wait_until 120 "a worker joins" is_ready stays
  staying_pid=$joined
}

run_session() {
  num_joined=0 num_ready=0 num_preempted=0 num_killed=0 num_ended=0 slowest_ms=0 staying_pid=''
  start_reconstruction "$session" "$url" --features 0 --matching 0
  [[ $mode != undisturbed ]] || stay
  publish "$session" --rate "$(jq -n "$num_photos / ${#folders[@]} / ($minutes * 60)")"
  [[ $mode == undisturbed ]] || churn
  await_agents
  [[ -n $staying_pid ]] || stay
  timeout "$finish_limit_s" "$skein" finish --session "$session" --lcm-url "$url"
}

row() {
  mode=$1 session=$keep/$1
  local verdict=ok lost failed rmse='-' started=$SECONDS
  rm -rf "$session"
  run_session >"$keep/$mode.log" 2>&1 || verdict="not finished"
  [[ -z $staying_pid ]] || { kill -TERM "$staying_pid" && wait "$staying_pid"; } 2>/dev/null || true
  stop_services >>"$keep/$mode.log" 2>&1
  "$SKEIN_BUILD/bin/session_invariants" "$session" "${folders[@]}" >"$session.invariants" 2>&1 || [[ $verdict != ok ]] || verdict=broken
  failed=$(jq .images.failed "$session/report.json" 2>/dev/null) || failed=0
  lost=$(($(grep -c 'is in the ledger 0 times' "$session.invariants" || true) + failed))
  [[ $mode != undisturbed ]] || base_lost=$lost
  ((lost <= base_lost)) || verdict="photos lost"
  [[ -n $images && -z $truth || ! -e $session/report.json ]] || rmse=$(position_rmse "$session" || echo -)
  [[ $verdict == ok ]] || broken=1
  printf '| %s | %s, %s, %s, %s, %s | %s | %s | %s | %s/%s | %s | %s | %s | %s |\n' "$mode" "$num_joined" "$num_ready" "$num_preempted" \
    "$num_killed" "$num_ended" "$(jq -n "$slowest_ms / 1000")" "$lost" "$(grep -c ^breach: "$session.invariants" || true)" \
    "$(jq .images.registered "$session/report.json" 2>/dev/null || echo 0)" "$num_photos" \
    "$(jq '.images | if .registered > 0 then .placements / .registered * 1000 | round / 1000 else "-" end' "$session/report.json" 2>/dev/null || echo -)" \
    "$rmse" "$((SECONDS - started))" "$verdict"
}

print_machine
echo "$num_photos photos over $minutes minutes, $workers workers, seed $seed"
echo '| session | workers joined, ready, preempted, killed, ended by themselves | slowest to leave, s | photos lost | breaches | registered | placements a photo | position RMSE, % | wall s | verdict |'
echo '|---|---|---|---|---|---|---|---|---|---|'
[[ -n $images && -z $truth ]] || row undisturbed
row churn
exit "$broken"
