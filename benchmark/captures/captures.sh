#!/usr/bin/env bash
# Captures of every kind, made from sets of real photos: what Skein makes of each, beside COLMAP's mapper on
# the same verified matches. README.md lists the kinds and says what the columns mean.
#
#   benchmark/captures/captures.sh --out DIR [options]
#
#   --out DIR        captures, sessions and results; what is there is not done again
#   --sets "LIST"    default: all of --datasets. Besides: video blank crowd (hard places of `skein sim`), and PATH
#                    of a folder with images/ and, if there is a truth, truth (what `skein evaluate` takes)
#   --kinds "LIST"   default: all. Besides: shuffle-SEED
#   --datasets DIR   default: ../shared/datasets beside the tree; a set that is absent is left out
#   --no-colmap      without COLMAP's mapper
#   --config FILE    options of the services (what launch.sh takes), for comparison; give another --out, too
#   --jobs N         sessions at once (default 1)
#
# Prints a row as it is done, then a line of totals; the same is in OUT/table.tsv.
# Exit codes: 0 every session ended and no process crashed, 1 not, 2 bad usage.
source "$(dirname "$0")/../../scripts/lib.sh"
source "$(dirname "$0")/sets.sh"

sets=$all_sets kinds=$all_kinds out='' datasets=$SKEIN_ROOT/../shared/datasets config='' with_colmap=1 jobs=1
while (($#)); do
  case $1 in
    --no-colmap) with_colmap=0; shift; continue ;;
    -h | --help) print_help; exit 0 ;;
  esac
  case $1 in
    --sets | --kinds | --out | --datasets | --config | --jobs) [[ -n ${2:-} ]] || usage_error "$1 needs a value" ;;&
    --sets) sets=$2 ;;
    --kinds) kinds=$2 ;;
    --out) out=$2 ;;
    --datasets) datasets=$2 ;;
    --config) [[ -r $2 ]] || usage_error "--config: cannot read '$2'"; config=$(realpath "$2") ;;
    --jobs) [[ $2 =~ ^[1-9][0-9]*$ ]] || usage_error "--jobs needs a number, not '$2'"; jobs=$2 ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift 2
done
[[ -n $out ]] || usage_error "--out is needed"
for name in $sets; do is_set "$name" || usage_error "no set $name (there are: $all_sets video blank crowd)"; done
for name in $kinds; do is_kind "$name" || usage_error "no kind $name (there are: $all_kinds)"; done
for tool in skein make_capture; do [[ -x $SKEIN_BUILD/bin/$tool ]] || die "no $SKEIN_BUILD/bin/$tool: build first"; done
((!with_colmap)) || command -v colmap >/dev/null || die "no colmap: scripts/setup.sh --tests installs it, or give --no-colmap"
mkdir -p "$out"
out=$(realpath "$out")

places=$out/places
present=() rows=()
for name in $sets; do
  ! is_rendered "$name" || render "$name" >&2
  if [[ -d $(folder_of "$name") ]]; then present+=("$name"); else echo "no $(folder_of "$name"): left out"; fi
done
for name in "${present[@]}"; do
  for kind in $kinds; do rows+=("$name" "$kind"); done
done
((${#rows[@]})) || { echo "no capture can be made"; exit 0; }

# table FORMAT: of what is done, in the order of the rows; FORMAT: a function of table.jq
table() {
  local i file done=()
  for ((i = 0; i < ${#rows[@]}; i += 2)); do
    file=$out/rows/$(basename "${rows[i]}").${rows[i + 1]}.json
    [[ ! -e $file ]] || done+=("$file")
  done
  cat "${done[@]}" </dev/null | jq -rs -L "$SKEIN_ROOT/benchmark/captures" "include \"table\"; $1"
}

echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1)"
jq -nr -L "$SKEIN_ROOT/benchmark/captures" 'include "table"; markdown_head'
export CAPTURES_OUT=$out CAPTURES_DATASETS=$(realpath -m "$datasets") CAPTURES_CONFIG=$config CAPTURES_COLMAP=$with_colmap SKEIN_BUILD
running=() status=0
trap 'kill "${running[@]}" 2>/dev/null || true; wait; exit 130' INT TERM
# await_fewer N: until less than N rows are in work
await_fewer() {
  local pid still
  while :; do
    still=()
    for pid in "${running[@]}"; do
      if kill -0 "$pid" 2>/dev/null; then still+=("$pid"); else wait "$pid" || status=1; fi
    done
    running=("${still[@]}")
    ((${#running[@]} >= $1)) || return 0
    sleep 0.5
  done
}
for ((i = 0; i < ${#rows[@]}; i += 2)); do
  await_fewer "$jobs"
  "$SKEIN_ROOT/benchmark/captures/row.sh" "${rows[i]}" "${rows[i + 1]}" </dev/null &
  running+=($!)
done
await_fewer 1
table tsv >"$out/table.tsv"
table totals | tee -a "$out/table.tsv"
[[ $(table has_failed) == false ]] || status=1
exit "$status"
