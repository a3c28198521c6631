#!/usr/bin/env bash
# What the live view costs and how late it is: a session with no page open, and with pages that take every event,
# shape and chunk (benchmark/live/live_viewer.py).
#
#   benchmark/live/live_view.sh [--place NAME] [--agents N] [--photos N] [--size WxH] [--rate HZ] [--viewers "LIST"] [--datasets DIR]
#
#   --place NAME      synthetic, or south-building of --datasets (default: south-building)
#   --agents N, --photos N, --size WxH   of synthetic: agents, photos of each (default 1, 40, 1280x960)
#   --rate HZ         photos a second of an agent (default 0.33)
#   --viewers "LIST"  numbers of pages, a run each (default "0 1"; "none": without skein-web)
#   --datasets DIR    default: ../shared/datasets beside the tree
#
# A line a run: CPU seconds of skein-web and of the mappers up to the finish, photo to pose, and what a page saw.
# Needs a network namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

datasets=$SKEIN_ROOT/../shared/datasets place=south-building agents=1 photos=40 size=1280x960 rate=0.33 viewers="0 1"
take_options "datasets place agents photos size rate viewers" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
case $place in
  synthetic) use_place "$agents" "$photos" --seed 1 --size "$size" ;;
  south-building) use_photos south "$datasets/south-building/images" "$datasets/south-building/reference" ;;
  *) usage_error "unknown place $place" ;;
esac

# cpu_s INSTANCE...: user and system, of those that run
cpu_s() {
  local instance ticks=0 fields
  for instance in "$@"; do
    [[ -e $session/run/$instance.pid ]] || continue
    fields=$(cat "/proc/$(<"$session/run/$instance.pid")/stat" 2>/dev/null) || continue
    fields=(${fields##*) })
    ticks=$((ticks + fields[11] + fields[12]))
  done
  jq -n "$ticks / $(getconf CLK_TCK)"
}
mappers() { (cd "$session/run" && ls mapper-*.pid | sed 's/\.pid$//'); }
newest() { sqlite3 "file:$session/ledger.db?mode=ro" ".timeout 5000" "SELECT COALESCE(MAX(seq), 0) FROM facts WHERE kind = '$1'"; }
in_flight() { "$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url" | jq .images.in_flight; }
is_at_rest() { [[ $(in_flight) == 0 ]] && (($(newest submap_model) > $(newest registration))); }

print_machine
for run in $viewers; do
  session=$workspace/with-$run pages=() port=8470
  [[ $run != none ]] || port=0
  start_services "$session" "$url" --web "$port" >/dev/null
  for ((i = 0; i < ${run/none/0}; i++)); do
    "$SKEIN_ROOT/benchmark/live/live_viewer.py" 127.0.0.1 "$port" >"$workspace/page-$run-$i.json" &
    pages+=($!)
  done
  publish "$session" --rate "$rate"
  await_agents
  wait_until 900 "every photo is worked in" is_at_rest
  web=$(cpu_s web) mapper=$(cpu_s $(mappers)) wall=$(ps -o etimes= -p "$(<"$session/run/ingest.pid")")
  ((!${#pages[@]})) || { kill -TERM "${pages[@]}"; wait "${pages[@]}" 2>/dev/null || true; }
  finish "$session"
  stop_services
  jq -c --arg run "$run" --argjson web "$web" --argjson mapper "$mapper" --argjson wall "$wall" \
    '{viewers: $run, photos: .images.registered, wall_s: $wall, web_cpu_s: $web, mapper_cpu_s: $mapper, photo_to_pose_s: .latency_s}' "$session/report.json"
  grep -ho 'told .*' "$session"/log/mapper-*.log | sed 's/^/mapper: /' || true
  ((!${#pages[@]})) || jq -c '{page: .}' "$workspace/page-$run-0.json"
done
