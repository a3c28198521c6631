#!/usr/bin/env bash
# Is what guidance says true, and does its advice help? On synthetic places with known surfaces: each
# station of a scenario's walks in four ways (240 photos) is a pool to take photos from.
#
#   benchmark/guidance.sh --keep DIR [--parts "LIST"] [--prediction "LIST"] [--policy "LIST"]
#                         [--policies "LIST"] [--max-photos N] [--threads N]
#
#   --keep DIR           rendered photos, tables and pictures; a run that is there is not repeated
#   --parts "LIST"       of: prediction policy gaps (default: all)
#   --prediction "LIST"  places as SCENARIO-SEED (default "together-1 disjoint-1 blank-1 furniture-1
#                        together-2 disjoint-2 blank-2 furniture-2")
#   --policy "LIST"      the same for the policies, gaps included (default "together-1 disjoint-1 blank-1")
#   --policies "LIST"    who chooses (default: all; see guidance_policy --help)
#   --max-photos N       that a policy takes (default 60)
#   --threads N          default 1
#
# Prediction: an uneven part of the pool is taken. Spearman's rank correlation of what is predicted for
# a surfel with the median distance of dense points there to the true surface (error; as it should be:
# negative) and with the share of the true surface there that they cover (completeness). "Good" against
# an error of at most 2 target GSD and a completeness of at least 0.8; said to be good is a surfel of which that
# share is.
# Policy: the share of what the whole pool's dense points cover, over the number of photos taken. `advice` is
# followed to the station; the others choose from the pool. Beside it the verdict, and what is told as good and has
# no dense points.
# Gaps: the same from the scenario's walks without the middle third of each; `order` fills these as planned.
# docs/experiments/guidance.md has the figures. Pictures need gnuplot.
source "$(dirname "$0")/../scripts/lib.sh"

keep='' parts="prediction policy gaps" threads=1 max_photos=60
prediction="together-1 disjoint-1 blank-1 furniture-1 together-2 disjoint-2 blank-2 furniture-2"
policy="together-1 disjoint-1 blank-1"
policies="advice gain gain-diminishing Q order random farthest farthest-overlapping"
while (($#)); do
  case $1 in
    -h | --help) print_help; exit 0 ;;
    --keep) keep=${2:?}; shift ;;
    --parts) parts=${2:?}; shift ;;
    --prediction) prediction=${2:?}; shift ;;
    --policy) policy=${2:?}; shift ;;
    --policies) policies=${2:?}; shift ;;
    --max-photos) max_photos=${2:?}; shift ;;
    --threads) threads=${2:?}; shift ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ -n $keep ]] || usage_error "--keep is needed"
for part in $parts; do
  [[ $part == prediction || $part == policy || $part == gaps ]] || usage_error "--parts: there is no $part"
  [[ -x $SKEIN_BUILD/bin/guidance_${part/gaps/policy} ]] || die "no $SKEIN_BUILD/bin/guidance_${part/gaps/policy}: build first"
done
mkdir -p "$keep"

# run PART PLACE [OPTION...]: the tool's JSON into $keep/PART-PLACE.json, whole or not at all
run() {
  local out=$keep/$1-$2.json part=$1 place=$2
  [[ ! -e $out ]] || return 0
  shift 2
  "$SKEIN_BUILD/bin/guidance_${part/gaps/policy}" --scenario "${place%-*}" --seed "${place##*-}" --cache "$keep/photos" \
    --threads "$threads" --table "$keep/$part-$place.csv" "$@" >"$out.part" || die "$part of $place failed"
  mv "$out.part" "$out"
}

files_of() { local place; for place in $2; do echo "$keep/$1-$place.json"; done; }

rounding='def r: if . == null then "-" else . * 100 | round / 100 end;'

prediction_tables() {
  local files measure
  mapfile -t files < <(files_of prediction "$prediction")
  for measure in error completeness; do
    echo
    echo "Spearman with the true $measure:"
    echo
    echo '| place | photos | surfels | combined | sigma | reconstr. | photos | density | GSD | track length | Q |'
    echo '|---|---|---|---|---|---|---|---|---|---|---|'
    jq -r --arg m "$measure" "$rounding"'
      .[$m] as $s | "| \(.scenario) \(.seed) | \(.photos) | \(.surfels) | " + ([$s.combined, $s.sigma, $s.reconstructability,
      $s.photos, $s.density, $s.GSD, $s["track length"], $s.Q] | map(r | tostring) | join(" | ")) + " |"' "${files[@]}"
  done
  echo
  echo '"Good" against the truth:'
  echo
  echo '| place | median error, target GSD | completeness | truly good | said | false of said | missed of true | ROC area: combined | sigma | Q | texture | good share |'
  echo '|---|---|---|---|---|---|---|---|---|---|---|---|'
  jq -r "$rounding"'
    .good as $g | .roc_area as $a | "| \(.scenario) \(.seed) | " + ([.median_error_gsd, .mean_completeness, $g.truly, $g.said,
    $g.false_share_of_said, $g.missed_share_of_truly, $a.combined, $a.sigma, $a.Q, $a.texture, $a["good share"]] | map(r | tostring) | join(" | ")) + " |"' \
    "${files[@]}"
  echo
  echo 'The place as it is said to be (good of what the photos show, verdict), and the surface that a photo shows:'
  echo
  echo '| place | good | holes | good of shown | open | verdict | true surface: with points | said good | truly covered | said good, not covered |'
  echo '|---|---|---|---|---|---|---|---|---|---|'
  jq -r "$rounding"'
    .place as $p | "| \(.scenario) \(.seed) | " + ([$p.good_share, $p.hole_share, $p.good_of_shown, $p.open_share | r]
    + [["growing", "weak", "nearly", "complete"][$p.verdict]] + [$p.with_points, $p.said_good, $p.covered, $p.said_falsely | r]
    | map(tostring) | join(" | ")) + " |"' "${files[@]}"
}

# Lines of one column of each place's calibration
calibration_lines() {
  local place lines=()
  for place in $prediction; do
    lines+=("'$keep/calibration-$place.csv' using 3:$1 with linespoints pointtype 7 pointsize 0.5 title '${place/-/ }'")
  done
  local IFS=,
  echo "${lines[*]}"
}

draw_prediction() {
  command -v gnuplot >/dev/null || return 0
  gnuplot -e "set datafile separator ','; set terminal pngcairo size 1100,430; set output '$keep/guidance_prediction.png';
    set multiplot layout 1,2; set grid; set xrange [0.5:10.5]; set xtics 1;
    set xlabel 'tenth of the surfels, by predicted quality (10: best)';
    set ylabel 'median error, target GSD'; set key right top; set yrange [0:*]; plot $(calibration_lines 4);
    set ylabel 'completeness'; set key right bottom; set yrange [0:1]; plot $(calibration_lines 5)"
  say "$keep/guidance_prediction.png"
}

# policy_table PART
policy_table() {
  local files
  mapfile -t files < <(files_of "$1" "$policy")
  echo
  echo '| place | policy | photos to 70 % | to 90 % | mean share | share at the end | did not register at once |'
  echo '|---|---|---|---|---|---|---|'
  jq -r 'def n: if . == null then "-" else round end; '"$rounding"'
    "| \(.scenario) \(.seed) | \(.policy) | \(.photos_to_70_percent | n) | \(.photos_to_90_percent | n) | \(.area_under_curve | r) | \(.last | r) | \(.failed_to_register) |"' \
    "${files[@]}"
  echo
  echo 'The verdict, when it was first given and at the end. Of what the whole pool covers: covered, told as good, told as'
  echo 'good and not covered (beside it the share of what is told as good):'
  echo
  echo '| place | policy | | photos | verdict | covered | told good | not covered | of told |'
  echo '|---|---|---|---|---|---|---|---|---|'
  jq -r "$rounding"' def verdict: ["growing", "weak", "nearly", "complete"][.];
    . as $run | [["first nearly complete", .nearly], ["first complete", .complete], ["end", .end]][]
    | "| \($run.scenario) \($run.seed) | \($run.policy) | \(.[0]) | " + (.[1] | if . == null then "never | | | | | |" else
    "\(.photos) | \(.verdict | verdict) | \(.covered | r) | \(.told_good | r) | \(.told_good_falsely | . * 1000 | round / 1000) | \(.false_share_of_told | r) |" end)' \
    "${files[@]}"
}

# draw_policy PART
draw_policy() {
  command -v gnuplot >/dev/null || return 0
  local place name plots='' lines
  for place in $policy; do
    lines=()
    for name in $policies; do
      lines+=("'< grep \",$name,\" $keep/$1-$place.csv' using 4:7 with linespoints pointtype 7 pointsize 0.4 title '$name'")
    done
    plots+="set title '${place/-/ }'; plot $(IFS=,; echo "${lines[*]}"); "
  done
  gnuplot -e "set datafile separator ','; set terminal pngcairo size $((430 * $(wc -w <<<"$policy"))),430;
    set output '$keep/guidance_$1.png'; set multiplot layout 1,$(wc -w <<<"$policy"); set grid; set yrange [0:1];
    set key right bottom font ',9'; set xlabel 'photos'; set ylabel 'share of what the whole pool covers'; $plots"
  say "$keep/guidance_$1.png"
}

echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), commit $(git -C "$SKEIN_ROOT" rev-parse --short HEAD)"
for part in $parts; do
  if [[ $part == prediction ]]; then
    for place in $prediction; do run prediction "$place" --calibration "$keep/calibration-$place.csv"; done
    prediction_tables
    draw_prediction
  else
    from=()
    [[ $part == policy ]] || from=(--gaps)
    for place in $policy; do run "$part" "$place" --max-photos "$max_photos" "${from[@]}" --policies $policies; done
    policy_table "$part"
    draw_policy "$part"
  fi
done
