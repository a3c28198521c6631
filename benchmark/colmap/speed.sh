#!/usr/bin/env bash
# How fast Skein is with each kernel that this processor runs: its stages beside OpenCV's and COLMAP 3.8's, and whole sessions.
# Stages are ratios of CPU time in one run, on one thread: most of what machines differ in cancels out.
#
#   benchmark/colmap/speed.sh [options]
#
#   --parts LIST    stages, sessions (default: both)
#   --kernels LIST  of matching: portable, avx2, avx512vnni, amx (default: all that this processor has)
#   --cores LIST    sessions are pinned to so many processors (default 1,2,4,8; more than there are: left out)
#   --images DIR    photos of the sessions (default: south-building of ../shared/datasets, else a synthetic place's)
#   --photos N      only the first N of them
#   --output FILE   writes the figures there, as JSON; those of another part, or of other kernels and cores, stay there
#                   if commit and processor are the same. docs/speed.json is the last one that was kept
#   --compare FILE  prints each ratio that is more than 10 % above that of FILE
#
# Stages, on 28 photos of a synthetic place. features: our SIFT / OpenCV's. product: all descriptors of two photos with each
# other, / OpenCV's brute force. matching: a pair by cascade / by the full product, verification in both. features_colmap: our
# SIFT / colmap feature_extractor; matching_colmap: a pair by cascade / colmap exhaustive_matcher. Each with the kernel in its
# name. mapper: / colmap mapper, on the session's own verified matches. COLMAP's rows are left out where there is no colmap.
# Sessions: scripts/reconstruct.sh, kernels by its --config; avx512vnni and amx have SIFT's avx512 beside them. Wall time is
# from the first photo to the end of the finish, CPU time that of all processes. Joules are of the whole processor, by RAPL;
# without RAPL, instructions in user mode, by perf. Needs a network namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"
source "$(dirname "$0")/kernel_sessions.sh"

south_building=$SKEIN_ROOT/../shared/datasets/south-building/images
parts=stages,sessions kernels='' cores=1,2,4,8 images='' photos='' output='' compare=''
take_options "parts kernels cores images photos output compare" "$@"
[[ $parts =~ ^(stages|sessions)(,(stages|sessions))?$ ]] || usage_error "--parts: stages, sessions or both, not '$parts'"
[[ $cores =~ ^[1-9][0-9]*(,[1-9][0-9]*)*$ ]] || usage_error "--cores: counts, with commas between, not '$cores'"
[[ -z $images || -d $images ]] || usage_error "--images: there is no folder '$images'"
[[ -n $images || ! -d $south_building ]] || images=$south_building
[[ -z $photos || $photos =~ ^[1-9][0-9]*$ ]] || usage_error "--photos: a count, not '$photos'"
[[ -z $photos || -n $images ]] || usage_error "--photos: the first of which? Give --images, too"
[[ -z $compare || -r $compare ]] || usage_error "--compare: cannot read '$compare'"
lscpu=$(LC_ALL=C lscpu)
flags=" $(sed -n 's/^Flags: *//p' <<<"$lscpu") "
declare -A flag_of=([avx2]=avx2 [avx512vnni]=avx512_vnni [amx]=amx_int8)
available=portable
for kernel in avx2 avx512vnni amx; do [[ $flags != *" ${flag_of[$kernel]} "* ]] || available+=,$kernel; done
IFS=, read -ra kernels <<<"${kernels:-$available}"
for kernel in "${kernels[@]}"; do
  [[ ,$available, == *",$kernel,"* ]] || usage_error "--kernels: no kernel '$kernel' here; this processor has $available"
done
IFS=, read -ra cores <<<"$cores"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
bin=$SKEIN_BUILD/bin
export QT_QPA_PLATFORM=offscreen
results=$workspace/results # NAME OURS OTHERS, CPU
own_session=$workspace/session.json
sessions=$workspace/sessions.json
touch "$results" "$own_session" "$sessions"

# cpu_s CMD...: of the command, whose output goes to $workspace/out
cpu_s() {
  local TIMEFORMAT='%U %S'
  { time "$@" >"$workspace/out" 2>&1; } 2>"$workspace/times" || { tail -n 20 "$workspace/out" >&2; fail "$1 failed"; }
  awk '{ print $1 + $2 }' "$workspace/times"
}
note() { echo "$*" >>"$results"; }
has_colmap() { command -v colmap >/dev/null; }

measure_features() {
  local opencv_s sift sift_s
  "$bin/sift_matches" --images "$place/images" --model "$place/truth" --photos 8 >"$workspace/sift" || fail "sift_matches"
  opencv_s=$(awk -F'|' '/^\| OpenCV/ { print $(NF - 1) + 0 }' "$workspace/sift")
  while read -r sift sift_s; do note "features_$sift" "$sift_s" "$opencv_s"; done \
    < <(awk -F'|' '/^\| Skein/ { sub(/.*, /, "", $2); print $2, $(NF - 1) + 0 }' "$workspace/sift")
}

measure_product() {
  local opencv_ms kernel ms
  "$bin/matching_kernel" 5 >"$workspace/kernel" || fail "matching_kernel"
  opencv_ms=$(awk '/^OpenCV/ { ms = $(NF - 1); if (!least || ms < least) least = ms } END { print least }' "$workspace/kernel")
  while read -r kernel ms; do note "product_$kernel" "$ms" "$opencv_ms"; done < <(awk '/^skein/ { print $2, $3 }' "$workspace/kernel")
}

measure_matching() {
  local kernel all
  for kernel in "${kernels[@]}"; do
    "$bin/matching_ways" --set "agent=$place/images/agent-1" --cache "$workspace/cache" --kernel "$kernel" >"$workspace/ways" ||
      fail "matching_ways"
    all=$(sed -n '/^all pairs/,$p' "$workspace/ways")
    note "matching_$kernel" "$(ms_of cascade "$all")" "$(ms_of "full product" "$all")"
  done
}
# ms_of WAY ROWS: a pair, of matching_ways
ms_of() { awk -v way="$1" 'index($0, "  " way) == 1 { for (i = 1; i <= NF; ++i) if ($i == "=") print $(i - 1) }' <<<"$2"; }

measure_colmap_features_and_matching() {
  local folder=$workspace/colmap count=4 name
  mkdir -p "$folder/images"
  for name in $(ls "$place/images/agent-1" | head -n "$count"); do cp "$place/images/agent-1/$name" "$folder/images/"; done
  note_beside_colmap features "$(jq -n "$(cpu_s colmap feature_extractor --database_path "$folder/database.db" --image_path "$folder/images" \
    --SiftExtraction.use_gpu 0 --SiftExtraction.num_threads 1 --SiftExtraction.max_image_size 1600 --ImageReader.single_camera 1) / $count")"
  note_beside_colmap matching "$(jq -n "1000 * $(cpu_s colmap exhaustive_matcher --database_path "$folder/database.db" \
    --SiftMatching.use_gpu 0 --SiftMatching.num_threads 1) / ($count * ($count - 1) / 2)")"
}
# note_beside_colmap STAGE COLMAP_CPU: the stage's rows again, with COLMAP's
note_beside_colmap() {
  local rows name ours
  rows=$(grep "^$1_" "$results")
  while read -r name ours _; do note "${name/#$1/$1_colmap}" "$ours" "$2"; done <<<"$rows"
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
    "$session/report.json" >"$own_session"
  has_colmap || return 0
  "$bin/skein" export --session "$session" --format database --output "$workspace/export" >/dev/null 2>&1 || fail "export"
  own=$(cpu_s "$bin/mapper_offline" --database "$workspace/export/database.db" --order id --max-pairs 0)
  mkdir "$workspace/model"
  note mapper "$own" "$(cpu_s colmap mapper --database_path "$workspace/export/database.db" --image_path "$session/images" \
    --output_path "$workspace/model" --Mapper.num_threads 1 --Mapper.extract_colors 0)"
}

measure_stages() {
  measure_features
  measure_product
  measure_matching
  ! has_colmap || measure_colmap_features_and_matching
  measure_mapper
  awk '{ printf "%-28s %10.3f of %10.3f: %.4f\n", $1, $2, $3, $2 / $3 }' "$results"
  jq -r '"a session of \(.registered) photos: \(.photo_s * 100 | round / 100) s a photo, photo to pose p50 \(.p50_s * 100 | round / 100), p95 \(.p95_s * 100 | round / 100) s"' "$own_session"
  keep_figures
}

# All figures as JSON. cpu: ours and the other's; s a photo, the mapper's s, else ms a pair.
print_figures() {
  jq -Rn --slurpfile session "$own_session" --slurpfile sessions "$sessions" --arg machine "$(sed -n 's/^Model name: *//p' <<<"$lscpu")" \
    --arg kernels "$available" --arg flags "$(grep -oE '\b(avx2|fma|avx512(f|bw|dq|vl|_vnni)|amx_(tile|int8))\b' <<<"$flags" | paste -sd ' ')" \
    --arg commit "$(build_commit)" --argjson cores "$(nproc)" '
    [inputs | split(" ") | {name: .[0], ours: (.[1] | tonumber), other: (.[2] | tonumber)}] as $rows
    | {commit: $commit, machine: $machine, cores: $cores, kernels: $kernels, flags: $flags}
    + if $rows == [] then {} else {ratios: ($rows | map({(.name): (.ours / .other * 1e6 | round / 1e6)}) | add),
        cpu: ($rows | map({(.name): [.ours, .other]}) | add), session: $session[0]} end
    + if $sessions == [] then {} else {sessions: ($sessions | add)} end' "$results"
}
# keep_figures: in --output, with what that file holds of the same commit and processor
keep_figures() {
  local old='{}'
  print_figures >"$workspace/speed.json"
  [[ -n $output ]] || return 0
  [[ ! -s $output ]] || old=$(<"$output")
  jq --argjson old "$old" 'if $old.commit == .commit and $old.machine == .machine then $old * . else . end' "$workspace/speed.json" >"$workspace/kept.json"
  cp "$workspace/kept.json" "$output"
}

print_slower() {
  jq -r --slurpfile before "$compare" '.ratios // {} | to_entries[] | ($before[0].ratios[.key]) as $b
    | select($b != null and .value > 1.1 * $b) | "SLOWER: \(.key) \($b) -> \(.value), \((.value / $b - 1) * 100 | round) % (before: \($before[0].commit), \($before[0].machine))"' \
    "$workspace/speed.json"
}

print_machine
[[ $parts == sessions && -n $images ]] || use_place 2 14 --seed 1
[[ $parts != *stages* ]] || measure_stages
[[ -z $compare || $parts != *stages* ]] || print_slower
[[ $parts != *sessions* ]] || measure_sessions
