#!/usr/bin/env bash
# What good agents feel of a hostile network: the latency of their photos with and without 20 agents that
# vanish, 5 workers that hang and a client that floods the relay at full speed.
#
#   benchmark/faults/hostile_network.sh [--agents N] [--photos N] [--size WxH] [--rate HZ] [--vanishing N] [--flood KIND] [--keep DIR]
#
#   --agents N     good ones (default 1)
#   --photos N     of each (default 100)
#   --size WxH     of the photos (default 1280x960)
#   --rate HZ      photos a second, of all good agents together (default 0.33)
#   --vanishing N  agents that stop right before the first bytes of their photo (default 20)
#   --flood KIND   stranger (default): has no credential, and says again what it overhears, one bit altered, so
#                  that each message costs the relay a signature. member: a viewer that has an invitation, whose
#                  heartbeats everybody takes. none
#   --keep DIR     keeps the sessions there
#
# Two sessions on a synthetic place, over tcpq with relays and --auth require. In the second, before the good
# agents begin, the agents vanish (kill -9), five workers that have joined and wait for work are stopped (SIGSTOP: two for
# features, two for matching, a mapper), and the flood begins; all of it lasts until the last photo is worked in.
#
# Latency: from ingest's receipt of a photo to ingest's commit of its registration, of the photos of good agents that
# are registered. Relay: messages that it received, and refused, a second. Needs a network namespace of its own, so root or
# user namespaces. Exits 1 if a photo is not registered in the second run that is in the first, or if the 95th
# percentile is above twice that of the first.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

agents=1 photos=100 size=1280x960 rate=0.33 vanishing=20 flood=stranger keep=''
take_options "agents photos size rate vanishing flood keep" "$@"
[[ $flood == stranger || $flood == member || $flood == none ]] || usage_error "--flood $flood: stranger, member or none"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || die "no network namespace may be made here"
new_workspace
url=tcpq://127.0.0.1:7700
use_place "$agents" "$photos" --seed 1 --size "$size"
skein=$SKEIN_BUILD/bin/skein
readonly hung_workers="features features matching matching mapper"

status() { "$skein" status --once --json --session "$1" --lcm-url "$url" 2>/dev/null; }

# vanish SESSION: they stop before their first chunk, and are killed
vanish() {
  local i gone=()
  for ((i = 1; i <= vanishing; i++)); do
    mkdir -p "$workspace/gone-$i"
    head -c 50000 /dev/urandom >"$workspace/gone-$i/photo.jpg"
    LD_PRELOAD=$stop_shim SKEIN_STOP_AT=before SKEIN_STOP_TEXT=SKEIN_BLOB_CHUNK SKEIN_STOP_MARK=$workspace/stopped-$i \
      "$skein" agent --session "$1" --lcm-url "$url" --auth require --name "gone-$i" --images "$workspace/gone-$i" >>"$workspace/gone.log" 2>&1 &
    gone+=($!)
  done
  wait_until 120 "$vanishing agents are half-way" all_have_stopped
  kill -9 "${gone[@]}"
  wait "${gone[@]}" 2>/dev/null || true
}
all_have_stopped() { (($(find "$workspace" -maxdepth 1 -name 'stopped-*' -size +0 | wc -l) == vanishing)); }

# hang SESSION: sets hung_pids
hang() {
  local kind i=0
  hung_pids=()
  for kind in $hung_workers; do
    i=$((i + 1))
    "$SKEIN_BUILD/bin/skein-$kind" --session "$1" --lcm-url "$url" --auth require --instance "hung-$i" >>"$workspace/hung.log" 2>&1 &
    hung_pids+=($!)
  done
  wait_until 60 "workers that will hang have joined" have_joined "$1" "$i"
  kill -STOP "${hung_pids[@]}"
}
have_joined() { [[ $(status "$1" | jq '[.instances[] | select(.instance | startswith("hung-"))] | length') == "$2" ]]; }

# begin_flood SESSION: sets flood_pid
begin_flood() {
  local link=()
  flood_pid=''
  [[ $flood != none ]] || return 0
  [[ $flood != member ]] || link=("$("$skein" invite --session "$1" --lcm-url "$url" --role viewer --name mallory 2>/dev/null)")
  setpriv --pdeathsig TERM -- "$SKEIN_BUILD/bin/flooder" "$url" "${link[@]}" >"$workspace/flooder.log" 2>&1 &
  flood_pid=$!
  wait_until 30 "the flood begins" grep -q '^ready flooder' "$workspace/flooder.log"
}

is_worked_in() { status "$1" | jq -e --argjson n "$num_photos" '.images | .received >= $n and .in_flight == 0' >/dev/null; }

# run NAME: leaves $workspace/NAME.json {photos, registered, p50, p95, relay: messages a second, refused a second}
run() {
  local session=$workspace/$1 before after
  start_services "$session" "$url" --auth require --web 0
  if [[ $1 == hostile ]]; then
    vanish "$session"
    hang "$session"
    begin_flood "$session"
  fi
  before=$(status "$session" | relay_counts)
  publish "$session" --auth require --rate "$(jq -n "$rate / $agents")"
  await_agents
  wait_until 600 "every photo is worked in" is_worked_in "$session"
  after=$(status "$session" | relay_counts)
  if [[ $1 == hostile ]]; then
    [[ -z $flood_pid ]] || kill "$flood_pid"
    kill -KILL "${hung_pids[@]}"
    wait "${hung_pids[@]}" 2>/dev/null || true
  fi
  finish "$session"
  stop_services
  jq -n --argjson before "$before" --argjson after "$after" --argjson n "$num_photos" --slurpfile report "$session/report.json" '
    def at($p): .[((length - 1) * $p) | round] * 100 | round / 100;
    ([$report[0].images_in_time[] | select(.registered_s != null) | .registered_s - .received_s] | sort) as $latency
    | ($after.at - $before.at) as $seconds
    | {photos: $n, registered: ($latency | length), p50: ($latency | at(.5)), p95: ($latency | at(.95)),
       messages: (($after.done - $before.done) / $seconds | round), refused: (($after.refused - $before.refused) / $seconds | round)}' >"$session.json"
  [[ -z $keep ]] || { mkdir -p "$keep" && cp -a "$session" "$session.json" "$keep/"; }
}
relay_counts() { jq -c '[.instances[] | select(.service == "relay")] | {at: now, done: map(.done) | add, refused: map(.refused) | add}'; }

run undisturbed
run hostile
print_machine
echo "$agents good agents, $photos photos of $size each, $rate photos a second; $vanishing vanished agents, $(wc -w <<<"$hung_workers") hung workers, flood: $flood"
jq -nr --slurpfile quiet "$workspace/undisturbed.json" --slurpfile hostile "$workspace/hostile.json" '
  def row($name): "| \($name) | \(.registered)/\(.photos) | \(.p50) | \(.p95) | \(.messages) | \(.refused) |";
  def ratio(f): ($hostile[0] | f) / ($quiet[0] | f) * 100 | round / 100;
  "| | registered | photo to pose p50, s | p95, s | relay: messages/s | refused/s |", "|---|---|---|---|---|---|",
  ($quiet[0] | row("undisturbed")), ($hostile[0] | row("hostile")), "| ratio | | \(ratio(.p50)) | \(ratio(.p95)) | | |"'
jq -ne --slurpfile quiet "$workspace/undisturbed.json" --slurpfile hostile "$workspace/hostile.json" \
  '$hostile[0].registered >= $quiet[0].registered and $hostile[0].p95 <= 2 * $quiet[0].p95' >/dev/null ||
  { warn "a hostile network is felt beyond the limit"; exit 1; }
