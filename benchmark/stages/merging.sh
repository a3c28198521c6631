#!/usr/bin/env bash
# Effect of merging: runs each set with merging and without it. Without it every submap takes all photos that it can
# register. First table, a row a run: placements a photo, final submaps with their photos and points, number of submaps
# over time, merges tried and their duration, seconds from the first fact that allows a comparison of two submaps to their
# merge. Second table: Skein's merge and COLMAP's model_merger on each pair of submaps of the run without merging.
#
#   benchmark/stages/merging.sh [--sets "LIST"] [--merging "LIST"] [--datasets DIR] [--size WxH]
#
#   --sets "LIST"    default: all. Scenarios of skein sim: together disjoint relay rooms corridor twins;
#                    real photos: fountain-P11 temple-ring caliterra south-building (in three agents by
#                    file order)
#   --merging "LIST" of: off on (default both)
#   --datasets DIR   holds the real photos (default: ../shared/datasets beside the tree); what is absent
#                    is left out
#   --size WxH       of the synthetic photos (default 960x720)
#
# Needs a network namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

datasets=$SKEIN_ROOT/../shared/datasets size=960x720 merging="off on"
sets="together disjoint relay rooms corridor twins fountain-P11 temple-ring caliterra south-building"
take_options "sets merging datasets size" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)

# use_south: three folders of links, by file order
use_south() {
  local photos=("$datasets"/south-building/images/*) i
  place=$workspace/south num_photos=${#photos[@]}
  mkdir -p "$place"/images/{a,b,c}
  for i in "${!photos[@]}"; do
    ln -sfn "$(realpath "${photos[i]}")" "$place/images/$(cut -c $((1 + 3 * i / num_photos)) <<<abc)/"
  done
  ln -sfn "$(realpath "$datasets/south-building/reference")" "$place/truth"
}

choose_set() {
  local photos=$datasets/$1
  case $1 in
    together | disjoint | relay) use_place 3 20 --scenario "$1" --size "$size" --seed 1 ;;
    rooms) use_place 6 30 --scenario rooms --size "$size" --seed 1 ;;
    corridor | twins) use_place 2 20 --scenario "$1" --size "$size" --seed 1 ;;
    fountain-P11) use_photos camera "$photos/images" "$photos/gt_dense_cameras" ;;
    temple-ring) use_photos camera "$photos/images" "$photos" ;; # *_par.txt
    caliterra) use_photos drone "$photos/images" "$photos/none" ;;
    south-building) use_south ;;
    *) usage_error "unknown set $1" ;;
  esac
}

# run_session SESSION [launch.sh's options]: exports the submaps to SESSION-models before the finish is
# asked for, and to SESSION-submaps while the services still run after it
run_session() {
  local session=$1
  shift
  start_services "$session" "$url" "$@"
  publish "$session"
  await_agents
  wait_until 600 "a submap has a checkpoint" export_submaps "$session" "$session-models"
  finish "$session"
  export_submaps "$session" "$session-submaps"
  stop_services
}
export_submaps() { "$SKEIN_BUILD/bin/skein" export --session "$1" --output "$2" >/dev/null 2>&1; }

# "0 s: 1, 12 s: 2, 40 s: 1": how many submaps lived from then on, after the first photo
submaps_over_time() {
  sqlite3 "file:$1/ledger.db?mode=ro" "
    WITH start AS (SELECT MIN(utime_us) AS t FROM facts WHERE kind = 'image'),
    steps AS (SELECT utime_us AS t, CASE WHEN kind = 'seed' THEN 1 ELSE -1 END AS step, seq FROM facts
      WHERE kind IN ('seed', 'submap_end'))
    SELECT GROUP_CONCAT(text, ', ') FROM (SELECT CAST((steps.t - start.t) / 1000000 AS INT) || ' s: ' ||
      SUM(step) OVER (ORDER BY seq) AS text FROM steps, start ORDER BY seq)"
}

# The largest model's error, or "-" where there is none
rmse_of() { "$SKEIN_BUILD/bin/skein" evaluate --json "$1" "$place/truth" 2>/dev/null | jq -r '.position_rmse_percent * 10000 | round / 10000' || echo -; }

row() {
  local session=$workspace/$1-$2 report=$workspace/$1-$2/report.json options=()
  [[ $2 == on ]] || options=(--no-merge --config "$workspace/every.toml")
  run_session "$session" "${options[@]}" >"$session.log" 2>&1 || { cat "$session.log" >&2; return 1; }
  printf '| %s | %s | %s/%s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$1" "$2" \
    "$(jq .images.registered "$report")" "$num_photos" "$(jq '.images.placements / .images.received * 100 | round / 100' "$report")" "$(jq '.submaps | length' "$report")" \
    "$(jq -r '[.submaps[] | "\(.images) / \(.points)"] | join(", ")' "$report")" "$(rmse_of "$session/sparse/0")" \
    "$(jq -r '[.merges | length, (map(select(.state == "done")) | length), (map(select(.state == "undone")) | length)] | join(" / ")' "$report")" \
    "$(jq -r '[.merges[].duration_s] | if length == 0 then "-" else "\(add / length * 10 | round / 10) / \(max * 10 | round / 10)" end' "$report")" \
    "$(jq -r '[.merges[] | select(.state == "done") | .since_evidence_s] | if length == 0 then "-" else sort | "\(.[(length - 1) / 2 | floor] * 10 | round / 10) / \(.[-1] * 10 | round / 10)" end' "$report")" \
    "$(submaps_over_time "$session")"
}

# shared_photos MODEL MODEL: photos that are in both
shared_photos() {
  local model
  for model in "$1" "$2"; do
    mkdir -p "$model-text"
    colmap model_converter --input_path "$model" --output_path "$model-text" --output_type TXT >/dev/null 2>&1
    grep -v '^#' "$model-text/images.txt" | awk 'NR % 2 { print $10 }' | sort -u >"$model-text/names"
  done
  comm -12 "$1-text/names" "$2-text/names" | wc -l
}

# Both mergers on each pair of the submaps that stayed apart
merger_rows() {
  local models a b out shared verdict ours
  mapfile -t models < <(find "$workspace/$1-off-submaps" -mindepth 1 -maxdepth 1 | sort)
  for a in "${models[@]}"; do
    for b in "${models[@]}"; do
      [[ $a < $b ]] || continue
      shared=$(shared_photos "$a" "$b")
      ((shared > 0)) || continue
      out=$a-with-${b##*/}
      mkdir -p "$out"
      ours=$("$SKEIN_BUILD/bin/merge_models" "$a" "$b" "$out-ours") || true # says itself why not
      QT_QPA_PLATFORM=offscreen colmap model_merger --input_path1 "$a" --input_path2 "$b" --output_path "$out" >"$out.log" 2>&1 || true
      verdict=$(grep -oE 'Merge (succeeded|failed)' "$out.log" || echo "ended badly")
      printf '| %s | %s + %s photos, %s shared | %s, %s | %s | %s | %s | %s |\n' "$1" "$(wc -l <"$a-text/names")" \
        "$(wc -l <"$b-text/names")" "$shared" "$(rmse_of "$a")" "$(rmse_of "$b")" "${ours#*: }" \
        "$([[ $ours == *": merged"* ]] && rmse_of "$out-ours" || echo -)" \
        "$verdict" "$([[ $verdict == *succeeded ]] && rmse_of "$out" || echo -)"
    done
  done
}

print_machine
merger_table=$workspace/merger_table
printf '[mapper]\none_home = false\n' >"$workspace/every.toml"
echo '| set | merging | registered | placements a photo | submaps | photos / points of each | position RMSE of the largest, % of extent | merges tried / done / undone | s a merge, mean / most | s since evidence, median / most | submaps over time |'
echo '|---|---|---|---|---|---|---|---|---|---|---|'
for name in $sets; do
  [[ $name != *-* && $name != caliterra || -d $datasets/$name ]] || { echo "no $datasets/$name: left out"; continue; }
  choose_set "$name"
  for mode in $merging; do row "$name" "$mode"; done
  [[ $merging != *off* ]] || merger_rows "$name" >>"$merger_table"
done
[[ -s $merger_table ]] || exit 0
echo
echo '| set | submaps | position RMSE of each, % | Skein, s | RMSE after | COLMAP model_merger | RMSE after |'
echo '|---|---|---|---|---|---|---|'
cat "$merger_table"
