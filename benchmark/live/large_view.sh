#!/usr/bin/env bash
# What a large map costs the live view: memory of the process that serves it, and bytes to a page that was never here,
# beside a PLY of the same.
#
#   benchmark/live/large_view.sh [--points "LIST"]
#
#   --points "LIST"   numbers of points, two rows each (default "1000000 10000000")
#
# A row: `skein view` of a finished session, which makes the shape of the model; skein-web of a live one, which pulls it from
# its mapper (here benchmark/live/large_shape). Memory is the kernel's VmHWM and VmRSS when all chunks have been sent, before
# anything is downloaded; `start`: VmRSS before. 10 million points need 12 GB. Needs a network namespace of its own, so root
# or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"

points='1000000 10000000'
take_options "points" "$@"
enter_network_namespace "$@"
new_workspace
export LCM_DEFAULT_URL
LCM_DEFAULT_URL=$(test_lcm_url)
readonly submap=http://127.0.0.1:8470/api/submaps/3

memory_mb() { awk -v field="$2:" '$1 == field { printf "%.0f", $2 / 1000 }' "/proc/$1/status"; }
is_up() { curl -sf http://127.0.0.1:8470/api/session >/dev/null; }
has_shape() { curl -sf "$submap" -o "$workspace/shape.json" && [[ $(jq '[.chunks[].points] | add' "$workspace/shape.json") == "$1" ]]; }

# measure NAME PID POINTS: prints a row; sets nothing
measure() {
  local name=$1 pid=$2 wanted=$3 start_mb began shape_s chunk_bytes peak_mb rest_mb ply=–
  wait_until 60 "$name answers" is_up
  start_mb=$(memory_mb "$pid" VmRSS)
  began=$(date +%s%N)
  wait_until 120 "a shape of $wanted points" has_shape "$wanted"
  shape_s=$(jq -n "($(date +%s%N) - $began) / 1e8 | round / 10")
  jq -r --arg url "$submap" '.chunks[] | "url = \"\($url)/chunks/\(.id)?v=\(.version)\"\noutput = \"/dev/null\""' "$workspace/shape.json" >"$workspace/urls"
  chunk_bytes=$(curl -sf --config "$workspace/urls" -w '%{size_download}\n' | awk '{ sum += $1 } END { printf "%d", sum }')
  peak_mb=$(memory_mb "$pid" VmHWM) rest_mb=$(memory_mb "$pid" VmRSS)
  [[ $name != 'skein view' ]] || ply=$(curl -sf http://127.0.0.1:8470/download/points.ply | wc -c | awk '{ printf "%.1f", $1 / 1e6 }')
  echo "| $name | $wanted | $(jq '.chunks | length' "$workspace/shape.json") | $shape_s | $start_mb | $peak_mb | $rest_mb | $(jq -n "$chunk_bytes / 1e5 | round / 10") | $(jq -n "$(wc -c <"$workspace/shape.json") / 1e4 | round / 100") | $ply |"
}

end_processes() {
  kill -TERM "$@"
  wait "$@" 2>/dev/null || true
}

print_machine
echo '| served by | points | chunks | s to the shape | start, MB | peak, MB | then, MB | chunks, MB | list, MB | PLY, MB |'
echo '|---|---|---|---|---|---|---|---|---|---|'
for count in $points; do
  session=$workspace/view-$count
  "$SKEIN_BUILD/bin/large_shape" write "$session" "$count"
  "$SKEIN_BUILD/bin/skein" view "$session" --port 8470 >"$workspace/view.log" 2>&1 &
  view=$!
  measure 'skein view' "$view" "$count"
  end_processes "$view"
  rm -rf "$session"

  session=$workspace/live-$count
  "$SKEIN_BUILD/bin/large_shape" tell "$session" "$count" >"$workspace/tell.log" 2>&1 &
  teller=$!
  wait_until 300 "the mapper is ready" grep -q ready "$workspace/tell.log"
  "$SKEIN_BUILD/bin/skein-ingest" --session "$session" --lcm-url "$LCM_DEFAULT_URL" >"$workspace/ingest.log" 2>&1 &
  ingest=$!
  "$SKEIN_BUILD/bin/skein-web" --session "$session" --lcm-url "$LCM_DEFAULT_URL" --port 8470 >"$workspace/web.log" 2>&1 &
  web=$!
  measure skein-web "$web" "$count"
  end_processes "$web" "$ingest" "$teller"
  rm -rf "$session"
done
