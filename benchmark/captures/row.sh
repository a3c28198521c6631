#!/usr/bin/env bash
# One row of captures.sh, which starts it: makes the capture, runs Skein and COLMAP's mapper, prints the row.
#
#   row.sh SET KIND
#
# CAPTURES_OUT holds, of each row SET.KIND:
#   photos/SET.KIND/AGENT/   the capture
#   runs/SET.KIND/           Skein's session, its log, run.json; remove runs/ to measure another build
#   colmap/SET.KIND/         COLMAP's models and result.json, of the matches of the first build that ran
#   rows/SET.KIND.json       all figures
# A session keeps its photos and blobs only where something was wrong, or COLMAP has not run.
source "$(dirname "$0")/../../scripts/lib.sh"
datasets=$CAPTURES_DATASETS places=$CAPTURES_OUT/places
source "$(dirname "$0")/sets.sh"

set=$1 kind=$2 row=$(basename "$1").$2
capture=$CAPTURES_OUT/photos/$row run=$CAPTURES_OUT/runs/$row colmap=$CAPTURES_OUT/colmap/$row
session=$run/session skein=$SKEIN_BUILD/bin/skein

# link AGENT PREFIX PHOTO...: in the capture, as PREFIX and its own name
link() {
  local agent=$1 prefix=$2 photo
  shift 2
  mkdir -p "$capture/$agent"
  for photo; do ln -sfn "$photo" "$capture/$agent/$prefix$(basename "$photo")"; done
}

# The photos of the other sets, each with the name of its set in front.
link_strangers() {
  local wanted=$1 other own=("${photos[@]}") strangers=() i
  for other in $all_sets; do
    [[ $other != "$set" ]] || continue
    photos_of "$other"
    for i in "${!photos[@]}"; do strangers+=("$other ${photos[i]}"); done
  done
  photos=("${own[@]}")
  ((wanted <= ${#strangers[@]})) || wanted=${#strangers[@]}
  for ((i = 0; i < wanted; ++i)); do
    other=${strangers[i * ${#strangers[@]} / wanted]}
    link camera "from-${other%% *}__" "${other#* }"
  done
}

# The next set that is there; the last one's, and that of a set of another folder, is the first.
partner() {
  local names=" $all_sets $all_sets " name
  [[ $names != *" $set "* ]] || names=${names#*" $set "}
  for name in $names; do
    [[ ! -d $datasets/$name || $name == "$set" ]] || { echo "$name"; return; }
  done
}

make_photos() {
  local n=${#photos[@]} i other own
  case $kind in
    name | shuffle-*) link camera '' "${photos[@]}" ;;
    agents) for i in "${!photos[@]}"; do link "agent-$((1 + 3 * i / n))" '' "${photos[i]}"; done ;;
    turns) for i in "${!photos[@]}"; do link "agent-$((1 + i % 3))" '' "${photos[i]}"; done ;;
    second) for ((i = 0; i < n; i += 2)); do link camera '' "${photos[i]}"; done ;;
    third) for ((i = 0; i < n; i += 3)); do link camera '' "${photos[i]}"; done ;;
    two-sets)
      link camera '' "${photos[@]}"
      own=("${photos[@]}") other=$(partner)
      [[ -n $other ]] || die "$row: there is no other set"
      photos_of "$other"
      link camera "from-${other}__" "${photos[@]}"
      photos=("${own[@]}")
      ;;
    foreign) # three of ten
      link camera '' "${photos[@]}"
      link_strangers $((n * 3 / 7))
      ;;
    rotation*) "$SKEIN_BUILD/bin/make_capture" "$kind" "$capture/camera" "${photos[n / 2]}" ;;
    *) "$SKEIN_BUILD/bin/make_capture" "$kind" "$capture/camera" "${photos[@]}" ;;
  esac
}

num_offered() { find "$capture"/*/ -name '*.*' | wc -l; }

# A session that has not ended after this long never will: ten times what the slowest set takes.
limit_s() { echo $((300 + 10 * $(num_offered))); }

child=''
trap '[[ -z $child ]] || { kill "$child" 2>/dev/null || true; wait "$child" || true; }; exit 130' INT TERM
# in_time FOLDER COMMAND...: its seconds of wall and CPU time into FOLDER/times, its output into FOLDER/log. Returns
# 124 or 137 where it did not end.
in_time() {
  local folder=$1 status=0 TIMEFORMAT='%R %U %S'
  shift
  {
    time {
      timeout -k 60 "$(limit_s)" "$@" >"$folder/log" 2>&1 &
      child=$!
      wait "$child"
    }
  } 2>"$folder/times" || status=$?
  return "$status"
}
times_of() { awk '{ printf "\"wall_s\": %s, \"cpu_s\": %s", $1, $2 + $3 }' "$1/times"; }

run_skein() {
  local images=() folder order=name config=() status=0
  [[ ! -e $run/run.json ]] || return 0
  rm -rf "$run" && mkdir -p "$run"
  for folder in "$capture"/*/; do images+=(--images "$folder"); done
  case $kind in
    shuffle-*) order=shuffle:${kind#shuffle-} ;;
    two-sets | foreign) order=shuffle:1 ;;
  esac
  [[ -z $CAPTURES_CONFIG ]] || config=(--config "$CAPTURES_CONFIG")
  in_time "$run" "$SKEIN_ROOT/scripts/reconstruct.sh" --session "$session" --build "$SKEIN_BUILD" --order "$order" "${config[@]}" "${images[@]}" || status=$?
  session_figures "$status" >"$run/run.json.part"
  mv "$run/run.json.part" "$run/run.json"
}

ledger() { sqlite3 "file:$session/ledger.db?mode=ro" "$1" 2>/dev/null || true; }

# num_mixed: maps with photos of more than one set
num_mixed() {
  local model count=0 origins
  for model in "$session"/sparse/[0-9]*; do
    [[ -e $model ]] || continue
    rm -rf "$run/text"
    "$skein" export --model "$model" --output "$run/text" --format text >/dev/null 2>&1
    origins=$(find "$run/text" -name images.txt -exec awk '!/^#/ && ++n % 2 { print $NF }' {} + |
      sed -E 's|.*/||; s|__.*||; /^from-/! s|.*|own|' | sort -u | wc -l)
    ((origins <= 1)) || count=$((count + 1))
  done
  rm -rf "$run/text"
  echo "$count"
}

# error_of MODELS: position RMSE in % of the extent and the photos compared, of the model that has most of the set's;
# null where there is no truth, or no model
error_of() {
  local truth
  truth=$(truth_of "$set" "$CAPTURES_OUT/photos")
  if [[ -z $truth ]] || is_rotation "$kind"; then echo null; return; fi
  { "$skein" evaluate --json "$1" "$truth" 2>/dev/null || echo null; } |
    jq -c 'if . == null then null else .models | max_by(.registered) | {percent: .position_rmse_percent, compared: .registered} end'
}

# session_figures STATUS: of reconstruct.sh
session_figures() {
  local report=$session/report.json
  [[ -e $report ]] || { report=$run/none.json && echo '{}' >"$report"; }
  jq -c --argjson offered "$(num_offered)" --argjson status "$1" \
    --argjson restarts "$(grep -c ' ended (' "$run/log" || true)" \
    --argjson mixed "$(num_mixed)" --argjson error "$(error_of "$session")" \
    --argjson registrations "$(ledger "SELECT COUNT(*) FROM facts WHERE kind = 'registration'" | grep . || echo 0)" \
    --argjson matched "$(ledger "SELECT ROUND((MAX(utime_us) - (SELECT MIN(utime_us) FROM facts WHERE kind = 'image')) / 1e6, 1) FROM facts WHERE kind = 'matches'" | grep . || echo null)" \
    --argjson finish "$(ledger "SELECT ROUND((MAX(utime_us) - (SELECT MAX(utime_us) FROM facts WHERE kind = 'matches')) / 1e6, 1) FROM facts WHERE kind = 'finish'" | grep . || echo null)" \
    --argjson times "{$(times_of "$run")}" --arg commit "$(build_commit)" '
    {commit: $commit, offered: $offered, ended: ($status != 124 and $status != 137), restarts: $restarts,
     reported: has("images"), registered: (.images.registered // 0), maps: [.submaps[]?.images], mixed: $mixed, error: $error,
     accounted: (.images | . != null and .received == .registered + .deferred + .failed),
     placements: $registrations, matched_s: $matched, finish_s: $finish,
     causes: ([.deferred[]?.cause] | group_by(.) | map({(.[0]): length}) | add)} + $times' "$report"
}

run_colmap() {
  local ended=true model sizes=()
  [[ $CAPTURES_COLMAP == 1 && ! -e $colmap/result.json && -e $session/ledger.db ]] && ! is_rotation "$kind" || return 0
  rm -rf "$colmap" && mkdir -p "$colmap"
  "$skein" export --session "$session" --format database --output "$colmap/export" >"$colmap/export.log" 2>&1 ||
    { warn "$row: no database for COLMAP ($colmap/export.log)"; return 0; }
  in_time "$colmap" colmap mapper --database_path "$colmap/export/database.db" --image_path "$session/images" \
    --output_path "$colmap" --random_seed 1 --Mapper.num_threads 2 --Mapper.extract_colors 0 ||
    [[ $? != 124 && $? != 137 ]] || ended=false # no model is a result, too
  for model in "$colmap"/[0-9]*; do [[ ! -e $model/images.bin ]] || sizes+=("$(num_images "$model")"); done
  rm -rf "$colmap/export"
  jq -nc --argjson ended "$ended" --argjson error "$(error_of "$colmap")" --argjson times "{$(times_of "$colmap")}" \
    '{ended: $ended, maps: ($ARGS.positional | map(tonumber) | sort | reverse), error: $error} + $times' --args "${sizes[@]}" >"$colmap/result.json.part"
  mv "$colmap/result.json.part" "$colmap/result.json"
}

photos_of "$set"
[[ $kind != zoom ]] || grep -aq Exif <(head -c 4096 "${photos[0]}") || exit 0 # else it is zoom-no-exif
mkdir -p "$CAPTURES_OUT/photos" "$CAPTURES_OUT/rows"
[[ -e $capture.complete ]] || {
  rm -rf "$capture"
  make_photos
  touch "$capture.complete"
}
run_skein
run_colmap
jq -c --arg set "$(basename "$set")" --arg kind "$kind" --slurpfile colmap <(cat "$colmap/result.json" 2>/dev/null || true) \
  '{set: $set, kind: $kind} + . + {colmap: $colmap[0]}' "$run/run.json" >"$CAPTURES_OUT/rows/$row.json"
figures() { jq -rs -L "$SKEIN_ROOT/benchmark/captures" "include \"table\"; $1" "$CAPTURES_OUT/rows/$row.json"; }
figures markdown
[[ $CAPTURES_COLMAP != 1 || -n $(figures '.[] | faults | .[]') ]] || rm -rf "$session"/{images,blobs,ledger.db*}
