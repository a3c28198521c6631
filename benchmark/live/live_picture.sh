#!/usr/bin/env bash
# Films the live view while the photos of a set are reconstructed, or while robots capture a place
# that they don't know and go where they are advised to.
#
#   benchmark/live/live_picture.sh --output FILE.webp [--set NAME] [--shown points|surface|mesh] [--period S] [--rate HZ] [--datasets DIR] [--robots N]
#
#   --output FILE.webp  the animated picture; the last frame stands for three seconds
#   --set NAME          whose photos one agent sends; south-building's are sent by the two who walked (default)
#   --shown WHAT        points (default), surface or mesh
#   --period S          between frames, which are shown ten a second (default 2.5)
#   --rate HZ           photos a second of each agent (default 0.5)
#   --datasets DIR      default: ../shared/datasets beside the tree
#   --robots N          instead, N robots (skein sim --follow-advice) until they are told that the place is
#                       complete, or have 40 photos each
#
# Needs Chromium, the page, and img2webp of Debian's package webp.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"
source "$(dirname "$0")/../../tests/page.sh"

datasets=$SKEIN_ROOT/../shared/datasets output='' set=south-building shown=points period=2.5 rate=0.5 robots=0
take_options "datasets output set shown period rate robots" "$@"
[[ " points surface mesh " == *" $shown "* ]] || usage_error "--shown $shown: points, surface or mesh"
[[ -n $output ]] || usage_error "--output is needed"
output=$(realpath -m "$output")
command -v img2webp >/dev/null || die "no img2webp: apt install webp"
enter_network_namespace "$@"
require_page
new_workspace
url=$(test_lcm_url)
place=$workspace/place
if ((robots > 0)); then
  : # they make their photos
elif [[ -e $datasets/$set/agents.txt ]]; then
  while read -r name walk; do
    mkdir -p "$place/images/walk-$walk"
    ln -s "$(realpath "$datasets/$set/images/$name")" "$place/images/walk-$walk/"
  done <"$datasets/$set/agents.txt"
  num_photos=$(wc -l <"$datasets/$set/agents.txt")
else
  use_photos agent "$datasets/$set/images" "$datasets/$set/images"
fi

session=$workspace/session frames=$workspace/frames
mkdir "$frames"
start_services "$session" "$url" --web 8470 >/dev/null
mkfifo "$workspace/film"
node "$SKEIN_ROOT/tests/page/film.mjs" http://127.0.0.1:8470/ "$frames" "$period" "$shown" <"$workspace/film" &
film=$!
exec {roll}>"$workspace/film"
if ((robots > 0)); then
  "$SKEIN_BUILD/bin/skein" sim --agents "$robots" --seed 3 --size 800x600 --output "$place" --session "$session" --lcm-url "$url" \
    --follow-advice --max-photos 40 >&2
else
  publish "$session" --rate "$rate"
  await_agents
fi
finish "$session"
exec {roll}>&-
wait "$film"
stop_services
mapfile -t pictures < <(find "$frames" -name '*.png' | sort)
img2webp -loop 0 -min_size -lossy -q 55 -m 6 -d 100 "${pictures[@]:0:${#pictures[@]}-1}" -d 3000 "${pictures[-1]}" -o "$output" >/dev/null
say "$output: ${#pictures[@]} frames, $(stat -c %s "$output") bytes"
