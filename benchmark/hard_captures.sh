#!/usr/bin/env bash
# Hard captures: hand-held video, a room with blank walls, tourists' photos (skein sim --scenario), and
# sets of one's own. Each with one agent and several, in several orders; beside COLMAP 3.8's mapper on
# the same verified matches.
#
#   benchmark/hard_captures.sh [--sets "LIST"] [--agents "LIST"] [--orders "LIST"] [--keep DIR] [--colmap on|off] [--config FILE]
#
#   --sets "LIST"    of: video blank crowd (default: all), or PATH of a folder with images/ (JPEG) and,
#                    if there is a truth, truth (what `skein evaluate` takes): dealt out by file order
#   --agents "LIST"  how many share the photos (default "1 3")
#   --orders "LIST"  seeds of the order in which each agent sends; 0: by name (default "0 1 2 3 4")
#   --keep DIR       keeps the sessions there; one that is there is not repeated
#   --colmap off     without COLMAP's row
#   --config FILE    options of the services (what launch.sh takes), for comparison; give another --keep, too
#
# A row: photos registered in the largest model and in all, models, position RMSE of the largest in
# percent of the extent, seconds from the first photo to the final model, of which after the last photo
# was matched, placements a photo, merges done / undone / without a similarity. COLMAP: photos in its
# largest model, the RMSE, seconds (two threads).
# Needs a network namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../tests/harness.sh"
source "$(dirname "$0")/../tests/session.sh"

sets="video blank crowd" agents="1 3" orders="0 1 2 3 4" keep='' colmap=on config=''
take_options "sets agents orders keep colmap config" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
keep=${keep:-$workspace/keep}
mkdir -p "$keep"

# share_out FOLDER AGENTS: links to its photos, by file order, one folder an agent
share_out() {
  local photos=("$1"/images/*) i
  place=$workspace/$(basename "$1")-$2 num_photos=${#photos[@]}
  for i in "${!photos[@]}"; do
    mkdir -p "$place/images/agent-$((1 + $2 * i / num_photos))"
    ln -sfn "$(realpath "${photos[i]}")" "$place/images/agent-$((1 + $2 * i / num_photos))/"
  done
  ln -sfn "$(realpath -m "$1/truth")" "$place/truth"
}

# choose_set SET AGENTS: sets `place`, `num_photos`
choose_set() {
  case $1 in
    video) use_place "$2" $((250 / $2)) --scenario video --size 640x480 --seed 11 ;;
    blank) use_place "$2" $((120 / $2)) --scenario blank --seed 11 ;;
    crowd) use_place "$2" $((150 / $2)) --scenario crowd --seed 11 ;;
    *)
      [[ -d $1/images ]] || usage_error "no set $1"
      share_out "$1" "$2"
      ;;
  esac
}

# How long it took from the last photo's matches to the last final model
finish_seconds() {
  sqlite3 "file:$1/ledger.db?mode=ro" "SELECT (MAX(utime_us) - MIN(CASE WHEN fact_id LIKE 'finish/%/drained' THEN utime_us END)) / 1000000
    FROM facts WHERE kind = 'finish'"
}

rmse_of() { "$SKEIN_BUILD/bin/skein" evaluate --json "$1" "$place/truth" 2>/dev/null | jq -r '.position_rmse_percent * 1000 | round / 1000' || echo -; }

# run_colmap SESSION: its database, mapped by COLMAP; into SESSION-colmap
run_colmap() {
  local out=$1-colmap
  [[ ! -e $out/seconds ]] || return 0
  rm -rf "$out" && mkdir -p "$out"
  "$SKEIN_BUILD/bin/skein" export --session "$1" --format database --output "$out/export" >"$out/log" 2>&1
  local start=$SECONDS
  colmap mapper --database_path "$out/export/database.db" --image_path "$1/images" --output_path "$out" \
    --Mapper.num_threads 2 --Mapper.extract_colors 0 >>"$out/log" 2>&1 || true # no model is a result, too
  echo $((SECONDS - start)) >"$out/seconds"
}

# colmap_cells SESSION
colmap_cells() {
  local model
  model=$(largest_model "$1-colmap" 2>/dev/null) || { echo "0 | - | $(<"$1-colmap/seconds")"; return; }
  echo "$(num_images "$model") | $(rmse_of "$model") | $(<"$1-colmap/seconds")"
}

# row SET AGENTS ORDER
row() {
  local name session report order=name
  name=$(basename "$1")
  session=$keep/$name-$2-$3 report=$keep/$name-$2-$3/report.json
  [[ $3 == 0 ]] || order=shuffle:$3
  if [[ ! -e $report ]]; then
    rm -rf "$session"
    start_services "$session" "$url" ${config:+--config "$config"} >"$session.log" 2>&1
    publish "$session" --order "$order"
    await_agents
    finish "$session"
    stop_services
  fi
  [[ $colmap == off ]] || run_colmap "$session"
  printf '| %s | %s | %s | %s | %s | %s | %s |%s\n' "$name" "$2" "$3" \
    "$(jq -r '"\([.submaps[].images] | max // 0) of \(.images.received), \(.images.registered) in \(.submaps | length)"' "$report")" \
    "$(rmse_of "$session/sparse/0")" \
    "$(jq -r '.wall_s | round' "$report"), $(finish_seconds "$session")" \
    "$(jq -r '"\(.images.placements / .images.received * 100 | round / 100) | \([.merges[] | select(.state == "done")] | length) / \([.merges[] | select(.state == "undone")] | length) / \([.merges[] | select(.state == "failed")] | length)"' "$report")" \
    "$([[ $colmap == off ]] || echo " $(colmap_cells "$session") |")"
}

print_machine
echo "| set | agents | order | largest model, all | RMSE, % | seconds, of which finish | placements a photo | merges done / undone / failed |$([[ $colmap == off ]] || echo ' COLMAP: largest model | RMSE, % | s |')"
echo "|---|---|---|---|---|---|---|---|$([[ $colmap == off ]] || echo '---|---|---|')"
for name in $sets; do
  for count in $agents; do
    choose_set "$name" "$count" >&2
    for order in $orders; do row "$name" "$count" "$order"; done
  done
done
