#!/usr/bin/env bash
# Is what guidance says true, and does its advice help? On synthetic places with known surfaces: each
# station of a scenario's walks in four ways (240 photos) is a pool to take photos from. And on real photos.
#
#   benchmark/guidance/guidance.sh --keep DIR [--parts "LIST"] [--prediction "LIST"] [--policy "LIST"]
#                         [--real "LIST"] [--policies "LIST"] [--max-photos N] [--threads N]
#
#   --keep DIR           rendered photos, tables and pictures; a run that is there is not repeated
#   --parts "LIST"       of: prediction policy gaps real (default: all, real only with --real)
#   --prediction "LIST"  places as SCENARIO-SEED (default "together-1 disjoint-1 blank-1 furniture-1
#                        together-2 disjoint-2 blank-2 furniture-2")
#   --policy "LIST"      the same for the policies, gaps included (default "together-1 disjoint-1 blank-1")
#   --real "LIST"        pools of real photos as NAME=SPARSE:IMAGES: the COLMAP model of all of them, as `skein export`
#                        writes it, and the folder that its photos lie in
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
# Real: the same from a pool of real photos, where `advice` takes the photo nearest to the station. The share is of the
# whole pool's dense points.
# Gaps: the same from the scenario's walks without the middle third of each; `order` fills these as planned.
# docs/experiments/guidance.md has the figures. Pictures need gnuplot.
source "$(dirname "$0")/../../scripts/lib.sh"

keep='' parts='' real='' threads=1 max_photos=60
prediction="together-1 disjoint-1 blank-1 furniture-1 together-2 disjoint-2 blank-2 furniture-2"
policy="together-1 disjoint-1 blank-1"
policies="advice gain gain-diminishing Q order random farthest farthest-overlapping"
while (($#)); do
  case $1 in
    -h | --help) print_help; exit 0 ;;
    --keep | --parts | --prediction | --policy | --real | --policies | --max-photos | --threads)
      [[ -n ${2:-} ]] || usage_error "$1 needs a value" ;;&
    --keep) keep=$2; shift ;;
    --parts) parts=$2; shift ;;
    --prediction) prediction=$2; shift ;;
    --policy) policy=$2; shift ;;
    --real) real=$2; shift ;;
    --policies) policies=$2; shift ;;
    --max-photos) max_photos=$2; shift ;;
    --threads) threads=$2; shift ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ -n $keep ]] || usage_error "--keep is needed"
[[ -n $parts ]] || parts="prediction policy gaps${real:+ real}"
# tool PART
tool() { [[ $1 == prediction ]] && echo "$SKEIN_BUILD/bin/guidance_prediction" || echo "$SKEIN_BUILD/bin/guidance_policy"; }
for part in $parts; do
  [[ " prediction policy gaps real " == *" $part "* ]] || usage_error "--parts: there is no $part"
  [[ -x $(tool "$part") ]] || die "no $(tool "$part"): build first"
done
[[ " $parts " != *" real "* || -n $real ]] || usage_error "--parts real needs --real"
real_names=''
for pool in $real; do
  [[ $pool == *=*:* ]] || usage_error "--real: not NAME=SPARSE:IMAGES: $pool"
  real_names+=" ${pool%%=*}"
done
mkdir -p "$keep"

# run PART PLACE OPTION...: the tool's JSON into $keep/PART-PLACE.json, whole or not at all
run() {
  local out=$keep/$1-$2.json part=$1 place=$2
  [[ ! -e $out ]] || return 0
  shift 2
  "$(tool "$part")" --threads "$threads" --table "$keep/$part-$place.csv" "$@" >"$out.part" || die "$part of $place failed"
  mv "$out.part" "$out"
}

# run_scenario PART PLACE [OPTION...]
run_scenario() {
  run "$1" "$2" --scenario "${2%-*}" --seed "${2##*-}" --cache "$keep/photos" "${@:3}"
}

# run_real NAME=SPARSE:IMAGES [OPTION...]
run_real() {
  local name=${1%%=*} folders=${1#*=}
  run real "$name" --name "$name" --model "${folders%%:*}" --images "${folders#*:}" "${@:2}"
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

# policy_table PART PLACES
policy_table() {
  local files
  mapfile -t files < <(files_of "$1" "$2")
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

# draw_policy PART PLACES
draw_policy() {
  command -v gnuplot >/dev/null || return 0
  local place name plots='' lines
  for place in $2; do
    lines=()
    for name in $policies; do
      lines+=("'< grep \",$name,\" $keep/$1-$place.csv' using 4:7 with linespoints pointtype 7 pointsize 0.4 title '$name'")
    done
    plots+="set title '$place'; plot $(IFS=,; echo "${lines[*]}"); "
  done
  gnuplot -e "set datafile separator ','; set terminal pngcairo size $((430 * $(wc -w <<<"$2"))),430;
    set output '$keep/guidance_$1.png'; set multiplot layout 1,$(wc -w <<<"$2"); set grid; set yrange [0:1];
    set key right bottom font ',9'; set xlabel 'photos'; set ylabel 'share of what the whole pool covers'; $plots"
  say "$keep/guidance_$1.png"
}

echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), commit $(build_commit)"
for part in $parts; do
  contest=(--max-photos "$max_photos" --policies $policies)
  case $part in
    prediction)
      for place in $prediction; do run_scenario prediction "$place" --calibration "$keep/calibration-$place.csv"; done
      prediction_tables
      draw_prediction
      continue
      ;;
    policy) for place in $policy; do run_scenario policy "$place" "${contest[@]}"; done ;;
    gaps) for place in $policy; do run_scenario gaps "$place" --gaps "${contest[@]}"; done ;;
    real) for pool in $real; do run_real "$pool" "${contest[@]}"; done ;;
  esac
  places=$policy
  [[ $part != real ]] || places=$real_names
  policy_table "$part" "$places"
  draw_policy "$part" "$places"
done
