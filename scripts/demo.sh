#!/usr/bin/env bash
# Reconstructs a synthetic place that three simulated agents photograph, or your own photos. The
# script of a checkout sets up and builds first, from a bare Debian 12.
#
#   scripts/demo.sh                                         the synthetic place
#   scripts/demo.sh --images [NAME=]DIR [--images ...]      your photos, one agent a folder
#
#   --session DIR   session folder (default, anew each time: build/demo/session; installed,
#                   skein/demo/session in $XDG_CACHE_HOME or ~/.cache)
#   --photos N      photos of each simulated agent (default 20)
#   --build DIR     a build that is there (as that of `skein demo` is): nothing is set up or built
#   Everything else is passed on to scripts/reconstruct.sh (--config, --rate, --order, ...).
#
# Exit codes: 0 every photo is accounted for, 1 not or an error, 2 bad usage.
source "$(dirname "$0")/lib.sh"

agents=3 photos=20 session='' own_photos=0 build='' options=()
[[ -z ${SKEIN_SUBCOMMANDS:-}$SKEIN_INSTALLED ]] || build=$SKEIN_BUILD
demo=$SKEIN_ROOT/build/demo
[[ -z $SKEIN_INSTALLED ]] || demo=${XDG_CACHE_HOME:-${HOME:?}/.cache}/skein/demo
while (($#)); do
  case $1 in
    --session | --photos | --images | --build) (($# > 1)) || usage_error "$1 needs a value" ;;&
    -h | --help) print_help; exit 0 ;;
    --session) session=$2; shift ;;
    --photos) photos=$2; shift ;;
    --build) build=$2; shift ;;
    --images) own_photos=1; options+=("$1" "$2"); shift ;;
    *) options+=("$1") ;;
  esac
  shift
done

[[ $photos =~ ^[0-9]+$ ]] && ((10#$photos > 1)) || usage_error "--photos needs a number above 1, not '$photos'"
reconstruct=("$SKEIN_ROOT/scripts/reconstruct.sh" --session "${session:-$demo/session}")
"${reconstruct[@]}" --check "${options[@]}" || exit

if [[ -n $build ]]; then
  SKEIN_BUILD=$build options+=(--build "$build")
else
  "$SKEIN_ROOT/scripts/setup.sh"
  build_skein release reconstruction
fi

[[ -n $session ]] || rm -rf "$demo/session"
if ((!own_photos)); then
  place=$demo/place-$agents-$photos
  say "$agents simulated agents photograph a synthetic place ($photos photos each)"
  render_place "$place" "$agents" "$photos"
  for folder in "$place"/images/*/; do options+=(--images "$folder"); done
  options+=(--ground-truth "$place/truth")
fi
"${reconstruct[@]}" "${options[@]}"
