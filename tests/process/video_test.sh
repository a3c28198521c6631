#!/usr/bin/env bash
# An agent that takes its photos from a video: sharp frames with enough motion become a map. One that is
# killed on the way takes the same frames when it is started again, and each is in the session once.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 1 60 --seed 1 --size 640x480
session=$workspace/session
frames=$workspace/frames

film=("$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name drone
  --video "$place/images/agent-1/%04d.jpg" --images "$frames" --focal 550)
has_frames() { (($(find "$frames" -name '*.jpg' 2>/dev/null | wc -l) >= $1)); }

"$SKEIN_BUILD/bin/skein" agent --session "$workspace" --lcm-url "$url" --name drone --video /nowhere.mp4 \
  --images "$frames" >"$workspace/absent.log" 2>&1 && fail "a video that is absent was taken"

start_reconstruction "$session" "$url"
"${film[@]}" --rate 2 >"$workspace/killed.log" 2>&1 &
agent=$!
wait_until 60 "the agent has taken five frames" has_frames 5
wait_until 60 "a photo is stored" has_facts "$session" image 1
kill -KILL "$agent"
wait "$agent" 2>/dev/null || true

"${film[@]}" --rate 10 >"$workspace/agent.log" 2>&1 || { cat "$workspace/agent.log"; fail "the agent failed"; }
cat "$workspace/agent.log"
taken=$(find "$frames" -name '*.jpg' | wc -l)
((taken >= 8 && taken < 60)) || fail "$taken of 60 frames were taken"
finish "$session"
report=$session/report.json
jq -e --argjson n "$taken" '.images.received == $n and .images.registered >= 0.9 * $n and (.submaps | length) == 1' \
  "$report" >/dev/null || fail "not one map of $taken frames: $(jq -c '{images, submaps: (.submaps | length)}' "$report")"
say "$taken of 60 frames were taken, $(jq .images.registered "$report") are registered"
