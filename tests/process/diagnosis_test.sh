#!/usr/bin/env bash
# Thirty photos spoiled on purpose are sent with good ones: the report tells of nearly each why it is in no
# map, and what to do; ingest tells its agent while it sends.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
readonly size=800x600
use_place 2 9 --seed 1 --size "$size" # 18 to spoil
session=$workspace/session
good=$place/images

# Photos of other places, one of each.
mkdir -p "$workspace/other"
for seed in 11 12 13 14 15 16; do
  "$SKEIN_BUILD/bin/skein" sim --output "$workspace/elsewhere" --scenario disjoint --agents 1 --photos 2 --size "$size" --seed "$seed" \
    >/dev/null 2>&1 || fail "skein sim"
  cp "$(find "$workspace/elsewhere/images" -name '*.jpg' | sort | head -n 1)" "$workspace/other/$seed.jpg"
  rm -r "$workspace/elsewhere"
done
"$SKEIN_BUILD/bin/spoil_photos" "$good" "$workspace/other" "$workspace/spoiled" || fail "spoil_photos"
[[ $(ls "$workspace/spoiled" | wc -l) == 30 ]] || fail "not thirty spoiled photos"

start_reconstruction "$session" "$url"
publish "$session"
await_agents
# It goes on until it has heard of its photos.
"$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name carol --images "$workspace/spoiled" --watch \
  >"$workspace/carol.log" 2>&1 &
carol=$!
heard_of() { (($(grep -c 'is not in the map: ' "$workspace/carol.log") >= $1)); }
wait_until 200 "the agent hears of its spoiled photos" heard_of 25
kill -INT "$carol"
wait "$carol" || true
finish "$session"

report=$session/report.json
declare -A expected=([blur]=blurred [motion]=blurred [dark]='too dark' [cap]='too dark' [thumb]='few details'
  [other]='no overlap' [turn]='rotation only')
right=0
for file in "$workspace"/spoiled/*; do
  photo=carol/$(basename "$file")
  cause=$(jq -r --arg photo "$photo" '[.deferred[] | select(.image == $photo) | .cause][0] // "placed"' "$report")
  remedy=$(jq -r --arg photo "$photo" '[.deferred[] | select(.image == $photo) | "\(.reason); \(.remedy)"][0] // ""' "$report")
  kind=$(basename "${file%-*}")
  [[ $cause == "${expected[$kind]}" ]] && right=$((right + 1))
  printf '%-18s %-14s %s\n' "$(basename "$file")" "$cause" "$remedy"
done
echo "$right of 30 causes are right"
((right >= 27)) || fail "$right of 30 causes are right"
[[ $(jq '[.deferred[] | select(.image | startswith("carol/") | not)] | length' "$report") == 0 ]] ||
  fail "good photos are in no map: $(jq -c .deferred "$report")"
