#!/usr/bin/env bash
# How fast each stage is beside OpenCV's and COLMAP 3.8's, as ratios of CPU time in one run: most of what machines differ in
# cancels out. 28 photos of a synthetic place.
#
#   benchmark/colmap/speed.sh [--output FILE] [--compare FILE]
#
#   --output FILE   writes the ratios there, as JSON; docs/speed.json is the last one that was kept
#   --compare FILE  prints each ratio that is more than 10 % above that of FILE
#
# features: our SIFT / OpenCV's; features_colmap: / colmap feature_extractor. product: all descriptors of two photos with each
# other, / OpenCV's brute force. matching: a pair by cascade / by the full product, verification in both; matching_colmap: /
# colmap exhaustive_matcher. mapper: / colmap mapper, on the session's own verified matches. Each with the instruction sets
# that it ran with. All on one thread. COLMAP's rows are left out where there is no colmap. Needs a network namespace of its
# own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

output='' compare=''
take_options "output compare" "$@"
[[ -z $compare || -r $compare ]] || usage_error "--compare: cannot read '$compare'"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
bin=$SKEIN_BUILD/bin
export QT_QPA_PLATFORM=offscreen
use_place 2 14 --seed 1
results=$workspace/results # NAME OURS OTHERS, CPU

# cpu_s CMD...: of the command, whose output goes to $workspace/out
cpu_s() {
  local TIMEFORMAT='%U %S'
  { time "$@" >"$workspace/out" 2>&1; } 2>"$workspace/times" || { tail -n 20 "$workspace/out" >&2; fail "$1 failed"; }
  awk '{ print $1 + $2 }' "$workspace/times"
}
note() { echo "$*" >>"$results"; }
has_colmap() { command -v colmap >/dev/null; }

# `sift` and `sift_s`: the fastest version, which comes last, and its seconds a photo
measure_features() {
  local opencv_s
  "$bin/sift_matches" --images "$place/images" --model "$place/truth" --photos 8 >"$workspace/sift" || fail "sift_matches"
  opencv_s=$(awk -F'|' '/^\| OpenCV/ { print $(NF - 1) + 0 }' "$workspace/sift")
  while read -r sift sift_s; do note "features_$sift" "$sift_s" "$opencv_s"; done \
    < <(awk -F'|' '/^\| Skein/ { sub(/.*, /, "", $2); print $2, $(NF - 1) + 0 }' "$workspace/sift")
  read -r sift sift_s < <(awk -F'|' '/^\| Skein/ { sub(/.*, /, "", $2); row = $2 " " $(NF - 1) + 0 } END { print row }' "$workspace/sift")
}

# `kernel`: the fastest version
measure_product() {
  local opencv_ms ms
  "$bin/matching_kernel" 5 >"$workspace/kernel" || fail "matching_kernel"
  opencv_ms=$(awk '/^OpenCV/ { ms = $(NF - 1); if (!least || ms < least) least = ms } END { print least }' "$workspace/kernel")
  while read -r kernel ms; do note "product_$kernel" "$ms" "$opencv_ms"; done < <(awk '/^skein/ { print $2, $3 }' "$workspace/kernel")
  kernel=$(awk '/^skein/ { name = $2 } END { print name }' "$workspace/kernel")
}

# `pair_ms`: a pair by cascade
measure_matching() {
  "$bin/matching_ways" --set "agent=$place/images/agent-1" --cache "$workspace/cache" >"$workspace/ways" || fail "matching_ways"
  local all
  all=$(sed -n '/^all pairs/,$p' "$workspace/ways")
  ms_of() { awk -v way="$1" 'index($0, "  " way) == 1 { for (i = 1; i <= NF; ++i) if ($i == "=") print $(i - 1) }' <<<"$all"; }
  pair_ms=$(ms_of cascade)
  note "matching_$kernel" "$pair_ms" "$(ms_of "full product")"
}

measure_colmap_features_and_matching() {
  local folder=$workspace/colmap count=4 name
  mkdir -p "$folder/images"
  for name in $(ls "$place/images/agent-1" | head -n "$count"); do cp "$place/images/agent-1/$name" "$folder/images/"; done
  note "features_colmap_$sift" "$sift_s" "$(jq -n "$(cpu_s colmap feature_extractor --database_path "$folder/database.db" --image_path "$folder/images" \
    --SiftExtraction.use_gpu 0 --SiftExtraction.num_threads 1 --SiftExtraction.max_image_size 1600 --ImageReader.single_camera 1) / $count")"
  note "matching_colmap_$kernel" "$pair_ms" "$(jq -n "1000 * $(cpu_s colmap exhaustive_matcher --database_path "$folder/database.db" \
    --SiftMatching.use_gpu 0 --SiftMatching.num_threads 1) / ($count * ($count - 1) / 2)")"
}

# Also what a session at full speed takes a photo, and its latency.
measure_mapper() {
  local session=$workspace/session own
  start_services "$session" "$url" --web 0 >/dev/null
  publish "$session"
  await_agents
  finish "$session"
  stop_services
  jq --argjson photos "$num_photos" '{photo_s: (.wall_s / $photos), p50_s: .latency_s.p50, p95_s: .latency_s.p95, registered: .images.registered}' \
    "$session/report.json" >"$workspace/session.json"
  has_colmap || return 0
  "$bin/skein" export --session "$session" --format database --output "$workspace/export" >/dev/null 2>&1 || fail "export"
  own=$(cpu_s "$bin/mapper_offline" --database "$workspace/export/database.db" --order id --max-pairs 0)
  mkdir "$workspace/model"
  note mapper "$own" "$(cpu_s colmap mapper --database_path "$workspace/export/database.db" --image_path "$session/images" \
    --output_path "$workspace/model" --Mapper.num_threads 1 --Mapper.extract_colors 0)"
}

print_machine
measure_features
measure_product
measure_matching
! has_colmap || measure_colmap_features_and_matching
measure_mapper
jq -Rn --slurpfile session "$workspace/session.json" --arg machine "$(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1)" \
  --arg commit "$(git -C "$SKEIN_ROOT" rev-parse --short HEAD 2>/dev/null || true)" '
  {commit: $commit, machine: $machine, ratios: ([inputs | split(" ") | {(.[0]): ((.[1] | tonumber) / (.[2] | tonumber) * 1e6 | round / 1e6)}] | add), session: $session[0]}' \
  "$results" >"$workspace/speed.json"
awk '{ printf "%-28s %10.3f of %10.3f: %.4f\n", $1, $2, $3, $2 / $3 }' "$results"
jq -r '.session | "a session of \(.registered) photos: \(.photo_s * 100 | round / 100) s a photo, photo to pose p50 \(.p50_s * 100 | round / 100), p95 \(.p95_s * 100 | round / 100) s"' "$workspace/speed.json"
[[ -z $compare ]] || jq -r --slurpfile before "$compare" '.ratios | to_entries[] | ($before[0].ratios[.key]) as $b
  | select($b != null and .value > 1.1 * $b) | "SLOWER: \(.key) \($b) -> \(.value), \((.value / $b - 1) * 100 | round) % (before: \($before[0].commit), \($before[0].machine))"' \
  "$workspace/speed.json"
[[ -z $output ]] || cp "$workspace/speed.json" "$output"
