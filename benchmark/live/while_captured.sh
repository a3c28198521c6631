#!/usr/bin/env bash
# How far the map is while it is photographed: latency of photos that come at a camera's pace, and the
# position error of the models before finish beside that after it.
#
#   benchmark/live/while_captured.sh [--datasets DIR] [--places "LIST"] [--rate HZ] [--background "LIST"] [--dense "LIST"] [--keep DIR] [--picture FILE]
#
#   --datasets DIR   holds fountain-P11, south-building and caliterra (default: ../shared/datasets beside the
#                    tree; a set that is absent is left out)
#   --places "LIST"  of: synthetic fountain south-building (default: these) caliterra (no truth, so no error)
#   --rate HZ        photos a second, of all agents together (default 0.33)
#   --background "LIST"  with global BA in the background (on), without it (off), or "on off": then the
#                    latencies' ratio is printed, too (default on)
#   --dense "LIST"   with depth maps (on), without (off), or "on off": then the latencies' ratio is printed, too (default on)
#   --keep DIR       keeps the sessions there
#   --picture FILE.png  draws where the time from photo to pose went: of each run the median of each
#                    stage, its work dark, waiting, transfer and commit pale (needs gnuplot)
#
# Latency: from ingest's receipt of a photo to ingest's commit of its registration, of the photos
# that are registered in the end (initial pairs included). Of the surface: to the publication of a photo's dense points.
# Needs a network namespace of its own, so root or user namespaces. Exits 1 if less than 90 % of
# the photos have their pose within 3 s, if the error before finish is above twice that after, or if
# the 95th percentile of the latency is above 1.2 times that without the background BA, or 1.05 times that without depth maps.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

datasets=$SKEIN_ROOT/../shared/datasets places="synthetic fountain south-building" rate=0.33 background=on dense=on keep='' picture=''
take_options "datasets places rate background dense keep picture" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
broken=0

# choose_place NAME: sets `place`, `num_photos`; fails when its photos are absent
choose_place() {
  local set=$datasets/$1
  case $1 in
    synthetic) use_place 3 20 --seed 1 ;;
    fountain) set=$datasets/fountain-P11 ;&
    south-building | caliterra)
      [[ -d $set ]] || return 1
      local truth=$set/gt_dense_cameras
      [[ -d $truth ]] || truth=$set/reference
      use_photos "$1" "$set/images" "$truth"
      ;;
    *) usage_error "unknown place $1" ;;
  esac
}

status_of() { "$SKEIN_BUILD/bin/skein" status --once --json --session "$1" --lcm-url "$url"; }
newest() { sqlite3 "file:$1/ledger.db?mode=ro" ".timeout 5000" "SELECT COALESCE(MAX(seq), 0) FROM facts WHERE kind = '$2'"; }
is_checkpointed() {
  [[ $(status_of "$1" | jq .images.in_flight) == 0 ]] && (($(newest "$1" submap_model) > $(newest "$1" registration)))
}

# surface_of SESSION: how long the photos waited for their dense points
surface_of() {
  sed -n 's/.*its surface is shown \([0-9.]*\) s after.*/\1/p' "$1/log/dense.log" | jq -rs 'sort
    | def at($p): .[((length - 1) * $p) | round] * 100 | round / 100;
    if length == 0 then "none" else "of \(length) photos, p50 / p95: \(at(.5)) / \(at(.95)) s" end'
}

# row PLACE BACKGROUND DENSE: one run, one line of the table
row() {
  local session=$workspace/$1-$2-$3 options=(--verbose --dense "$3") agents before=null after=null
  [[ $2 == on ]] || options+=(--no-background-ba)
  agents=$(find -L "$place/images" -mindepth 1 -maxdepth 1 -type d | wc -l)
  start_services "$session" "$url" "${options[@]}"
  publish "$session" --rate "$(jq -n "$rate / $agents")"
  await_agents
  wait_until 120 "every photo is worked in and checkpointed" is_checkpointed "$session"
  status_of "$session" | jq -r '.instances[] | "\(.instance) \(.memory_bytes / 1e6 | round) MB"' | paste -sd, >"$session.memory"
  "$SKEIN_BUILD/bin/skein" export --session "$session" --output "$session/before" >/dev/null
  [[ ! -e $place/truth ]] ||
    before=$("$SKEIN_BUILD/bin/skein" evaluate --json "$session/before/0" "$place/truth" | jq .position_rmse_percent)
  finish "$session"
  stop_services
  [[ ! -e $place/truth ]] || after=$(position_rmse "$session")
  report "$1" "$2" "$session" "$before" "$after"
  [[ $3 == off ]] || echo "  surface: $(surface_of "$session")"
  [[ -z $keep ]] || { mkdir -p "$keep" && cp -a "$session" "$keep/"; }
}

report() {
  local name=$1 session=$3 before=$4 after=$5
  jq -r --argjson before "$before" --argjson after "$after" --arg name "$name" --arg background "$2" '
    def at($p): .[((length - 1) * $p) | round] * 100 | round / 100;
    .images as $n
    | [.images_in_time[] | select(.registered_s != null) | .registered_s - .received_s] | sort as $latency
    | ($latency | map(select(. <= 3)) | length / ($latency | length)) as $in_time
    | "| \($name) | \($background) | \($n.registered)/\($n.received) | \($in_time * 1000 | round / 10) % | \($latency | "\(at(.5)) / \(at(.95)) / \(at(.99))") | \($before) | \($after) |",
      ($in_time >= 0.9 and ($after == null or $before <= 2 * $after)), ($latency | at(.95))' "$session/report.json" >"$session.row"
  head -n 1 "$session.row"
  # name, then of each stage what was not work and what was
  jq -r --arg name "$name$([[ $2 == on ]] || echo ', no background BA')" '[$name, (.latency_s.stages[] | (.work_p50 // 0) as $work | ([.p50 - $work, 0] | max), $work)] | @csv' \
    "$session/report.json" >>"$workspace/stages.csv"
  echo "  memory: $(<"$session.memory")" >&2
  [[ $(sed -n 2p "$session.row") == true ]] || { broken=1; warn "$name, background $2, is beyond a limit"; }
}

# compare PLACE WHAT ON OFF LIMIT: latency of the run ON over that of OFF
compare() {
  local ratio
  ratio=$(jq -n "$(tail -n 1 "$workspace/$1-$3.row") / $(tail -n 1 "$workspace/$1-$4.row") * 100 | round / 100")
  echo "p95 of $1, with $2 over without: $ratio"
  jq -en "$ratio <= $5" >/dev/null || { broken=1; warn "$1: $2 delays poses"; }
}

draw_stages() {
  has_gnuplot || return 0
  gnuplot <<PLOT
set datafile separator ','
set terminal pngcairo size 900,420
set output '$picture'
set style data histograms
set style histogram rowstacked
set style fill solid noborder
set boxwidth 0.6
set ylabel 's, median of each stage'
set yrange [0:]
set grid ytics
set key outside right reverse Left
plot '$workspace/stages.csv' using 2:xtic(1) title 'ingest' lc rgb '#9e9e9e', \
  '' using 4 title 'to features' lc rgb '#bbdefb', '' using 5 title 'features, work' lc rgb '#1976d2', \
  '' using 6 title 'to retrieval' lc rgb '#d1c4e9', '' using 7 title 'retrieval, work' lc rgb '#512da8', \
  '' using 8 title 'to matching' lc rgb '#c8e6c9', '' using 9 title 'matching, work' lc rgb '#388e3c', \
  '' using 10 title 'to mapper' lc rgb '#ffe0b2', '' using 11 title 'mapper, work' lc rgb '#f57c00'
PLOT
}

echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), commit $(build_commit), $rate photos a second"
echo '| photos | background BA | registered | pose within 3 s | latency p50 / p95 / p99, s | position RMSE before finish, % of extent | after |'
echo '|---|---|---|---|---|---|---|'
for name in $places; do
  choose_place "$name" || { echo "no photos of $name in $datasets: left out"; continue; }
  for mode in $background; do
    for surface in $dense; do row "$name" "$mode" "$surface"; done
    [[ $dense != "on off" ]] || compare "$name" "depth maps" "$mode-on" "$mode-off" 1.05
  done
  [[ $background != "on off" ]] || compare "$name" "background BA" "on-${dense%% *}" "off-${dense%% *}" 1.2
done
[[ -z $picture ]] || draw_stages
exit "$broken"
