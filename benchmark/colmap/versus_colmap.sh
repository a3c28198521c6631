#!/usr/bin/env bash
# Skein beside COLMAP 3.8, on the same features and verified matches: the paper's Table VI, the error
# against ground truth, and what the final global BA is worth (the paper's section 4.5.2).
#
#   benchmark/colmap/versus_colmap.sh --session NAME=DIR [--truth NAME=PATH] [...] --keep DIR [options]
#   benchmark/colmap/versus_colmap.sh --datasets DIR --keep DIR [options]
#
#   --session NAME=DIR   a finished session; its database is exported, its model compared
#   --truth NAME=PATH    what `skein evaluate` takes; with PATH/surfaces.ply (a place of `skein sim`)
#                        the points are compared with the true surfaces, too
#   --reference NAME=PATH  likewise, but poses of other software: the distance is told, without a limit
#   --whole NAME=IMAGES  also COLMAP's whole pipeline on these photos (1,600 px, 8,192 features,
#                        exhaustive matching): hours for more than a few
#   --datasets DIR       makes sessions of fountain-P11, south-building and caliterra there, and of a
#                        synthetic place of 60 photos (needs root or user namespaces)
#   --sets "LIST"        only these of them (default "fountain-P11 synthetic south-building caliterra")
#   --seeds "LIST"       COLMAP's --random_seed (default "1 2 3")
#   --keep DIR           models and logs; a run that is there is not repeated
#
# Rows: the session's model; the mapper alone, fed with the database in the session's order: finished,
# before finish, and with local BA only (no global BA between the first photos and finish); COLMAP's
# mapper: median, least and most of the seeds. Both mappers run on one thread. Rotations: of all
# photos against COLMAP's model, median over the seeds of the mean and of the largest (COLMAP's row:
# its seeds against each other). Times are of CPU.
# Exits 1 if the session's model is beyond a limit: fewer photos than COLMAP, MRE > 1.05 x, MTL < 0.95 x,
# position RMSE > 1.10 x (with a --truth), mean rotation discrepancy > 0.1 degrees if both have the same
# camera model: a lens that is not centred looks like photos that are turned.
source "$(dirname "$0")/../../scripts/lib.sh"

keep='' datasets='' sets="fountain-P11 synthetic south-building caliterra" seeds="1 2 3" names=()
declare -A session=() truth=() is_reference=() whole=()
while (($#)); do
  case $1 in
    -h | --help) print_help; exit 0 ;;
    --session | --truth | --reference | --whole | --datasets | --sets | --seeds | --keep)
      [[ -n ${2:-} ]] || usage_error "$1 needs a value" ;;&
    --session) names+=("${2%%=*}"); session[${2%%=*}]=${2#*=}; shift ;;
    --truth) truth[${2%%=*}]=${2#*=}; shift ;;
    --reference) truth[${2%%=*}]=${2#*=} is_reference[${2%%=*}]=true; shift ;;
    --whole) whole[${2%%=*}]=${2#*=}; shift ;;
    --datasets) datasets=$2; shift ;;
    --sets) sets=$2; shift ;;
    --seeds) seeds=$2; shift ;;
    --keep) keep=$2; shift ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ -n $keep ]] || usage_error "--keep is needed"
[[ -n $datasets || ${#names[@]} -gt 0 ]] || usage_error "--session or --datasets is needed"
command -v colmap >/dev/null || die "no colmap: scripts/setup.sh --tests installs it"
bin=$SKEIN_BUILD/bin
for tool in skein mapper_offline model_figures; do
  [[ -x $bin/$tool ]] || die "no $bin/$tool: build first"
done
mkdir -p "$keep"
broken=0

# timed FOLDER CMD...: CPU seconds into FOLDER/cpu_s when it succeeds
timed() {
  local folder=$1 TIMEFORMAT='%U %S'
  shift
  { time "$@" >"$folder/log" 2>&1; } 2>"$folder/times" || { tail -n 20 "$folder/log" >&2; die "$1 failed: $folder/log"; }
  awk '{ print $1 + $2 }' "$folder/times" >"$folder/cpu_s"
}

# make_session NAME TRUTH IMAGES...: a session of its own, in a network namespace
make_session() {
  local name=$1 path=$2 folder=$keep/$1/session images=()
  shift 2
  for arguments; do images+=(--images "$(basename "$arguments")=$arguments"); done
  names+=("$name") session[$name]=$folder
  [[ -z $path ]] || truth[$name]=$path
  [[ ! -e $folder/report.json ]] || return 0
  mkdir -p "$keep/$name"
  say "$name: making a session" >&2
  local unshare=(unshare --net)
  ((EUID == 0)) || unshare+=(--map-root-user)
  "${unshare[@]}" bash -c 'ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo; exec "$@"' _ \
    "$SKEIN_ROOT/scripts/reconstruct.sh" --session "$folder" "${images[@]}" --build "$SKEIN_BUILD" \
    >"$keep/$name/reconstruct.log" 2>&1 || { cat "$keep/$name/reconstruct.log" >&2; die "no session of $name"; }
}

# make_set SET: of --datasets
make_set() {
  local folder=$datasets/$1 place=$keep/synthetic/place
  case $1 in
    synthetic)
      render_place "$place" 3 20 --seed 1 >/dev/null
      make_session synthetic "$place/truth" "$place"/images/*
      ;;
    fountain-P11)
      whole[$1]=$folder/images
      make_session "$1" "$folder/gt_dense_cameras" "$folder/images"
      ;;
    south-building)
      is_reference[$1]=true
      make_session "$1" "$folder/reference" "$folder/images"
      ;;
    caliterra) make_session "$1" '' "$folder/images" ;;
    *) usage_error "unknown set $1" ;;
  esac
}

make_sessions() {
  local set
  for set in $sets; do
    [[ $set == synthetic || -d $datasets/$set ]] || { echo "no $datasets/$set: left out"; continue; }
    make_set "$set"
  done
}

run_skein() {
  local folder=$keep/$1
  mkdir -p "$folder/skein" "$folder/local"
  [[ -e $folder/database.db ]] || {
    rm -rf "$folder/export"
    "$bin/skein" export --session "${session[$1]}" --format database --output "$folder/export" >/dev/null 2>&1 || die "export of $1 failed"
    mv "$folder/export/database.db" "$folder/database.db"
  }
  local command=("$bin/mapper_offline" --database "$folder/database.db" --order id --max-pairs 0)
  [[ -e $folder/skein/cpu_s ]] ||
    timed "$folder/skein" "${command[@]}" --output-before "$folder/skein/before" --output "$folder/skein/after"
  [[ -e $folder/local/cpu_s ]] ||
    timed "$folder/local" "${command[@]}" --no-global-ba --output-before "$folder/local/before" --output "$folder/local/after"
}

# run_colmap NAME SEED
run_colmap() {
  local folder=$keep/$1/colmap-$2
  [[ ! -e $folder/cpu_s ]] || return 0
  mkdir -p "$folder"
  timed "$folder" colmap mapper --database_path "$keep/$1/database.db" --image_path "${session[$1]}/images" \
    --output_path "$folder" --random_seed "$2" --Mapper.num_threads 1 --Mapper.extract_colors 0
}

run_whole() {
  local folder=$keep/$1/colmap-whole
  [[ ! -e $folder/cpu_s ]] || return 0
  rm -rf "$folder" && mkdir -p "$folder"
  timed "$folder" bash -ec 'export QT_QPA_PLATFORM=offscreen
    colmap feature_extractor --database_path "$1/database.db" --image_path "$2" --SiftExtraction.use_gpu 0 \
      --SiftExtraction.max_image_size 1600 --ImageReader.single_camera 1
    colmap exhaustive_matcher --database_path "$1/database.db" --SiftMatching.use_gpu 0
    colmap mapper --database_path "$1/database.db" --image_path "$2" --output_path "$1"' _ "$folder" "${whole[$1]}"
}

# figures NAME MODEL [REFERENCE...]: JSON; rotations: median over the references
figures() {
  local options=() model=$2 name=$1 reference
  shift 2
  [[ -z ${truth[$name]:-} ]] || options+=(--truth "${truth[$name]}")
  [[ ! -e ${truth[$name]:-/}/surfaces.ply ]] || options+=(--surfaces "${truth[$name]}/surfaces.ply")
  (
    "$bin/model_figures" "$model" "${options[@]}"
    for reference; do "$bin/model_figures" "$model" --reference "$reference"; done
  ) | jq -sc 'def median: sort | if length == 0 then null else .[(length - 1) / 2 | floor] end;
    .[0] + {rotation_mean_deg: ([.[1:][].rotation_mean_deg] | median), rotation_max_deg: ([.[1:][].rotation_max_deg] | median)}'
}
with_cpu() { jq -c --argjson cpu "$1" '. + {cpu_s: $cpu}'; }

# colmap_figures NAME: a line of JSON each seed, against the other seeds
colmap_figures() {
  local seed other others
  for seed in $seeds; do
    others=()
    for other in $seeds; do [[ $other == "$seed" ]] || others+=("$(largest_model "$keep/$1/colmap-$other")"); done
    figures "$1" "$(largest_model "$keep/$1/colmap-$seed")" "${others[@]}" | with_cpu "$(<"$keep/$1/colmap-$seed/cpu_s")"
  done
}

before_finish_s() { awk '/^before finish/ { for (i = 1; i < NF; ++i) if ($i == "cpu_s") print $(i + 1) }' "$1"; }
all_s() { awk '/^(before|after) finish/ { for (i = 1; i < NF; ++i) if ($i == "cpu_s") sum += $(i + 1) } END { print sum }' "$1"; }

# rows NAME: {label, figures} lines
rows() {
  local folder=$keep/$1 seed references=()
  for seed in $seeds; do references+=("$(largest_model "$folder/colmap-$seed")"); done
  label() { jq -c --arg text "$1" '. + {label: $text}'; }
  figures "$1" "${session[$1]}/sparse/0" "${references[@]}" | label "Skein, session"
  figures "$1" "$folder/skein/after" "${references[@]}" | with_cpu "$(all_s "$folder/skein/log")" | label "Skein's mapper"
  figures "$1" "$folder/skein/before" "${references[@]}" | with_cpu "$(before_finish_s "$folder/skein/log")" | label "– before finish"
  figures "$1" "$folder/local/before" "${references[@]}" | with_cpu "$(before_finish_s "$folder/local/log")" | label "– local BA only"
  figures "$1" "$folder/local/after" "${references[@]}" | with_cpu "$(all_s "$folder/local/log")" | label "– local BA, then final global BA"
  colmap_figures "$1" | jq -sc --argjson n "$(wc -w <<<"$seeds")" '
    def values(f): map(f) | map(select(. != null)) | sort;
    def pick(g): {registered: (values(.registered) | g), points: (values(.points) | g), mre_px: (values(.mre_px) | g),
      mtl: (values(.mtl) | g), position_percent: (values(.position_percent) | g), cpu_s: (values(.cpu_s) | g),
      rotation_mean_deg: (values(.rotation_mean_deg) | g), rotation_max_deg: (values(.rotation_max_deg) | g),
      point_error: {mean: (values(.point_error.mean) | g), median: (values(.point_error.median) | g)}};
    def median: if length == 0 then null else .[(length - 1) / 2 | floor] end;
    (pick(median) + {label: "COLMAP, median of \($n)"}), (pick(.[0]) + {label: "COLMAP, least"}), (pick(.[-1]) + {label: "COLMAP, most"})'
  [[ -z ${whole[$1]:-} ]] || figures "$1" "$(largest_model "$folder/colmap-whole")" | with_cpu "$(<"$folder/colmap-whole/cpu_s")" | label "COLMAP, whole pipeline"
}

print_table() {
  echo '| | photos | points | MRE px | MTL | CPU s | position RMSE % | points to surfaces, m: mean / median | rotation ° mean / max |'
  echo '|---|---|---|---|---|---|---|---|---|'
  jq -sr '
    def r($d): if . == null then "–" else . * pow(10; $d) | round / pow(10; $d) end;
    def row: "| \(.label) | \(.registered | r(3)) | \(.points | r(3)) | \(.mre_px | r(4)) | \(.mtl | r(3)) | \(.cpu_s | r(2)) | \(.position_percent | r(4)) | \(.point_error.mean | r(4)) / \(.point_error.median | r(4)) | \(.rotation_mean_deg | r(4)) / \(.rotation_max_deg | r(4)) |";
    def over($a; $b): if $a == null or $b == null or $b == 0 then null else $a / $b end;
    (map(select(.label | startswith("COLMAP, median")))[0]) as $c
    | (.[] | row),
      (.[] | select(.label | startswith("COLMAP") | not) | . as $s
       | {label: "\(.label) / COLMAP", registered: over($s.registered; $c.registered), points: over($s.points; $c.points), mre_px: over($s.mre_px; $c.mre_px),
          mtl: over($s.mtl; $c.mtl), cpu_s: over($s.cpu_s; $c.cpu_s), position_percent: over($s.position_percent; $c.position_percent),
          point_error: {mean: over($s.point_error.mean; $c.point_error.mean), median: over($s.point_error.median; $c.point_error.median)}} | row)'
}

# camera_model MODEL: COLMAP's id of its first camera's
camera_model() { od -An -t d4 -j 12 -N 4 "$1/cameras.bin" | tr -d ' '; }

# broken_limits NAME: a line for each limit that the session's model breaks
broken_limits() {
  local ours theirs
  ours=$(camera_model "${session[$1]}/sparse/0") theirs=$(camera_model "$(largest_model "$keep/$1/colmap-${seeds%% *}")")
  jq -sr --argjson is_reference "${is_reference[$1]:-false}" --argjson is_same "$([[ $ours == "$theirs" ]] && echo true || echo false)" '(map(select(.label | startswith("COLMAP, median")))[0]) as $c | .[0] as $s
    | (if $s.registered < $c.registered then "fewer photos than COLMAP" else empty end),
      (if $s.mre_px > 1.05 * $c.mre_px then "MRE above 1.05 x COLMAP" else empty end),
      (if $s.mtl < 0.95 * $c.mtl then "MTL below 0.95 x COLMAP" else empty end),
      (if ($is_reference | not) and $s.position_percent != null and $s.position_percent > 1.10 * $c.position_percent then "position RMSE above 1.10 x COLMAP" else empty end),
      (if $is_same and $s.rotation_mean_deg > 0.1 then "rotation discrepancy above 0.1 degrees" else empty end)'
}

[[ -z $datasets ]] || make_sessions
echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), commit $(build_commit), seeds $seeds"
for name in "${names[@]}"; do
  run_skein "$name"
  for seed in $seeds; do run_colmap "$name" "$seed"; done
  [[ -z ${whole[$name]:-} ]] || run_whole "$name"
  rows "$name" >"$keep/$name/rows"
  printf '\n%s:\n\n' "$name"
  print_table <"$keep/$name/rows"
  while read -r limit; do
    broken=1
    warn "$name: $limit"
  done < <(broken_limits "$name" <"$keep/$name/rows")
done
exit "$broken"
