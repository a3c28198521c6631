#!/usr/bin/env bash
# Films the live view while south-building's two walks are reconstructed, or while robots capture a
# place that they don't know and go where they are advised to.
#
#   benchmark/live/live_picture.sh --output FILE.webp [--period S] [--rate HZ] [--datasets DIR] [--robots N]
#
#   --output FILE.webp  the animated picture; the last frame stands for three seconds
#   --period S          between frames, which are shown ten a second (default 2.5)
#   --rate HZ           photos a second of each walk (default 0.5)
#   --datasets DIR      default: ../shared/datasets beside the tree
#   --robots N          instead, N robots (skein sim --follow-advice) until they are told that the place is
#                       complete, or have 40 photos each
#
# Needs Chromium, the page, and img2webp of Debian's package webp.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"
source "$(dirname "$0")/../../tests/page.sh"

datasets=$SKEIN_ROOT/../shared/datasets output='' period=2.5 rate=0.5 robots=0
take_options "datasets output period rate robots" "$@"
[[ -n $output ]] || usage_error "--output is needed"
output=$(realpath -m "$output")
command -v img2webp >/dev/null || die "no img2webp: apt install webp"
enter_network_namespace "$@"
require_page
new_workspace
url=$(test_lcm_url)
place=$workspace/place num_photos=128
((robots > 0)) || while read -r name walk; do
  mkdir -p "$place/images/walk-$walk"
  ln -s "$(realpath "$datasets/south-building/images/$name")" "$place/images/walk-$walk/"
done <"$datasets/south-building/agents.txt"

session=$workspace/session frames=$workspace/frames
mkdir "$frames"
start_services "$session" "$url" --web 8470 >/dev/null
mkfifo "$workspace/film"
node "$SKEIN_ROOT/tests/page/film.mjs" http://127.0.0.1:8470/ "$frames" "$period" <"$workspace/film" &
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
