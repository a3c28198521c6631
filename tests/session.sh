# Sessions for process tests and for benchmark/faults/faults.sh: source it after harness.sh.
# Wants `workspace` (new_workspace) and `url`.

agent_pids=()

# use_place AGENTS PHOTOS [skein sim's options...]: sets `place` and `num_photos`. Rendered once a
# build folder; tests that run at the same time wait for each other.
use_place() {
  place=$SKEIN_BUILD/test_places/$(tr -c 'A-Za-z0-9\n' '_' <<<"$*")
  num_photos=$(($1 * $2))
  mkdir -p "$SKEIN_BUILD/test_places"
  (
    flock 7
    render_place "$place" "$@"
  ) 7>"$place.lock"
}

# use_small_place: what most tests want, a place whose 16 photos become one map. Its photos are small: it is not the pixels
# that these tests are about, and in those SIFT takes most of the time.
use_small_place() { use_place 2 8 --seed 1 --size 800x600; }

# use_photos AGENT FOLDER TRUTH: one agent's real photos
use_photos() {
  place=$workspace/photos-$1
  mkdir -p "$place/images"
  ln -sfn "$(realpath -m "$2")" "$place/images/$1"
  ln -sfn "$(realpath -m "$3")" "$place/truth"
  num_photos=$(find "$2/" -maxdepth 1 -type f | wc -l)
}

# start_reconstruction SESSION URL [launch.sh's options...]: start_services without the live view, the guide and depth maps,
# for tests that look at none of them: three processes fewer to start and to stop, and their work
start_reconstruction() { start_services "$1" "$2" --web 0 --guide off --dense off "${@:3}"; }

# use_faulty SERVICE...: sets `programs`, the build with faulty_SERVICE in place of skein-SERVICE
use_faulty() {
  local service faulty
  programs=$workspace/build
  mkdir -p "$programs/bin"
  ln -s "$SKEIN_BUILD"/bin/* "$programs/bin/"
  for service in "$@"; do
    faulty=$(find "$SKEIN_BUILD" -name "faulty_$service" -type f -perm -u+x | head -n 1)
    [[ -n $faulty ]] || fail "no faulty_$service in $SKEIN_BUILD"
    ln -sf "$faulty" "$programs/bin/skein-$service"
  done
}

# publish SESSION [agent's options...]: all agents of the place, in the background
publish() {
  local session=$1 folder
  shift
  for folder in "$place"/images/*/; do publish_agent "$session" "$folder" "$@"; done
}
# publish_agent SESSION FOLDER [agent's options...]: one of them
publish_agent() {
  local session=$1 folder=$2
  shift 2
  "$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name "$(basename "$folder")" \
    --images "$folder" "$@" >>"$workspace/agents.log" 2>&1 &
  agent_pids+=($!)
}

await_agents() {
  local pid
  for pid in "${agent_pids[@]}"; do
    wait "$pid" || { cat "$workspace/agents.log"; fail "an agent failed"; }
  done
  agent_pids=()
}

# publish_part SESSION FIRST LAST: photos FIRST to LAST of each agent
publish_part() {
  local folder part name
  for folder in "$place"/images/*/; do
    part=$workspace/part-$2/$(basename "$folder")
    mkdir -p "$part"
    for name in $(ls "$folder" | sed -n "$2,$3p"); do cp "$folder/$name" "$part/"; done
    publish_agent "$1" "$part"
  done
  await_agents
}

# two_submaps_have SESSION N: N photos or more each; a registration's fact is registration/IMAGE/SUBMAP/...
two_submaps_have() {
  [[ $(sqlite3 "file:$1/ledger.db?mode=ro" ".timeout 5000" "SELECT fact_id FROM facts WHERE kind = 'registration'" 2>/dev/null |
    cut -d / -f 3 | sort | uniq -c | awk -v n="$2" '$1 >= n' | wc -l) == 2 ]]
}

# status_holds SESSION [JQ_OPTION...] FILTER: what `skein status` tells of the session
status_holds() {
  local session=$1
  shift
  "$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url" 2>/dev/null | jq -e "$@" >/dev/null
}

finish() {
  "$SKEIN_BUILD/bin/skein" finish --session "$1" --lcm-url "$url" >"$workspace/finish.log" 2>&1 ||
    { cat "$workspace/finish.log"; fail "finish failed"; }
}

# count_facts SESSION KIND
count_facts() {
  sqlite3 "file:$1/ledger.db?mode=ro" ".timeout 5000" "SELECT COUNT(*) FROM facts WHERE kind = '$2'" 2>/dev/null || echo 0
}
has_facts() { (($(count_facts "$1" "$2") >= $3)); }

# kill_service SESSION INSTANCE: kill -9, and waits until launch.sh has started it again
kill_service() {
  local session=$1 instance=$2 old
  old=$(<"$session/run/$instance.pid")
  kill -9 "$old"
  wait_until 20 "$instance is started again" is_started_anew "$session" "$instance" "$old"
}
is_started_anew() {
  local now
  now=$(cat "$1/run/$2.pid" 2>/dev/null) && [[ -n $now && $now != "$3" ]]
}

# position_rmse SESSION: % of the extent, of the largest model
position_rmse() {
  "$SKEIN_BUILD/bin/skein" evaluate --json "$1/sparse/0" "$place/truth" | jq -r .position_rmse_percent
}

# expect_model SESSION MAX_RMSE_PERCENT: every photo of the place accounted for, at least 98 %
# registered, positions true
expect_model() {
  local report=$1/report.json rmse
  is_accounted_for "$report" || fail "photos are not accounted for: $(jq -c .images "$report")"
  jq -e --argjson n "$num_photos" '.images | .received == $n and .registered >= 0.98 * $n' "$report" >/dev/null ||
    fail "of $num_photos photos: $(jq -c '{images, failures}' "$report")"
  rmse=$(position_rmse "$1")
  echo "$(jq .images.registered "$report")/$num_photos registered, position RMSE $rmse % of the extent"
  jq -en --argjson rmse "$rmse" --argjson limit "$2" '$rmse <= $limit' >/dev/null ||
    fail "position RMSE $rmse % of the extent, above $2 %"
}

# lose_datagrams PERCENT SEED: of every process that is started from now on
lose_datagrams() {
  export LD_PRELOAD=$drop_shim SKEIN_DROP_PERCENT=$1 SKEIN_DROP_SEED=$2 SKEIN_DROP_LOG=$workspace/drops
}
report_losses() {
  unset LD_PRELOAD
  awk '{ sent += $3; dropped += $4 } END { printf "%d of %d datagrams dropped\n", dropped, sent; exit dropped == 0 }' \
    "$workspace/drops" || fail "no datagram was dropped"
}

# kill_everything SESSION: launch.sh, services and agents, at once
kill_everything() {
  kill -9 "$launch_pid" "${agent_pids[@]}" $(cat "$1"/run/*.pid)
  wait "$launch_pid" "${agent_pids[@]}" 2>/dev/null || true
  launch_pid='' agent_pids=()
}

# add_other_host SECONDS: a second host, within SECONDS: a network namespace that a sleeping process holds
# open (`other_host`). A cable joins it, 10.77.0.2, with this one, 10.77.0.1.
add_other_host() {
  setpriv --pdeathsig KILL -- unshare --net sleep infinity &
  other_host=$!
  wait_until "$1" "the second host exists" has_own_network "$other_host"
  ip link add cable type veth peer name cable_end netns "$other_host"
  ip addr add 10.77.0.1/24 dev cable
  ip link set cable up
  nsenter --net -t "$other_host" ip addr add 10.77.0.2/24 dev cable_end
  nsenter --net -t "$other_host" ip link set cable_end up
}
has_own_network() { # while it starts a program, a process does not tell
  local there
  there=$(readlink "/proc/$1/ns/net") && [[ -n $there && $there != "$(readlink /proc/$$/ns/net)" ]]
}
