# Whole sessions by kernel and number of processors: speed.sh sources it. Wants `kernels`, `cores`, `images`, `photos`, `place`,
# `workspace` and `sessions`, the file that gets a line a session.

# use_session_photos: sets `set`, the photos' name, and `folders`, the options of reconstruct.sh
use_session_photos() {
  local folder files
  folders=() set=synthetic
  if [[ -z $images ]]; then
    for folder in "$place"/images/*/; do folders+=(--images "$folder"); done
    return
  fi
  folder=$(realpath "$images")
  set=$(basename "${folder%/images}")
  if [[ -n $photos ]]; then
    files=("$folder"/*)
    folder=$workspace/photos
    mkdir "$folder"
    ln -s "${files[@]:0:$photos}" "$folder/"
  fi
  folders=(--images "camera=$folder")
}

# find_processors: sets `processors`: one of each core before any core's second
find_processors() {
  local processor
  processors=()
  while read -r _ processor; do
    ! taskset -c "$processor" true 2>/dev/null || processors+=("$processor")
  done < <(lscpu -p=CPU,CORE | awk -F, '!/^#/ { print seen[$2]++, $1 }' | sort -s -n -k 1,1)
}

# find_meter: sets `meter` (joules, instructions or none) and `packages`, of which RAPL counts the energy
find_meter() {
  local zone
  packages=() meter=none
  for zone in /sys/class/powercap/intel-rapl:*; do
    [[ -r $zone/energy_uj && $(<"$zone/name") == package* ]] || continue
    packages+=("$zone") meter=joules
  done
  [[ $meter == none ]] || return 0
  if perf stat "-x," -e instructions:u -o "$workspace/perf" true 2>/dev/null && [[ $(instructions) =~ ^[0-9]+$ ]]; then
    meter=instructions
    say "instructions in place of joules: /sys/class/powercap holds no energy that can be read here"
  else
    say "no joules: /sys/class/powercap holds no energy that can be read here; no instructions: perf cannot count them here"
  fi
}
instructions() { awk -F, '/instructions/ { print $1 }' "$workspace/perf"; }
# energy_uj FILE: what the packages' counters show, a line each
energy_uj() { ((!${#packages[@]})) || cat "${packages[@]/%//energy_uj}" >"$1"; }
# joules: between two such; a counter begins again behind its range
joules() {
  paste "$workspace/before" "$workspace/after" <(cat "${packages[@]/%//max_energy_range_uj}") |
    awk '{ sum += $2 - $1 + ($2 < $1 ? $3 : 0) } END { print sum / 1e6 }'
}

# measure_session KERNEL CORES
measure_session() {
  local kernel=$1 sift=$1 folder=$workspace/session-$1-$2 counter=() pinned cpu figure=null
  [[ $kernel != avx512vnni && $kernel != amx ]] || sift=avx512
  printf '[features]\nkernel = "%s"\n[matching]\nkernel = "%s"\n' "$sift" "$kernel" >"$workspace/kernels.toml"
  [[ $meter != instructions ]] || counter=(perf stat "-x," -e instructions:u -o "$workspace/perf")
  pinned=$(IFS=,; echo "${processors[*]:0:$2}")
  energy_uj "$workspace/before"
  cpu=$(cpu_s taskset -c "$pinned" "${counter[@]}" "$SKEIN_ROOT/scripts/reconstruct.sh" --session "$folder" --build "$SKEIN_BUILD" \
    --config "$workspace/kernels.toml" "${folders[@]}")
  energy_uj "$workspace/after"
  [[ $meter == none ]] || figure=$($meter)
  jq -c --arg set "$set" --arg kernel "$kernel" --argjson cores "$2" --argjson cpu "$cpu" --arg meter "$meter" --argjson figure "$figure" '
    def digits: if . > 1e4 then round else . * 1e4 | round / 1e4 end;
    .images.received as $n | {("\($set), \($kernel), \($cores)"): ({kernel: $kernel, cores: $cores, set: $set, photos: $n, registered: .images.registered,
      wall_s: (.wall_s / $n | digits), cpu_s: ($cpu / $n | digits)} + if $meter == "none" then {} else {($meter): ($figure / $n | digits)} end)}' \
    "$folder/report.json" | tee -a "$sessions" | jq -r --arg meter "$meter" '.[] |
    "| \(.kernel) | \(.cores) | \(.registered)/\(.photos) | \(.wall_s) | \(.cpu_s) | \(.[$meter] // "") |"'
  rm -rf "$folder"
  keep_figures
}

measure_sessions() {
  local count kernel beyond=() within=()
  use_session_photos
  find_processors
  find_meter
  for count in "${cores[@]}"; do
    if ((count <= ${#processors[@]})); then within+=("$count"); else beyond+=("$count"); fi
  done
  ((!${#beyond[@]})) || say "left out: ${beyond[*]} cores, as ${#processors[@]} are here"
  echo "sessions of $set, a photo:"
  echo "| kernel | cores | registered | wall s | CPU s | ${meter/none/} |"
  echo "|---|---|---|---|---|---|"
  for count in "${within[@]}"; do
    for kernel in "${kernels[@]}"; do measure_session "$kernel" "$count"; done
  done
}
