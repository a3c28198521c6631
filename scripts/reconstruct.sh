#!/usr/bin/env bash
# Photos in, model out: starts the services, publishes the photos, finishes, stops.
#
#   scripts/reconstruct.sh --session DIR --images [NAME=]DIR [--images [NAME=]DIR ...] [options]
#
#   --session DIR          session folder; one that exists goes on where it stopped
#   --images [NAME=]DIR    photos of one agent; several are published at once. NAME: the
#                          folder's name unless given
#   --rate HZ              photos a second of each agent (default: as fast as they are taken)
#   --order ORDER          name, time or shuffle:SEED (default name)
#   --config FILE          options of the services; `skein config` prints such a file
#   --max-size PX          longest side at which features are found (default 1600)
#   --ground-truth PATH    evaluate against Strecha .camera files, a COLMAP model or TUM lines
#   --lcm-url URL          default: one of this session's own
#   --features N --matching N --mappers MIN:MAX --threads N --build DIR    as in launch.sh
#   --top-n N              candidates of a photo (default 200: 30 to be matched, further ones for photos with few overlaps)
#   --no-second-look       match with all candidates, for comparison
#   --no-merge             leave the submaps apart, for comparison
#   --no-background-ba     mappers refine the whole map in turn with registration, for comparison
#   --dense on|off         depth maps and dense points for the live view (default off; with --keep on)
#   --keep                 leave the services running after the finish (until Ctrl-C)
#   --check                only say what is wrong with the options; --images may be missing
#
# Exit codes: 0 every photo is accounted for, 1 not or an error, 2 bad usage.
source "$(dirname "$0")/lib.sh"

session='' url='' truth='' keep=0 check=0 dense='' launch_options=() agent_options=()
names=() folders=()

# has_photos DIR: any that `skein agent` takes
has_photos() {
  [[ -n $(find -L "$1" -type f \( -iname '*.jpg' -o -iname '*.jpeg' -o -iname '*.png' -o -iname '*.tif' -o -iname '*.tiff' \) -print -quit 2>/dev/null) ]]
}

# add_images [NAME=]DIR
add_images() {
  local name='' folder=$1
  if [[ ! -d $folder && $folder == *=* ]]; then
    name=${folder%%=*} folder=${folder#*=}
  fi
  [[ -d $folder ]] || usage_error "--images $1: there is no folder '$folder'"
  folder=$(cd "$folder" && pwd)
  has_photos "$folder" || usage_error "--images $1: no JPEG, PNG or TIFF in '$folder' (other photos: convert them, HEIC with heif-convert of libheif-examples; a video: skein agent --video)"
  [[ -n $name ]] || name=$(basename "$folder" | tr -c 'A-Za-z0-9._\n-' '-')
  [[ " ${names[*]} " != *" $name "* ]] || name=$name-$((${#names[@]} + 1))
  names+=("$name") folders+=("$folder")
}

while (($#)); do
  case $1 in
    --keep) keep=1; shift; continue ;;
    --check) check=1; shift; continue ;;
    --no-merge | --no-second-look | --no-background-ba) launch_options+=("$1"); shift; continue ;;
    -h | --help) print_help; exit 0 ;;
  esac
  case $1 in
    --session | --images | --rate | --order | --config | --max-size | --top-n | --features | --matching | --mappers | --threads | --dense | --ground-truth | --lcm-url | --build)
      (($# > 1)) || usage_error "$1 needs a value" ;;&
    --session) session=$2 ;;
    --images) add_images "$2" ;;
    --rate | --order) agent_options+=("$1" "$2") ;;
    --config) [[ -r $2 ]] || usage_error "--config: cannot read '$2'"; launch_options+=("$1" "$2") ;;
    --dense) dense=$2 ;;
    --max-size | --top-n | --features | --matching | --mappers | --threads) launch_options+=("$1" "$2") ;;
    --ground-truth) [[ -e $2 ]] || usage_error "--ground-truth: there is no '$2'"; truth=$(realpath "$2") ;;
    --lcm-url) url=$2 ;;
    --build) SKEIN_BUILD=$2 ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift 2
done
[[ -n $session ]] || usage_error "--session is needed"
((!check)) || exit 0
((${#folders[@]})) || usage_error "--images is needed"
skein=$SKEIN_BUILD/bin/skein
[[ -x $skein ]] || die "no $skein: build first (scripts/demo.sh or scripts/test.sh does)"
mkdir -p "$session"
session=$(cd "$session" && pwd)
[[ -n $url ]] || url=$(private_lcm_url "$session")

agent_pids=()
cleanup() {
  local pid
  for pid in "${agent_pids[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  stop_services
}
trap cleanup EXIT
trap 'exit 130' INT TERM

publish() {
  local i failed=0
  for i in "${!folders[@]}"; do
    "$skein" agent --session "$session" --lcm-url "$url" --name "${names[i]}" \
      --images "${folders[i]}" "${agent_options[@]}" &
    agent_pids+=($!)
  done
  for i in "${!agent_pids[@]}"; do
    wait "${agent_pids[i]}" || { failed=1; warn "agent ${names[i]} could not send all its photos"; }
  done
  agent_pids=()
  return "$failed"
}

# Nobody sees the surface of services that are stopped at once.
[[ -n $dense ]] || { ((keep)) && dense=on || dense=off; }
start_services "$session" "$url" --dense "$dense" "${launch_options[@]}"
status=0
publish || status=1
"$skein" finish --session "$session" --lcm-url "$url" || die "the session did not finish"
jq -r 'def seconds: . * 100 | round / 100;
  def counted(noun): "\(.) \(noun)\(if . == 1 then "" else "s" end)";
  (.images | "photos: \(.received) received, \(.registered) placed, \(.deferred) not placed, \(.failed) failed, \(.duplicates | counted("duplicate"))"),
  "maps: \(.submaps | length)\(if .submaps == [] then "" else " of \([.submaps[].images] | join(", ")) photos" end), \([.merges[] | select(.state == "done")] | length) merged on the way",
  "from received to placed: half within \(.latency_s.p50 | seconds) s, 95 % within \(.latency_s.p95 | seconds) s; \(.wall_s | seconds) s in all"' \
  "$session/report.json"
is_accounted_for "$session/report.json" ||
  { status=1; warn "not every photo is accounted for: see $session/report.json"; }
if [[ -n $truth ]]; then
  "$skein" evaluate "$session/sparse/0" "$truth" || status=1
fi
if [[ -d $session/sparse/0 ]]; then
  "$skein" export --model "$session/sparse/0" --picture "$session/model.png" || status=1
  say "picture: $session/model.png"
  say "model: $session/sparse/0 (\`skein export\` writes other formats)"
  say "in COLMAP: $(skein_command) export --session ${session@Q} --output ${session@Q}/export --format database && colmap gui --import_path ${session@Q}/sparse/0 --image_path ${session@Q}/images --database_path ${session@Q}/export/database.db"
else
  why=$(jq -r '[.deferred[].cause] + [range(.images.failed) | "failed"] | group_by(.) | map("\(length) \(.[0])") | join(", ")' "$session/report.json")
  say "no model${why:+: $why}; $session/report.json tells of each photo why, and what would help"
fi
say "in a browser: $(skein_command) view ${session@Q}"
if ((keep)); then
  say "the services keep running; Ctrl-C stops them"
  wait "$launch_pid" || true
fi
exit "$status"
