#!/usr/bin/env bash
# Robots capture an unknown place by advice alone (`skein sim --follow-advice`), from their first photos until the place is told
# complete or nothing more is advised. Measures the number of photos and the completeness told meanwhile.
#
#   benchmark/guidance/follow_advice.sh [--agents N] [--scenario NAME] [--seed N] [--size WxH] [--photos N] [--walks N] [--keep DIR]
#
#   --agents N        robots (default 1)
#   --scenario NAME   of skein sim (default together)
#   --seed N          of the place (default 3)
#   --size WxH        of the photos (default 800x600)
#   --photos N        that each takes at most (default 150)
#   --walks N         photos of each of the scenario's three walks, that are added afterwards (default 20; 0: none)
#   --keep DIR        keeps the session and the place's truth there
#
# Tells the robots' reasons to end, and for every tenth photo in the map what guide.log tells. Then photos in the map, and
# the report's verdict. With walks, last: of the surface that the dense points of all photos cover, what those of the
# robots' photos cover, what was told of it as good, and what of that falsely (guidance_policy). Needs a network
# namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

agents=1 scenario=together seed=3 size=800x600 photos=150 walks=20 keep=''
take_options "agents scenario seed size photos walks keep" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
session=${keep:-$workspace}/session place=${keep:-$workspace}/place
mkdir -p "$(dirname "$session")"
rm -rf "$session" "$place"

print_machine
start_services "$session" "$url" --verbose >/dev/null
"$SKEIN_BUILD/bin/skein" sim --scenario "$scenario" --agents "$agents" --seed "$seed" --size "$size" --output "$place" --session "$session" \
  --lcm-url "$url" --follow-advice --max-photos "$photos"
finish "$session" >/dev/null
stop_services
echo "| photos in the map | told |"
echo "|---|---|"
sed -n 's/^.*submap [0-9]*: \([0-9]*\) photos, \(.*\); [0-9.]* s of CPU$/\1 \2/p' "$session/log/guide.log" |
  awk '{ photos = $1; $1 = "" } photos % 10 == 0 { told[photos] = $0 } END { for (n = 10; n <= 10000; n += 10) if (n in told) print "| " n " |" told[n] " |" }'
jq -r '"\(.images.registered) of \(.images.received) photos registered, \(.submaps | length) map(s), \(.wall_s | round) s",
  (.submaps[] | .completeness.sentence)' "$session/report.json"
((walks > 0)) || exit 0

use_place 3 "$walks" --scenario "$scenario" --seed "$seed" --size "$size"
for folder in "$place"/images/*/; do
  mkdir -p "$workspace/walks/images"
  ln -s "$folder" "$workspace/walks/images/walk-$(basename "$folder")"
done
place=$workspace/walks
start_services "$session" "$url" >/dev/null
publish "$session"
await_agents
finish "$session" >/dev/null
stop_services
"$SKEIN_BUILD/bin/skein" export --session "$session" --output "$workspace/all" >/dev/null
num_robots=$(find "$session/images" -path '*/agent-*' -type f | wc -l)
"$SKEIN_BUILD/bin/guidance_policy" --model "$workspace/all/0" --images "$session/images" --name "$scenario-$seed" --policies order \
  --max-photos "$num_robots" --every "$num_robots" |
  jq -r '"\(.end.photos) photos by robots of \(.pool): \(.end.covered) covered, \(.end.told_good) told as good, \(.end.told_good_falsely) of it falsely; first complete: \(.complete)"'
