#!/usr/bin/env bash
# The forms of local BA beside each other, on exported databases: the paper's Table IV and its
# Fig. 12-14.
#
#   benchmark/stages/local_ba.sh --set NAME=DATABASE[,TRUTH] [--set ...] --keep DIR [options]
#
#   --set NAME=DATABASE[,TRUTH]  a database that `skein export --format database` wrote, and what
#                   `skein evaluate` takes as a ground truth
#   --keep DIR      models, tables, logs and plots; a run that is there is not repeated
#   --runs "LIST"   of: local (no global BA between the first photos and finish, as the paper has it)
#                   shipped (with the global BAs at 10 % growth) (default: both)
#   --forms "LIST"  default: all; colmap needs consistent before it
#   --order ORDER   id (as the photos came to the session), name or shuffle:SEED (default id)
#
# Forms: consistent, paper, equal; colmap with as many images as `consistent` has free ones on
# average (the paper's comparison), colmap-6 with COLMAP's own number.
#   AMRE  px, mean over the photos of a photo's mean reprojection error after its local BA
#   AT    ms of CPU of a local BA, one thread
#   images  free images of a local BA
#   MFRE  px, mean reprojection error after the last global BA, i.e. of the finished model
#   drift   position RMSE of the model before finish against the finished one, % of the extent
#   error   the same against the truth, before -> after finish
# Photos up to the twelfth have a global BA each and don't count for AMRE, AT and images.
# Plots need gnuplot.
source "$(dirname "$0")/../../scripts/lib.sh"

keep='' order=id runs="local shipped" forms="consistent equal colmap colmap-6 paper" sets=()
while (($#)); do
  case $1 in
    -h | --help) print_help; exit 0 ;;
    --set | --keep | --runs | --order | --forms)
      [[ -n ${2:-} ]] || usage_error "$1 needs a value" ;;&
    --set) sets+=("$2"); shift ;;
    --keep) keep=$2; shift ;;
    --runs) runs=$2; shift ;;
    --order) order=$2; shift ;;
    --forms) forms=$2; shift ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
((${#sets[@]})) && [[ -n $keep ]] || usage_error "--set and --keep are needed"
bin=$SKEIN_BUILD/bin
for tool in mapper_offline model_figures; do
  [[ -x $bin/$tool ]] || die "no $bin/$tool: build first"
done

# Of the photos whose BA was local.
mean_of_column() { awk -F, -v c="$2" 'NR > 1 && $3 > 12 { sum += $c; n++ } END { print n ? sum / n : "null" }' "$1"; }

# run NAME DATABASE RUN FORM
run() {
  local folder=$keep/$1/$3-$4 options=(--local-ba "${4%-6}")
  [[ ! -e $folder/finished ]] || return 0
  mkdir -p "$folder"
  [[ $3 == shipped ]] || options+=(--no-global-ba)
  [[ $4 != colmap-6 ]] || options+=(--local-ba-images 6)
  [[ $4 != colmap ]] || options+=(--local-ba-images "$(window "$keep/$1/$3-consistent/photos.csv")")
  "$bin/mapper_offline" --database "$2" --order "$order" --max-pairs 0 "${options[@]}" \
    --photo-table "$folder/photos.csv" --output-before "$folder/before" --output "$folder/after" \
    >"$folder/log" 2>&1 || { cat "$folder/log" >&2; die "$1, $4 failed"; }
  touch "$folder/finished"
}
# As many free images, and the two that COLMAP holds.
window() { awk -v mean="$(mean_of_column "$1" 4)" 'BEGIN { printf "%d", mean + 2.5 }'; }

# row NAME RUN FORM TRUTH
row() {
  local folder=$keep/$1/$2-$3 truth=() before after
  [[ -z $4 ]] || truth=(--truth "$4")
  before=$("$bin/model_figures" "$folder/before" --reference "$folder/after" "${truth[@]}")
  after=$("$bin/model_figures" "$folder/after" "${truth[@]}")
  jq -nr --argjson b "$before" --argjson a "$after" --arg form "$3" \
    --argjson amre "$(mean_of_column "$folder/photos.csv" 7)" \
    --argjson at "$(mean_of_column "$folder/photos.csv" 6)" \
    --argjson images "$(mean_of_column "$folder/photos.csv" 4)" \
    --argjson cpu "$(awk '/^before finish/ { print $NF }' "$folder/log")" '
    def r($d): if . == null then "-" else . * pow(10; $d) | round / pow(10; $d) end;
    "| \($form) | \($a.registered) | \($amre | r(4)) | \($at | if . then . * 1000 else . end | r(0)) | \($images | r(1)) | \($b.mre_px | r(4)) | \($a.mre_px | r(4)) | \($a.mtl | r(2)) | \($b.displacement_percent | r(4)) | \($b.position_percent | r(4)) → \($a.position_percent | r(4)) | \($cpu * 1000 | r(0)) |"'
}

table() {
  echo
  echo "$1, $2:"
  echo
  echo '| form | photos | AMRE px | AT ms | images | MRE before finish | MFRE px | MTL | drift % | error % | mapper ms a photo |'
  echo '|---|---|---|---|---|---|---|---|---|---|---|'
  local form
  for form in $forms; do row "$1" "$2" "$form" "$3"; done
}

# plot NAME RUN COLUMN SCALE LABEL FILE; of photos whose BA was local, if there are any
plot() {
  local form clauses=()
  [[ $(mean_of_column "$keep/$1/$2-${forms%% *}/photos.csv" 3) != null ]] || return 0
  for form in $forms; do
    clauses+=("'$keep/$1/$2-$form/photos.csv' using 3:(\$3 > 12 ? \$$3 * $4 : 1/0) with lines title '$form'")
  done
  local IFS=,
  gnuplot -e "set datafile separator ','; set terminal pngcairo size 900,500; set output '$6';
    set xlabel 'photos registered'; set ylabel '$5'; set key left top; set grid; plot ${clauses[*]}"
}

plot_retrieval() {
  local rows=$keep/$1/retrieval.csv
  sqlite3 -csv "file:$2?mode=ro" "SELECT image_id, (insert_s + query_s) * 1000 FROM skein_retrieval ORDER BY image_id" >"$rows"
  gnuplot -e "set datafile separator ','; set terminal pngcairo size 900,500; set output '$keep/$1/retrieval_time.png';
    set xlabel 'photos'; set ylabel 'retrieval, ms'; set grid; set yrange [0:]; plot '$rows' using 1:2 with lines notitle"
}

echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), commit $(git -C "$SKEIN_ROOT" rev-parse --short HEAD), order $order"
for set in "${sets[@]}"; do
  name=${set%%=*} rest=${set#*=} truth=''
  database=${rest%%,*}
  [[ $rest != *,* ]] || truth=${rest#*,}
  [[ -e $database ]] || usage_error "--set $set: there is no $database"
  for run in $runs; do
    for form in $forms; do run "$name" "$database" "$run" "$form"; done
    table "$name" "$run" "$truth"
    if command -v gnuplot >/dev/null; then
      plot "$name" "$run" 6 1000 'local BA, ms of CPU' "$keep/$name/$run-local_ba_time.png"
      plot "$name" "$run" 4 1 'images in the local BA' "$keep/$name/$run-local_ba_images.png"
    fi
  done
  command -v gnuplot >/dev/null && command -v sqlite3 >/dev/null && plot_retrieval "$name" "$database"
done
