#!/usr/bin/env bash
# While a place is photographed each agent hears what to photograph next, from a photo that exists, and no two
# the same. skein-guide dies in between and goes on. Who may not advise is not heard.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 2 8 --seed 1
session=$workspace/session
skein=$SKEIN_BUILD/bin/skein

start_services "$session" "$url" --mappers 1 --web 0 --dense off
start_listening() {
  "$skein" advise --session "$session" --lcm-url "$url" --json >"$workspace/heard" 2>"$workspace/advise.log" &
  listener=$!
}
# What was heard last, as far as its line is whole; null where nothing was, as jq is content with no input.
last_heard() { (echo null; sed -n '/}$/p' "$workspace/heard") | tail -n 1; }
# The last word that had photos to take for both agents.
both_advised() {
  (echo null; sed -n '/}$/p' "$workspace/heard") |
    jq -c 'select([.advice[]? | select(.stations | length > 0) | .agent] == ["agent-1", "agent-2"])' | tail -n 1
}
both_are_advised() { [[ -n $(both_advised) ]]; }
# It tells of all photos, and has a word for both agents.
tells_of() { last_heard | jq -e --argjson n "$1" '([.submaps[]?.photos] | add) == $n and [.advice[].agent] == ["agent-1", "agent-2"]' >/dev/null; }

start_listening
publish_part "$session" 1 5 # of both agents
wait_until 120 "both agents are advised" both_are_advised
wait_until 120 "it is told of all photos" tells_of 10
advice=$(both_advised)
echo "$advice" | jq -r '.submaps[], .advice[] | .sentence // "\(.agent): \([.stations[].sentence] | join("\n         "))"'

# Each begins at a photo that is there.
num_checked=0
while IFS=$'\t' read -r nearest sentence; do
  name=$(sed -nE 's/.*where ([^ ]+) was taken.*/\1/p' <<<"$sentence" | tr -d ,)
  [[ -s $place/images/$name ]] || fail "no such photo, '$name': $sentence"
  [[ $(sqlite3 "file:$session/ledger.db?mode=ro" ".timeout 5000" "SELECT COUNT(*) FROM facts WHERE kind = 'image' AND fact_id LIKE 'image/%'" 2>/dev/null) -ge $nearest ]] ||
    fail "photo $nearest is not in the ledger: $sentence"
  num_checked=$((num_checked + 1))
done < <(jq -r '.advice[].stations[] | [.nearest, .sentence] | @tsv' <<<"$advice")
((num_checked >= 2)) || fail "$num_checked photos to take"
jq -e '[.advice[].stations[].pose | .[4:7]] | length == (unique | length)' <<<"$advice" >/dev/null || fail "two photos to take from one spot: $advice"
jq -e '.submaps | all(.surfels > 0 and .good_share >= 0 and .good_share <= 1 and .sentence != "")' <<<"$advice" >/dev/null || fail "no guidance: $advice"

# Another listener, of one agent, hears the same.
agrees() {
  "$skein" advise --session "$session" --lcm-url "$url" --agent agent-1 --once --json >"$workspace/once" 2>&1 || return 1
  [[ -s $workspace/once ]] && jq -en --argjson all "$(last_heard)" --slurpfile once "$workspace/once" \
    '$once[0].advice == [$all.advice[] | select(.agent == "agent-1")] and ($once[0].advice | length) == 1' >/dev/null
}
wait_until 60 "what is said once is what is said all the time" agrees
wait_until 60 "skein status tells how good the surface is" status_holds "$session" '.submaps[0].guidance.sentence // "" | . != ""'
kill -INT "$listener"
wait "$listener" || true


# Peers without a credential and with a viewer's advise nobody who checks; who checks nothing hears them.
forge() {
  setpriv --pdeathsig TERM -- "$SKEIN_BUILD/bin/forger" "$url" "$(jq -r .session_id "$session/session.json")" "$@" >>"$workspace/forger.log" 2>&1 &
}
forge
forge "$("$skein" invite --session "$session" --role viewer --name mallory 2>/dev/null)"
hears_forged() { "$skein" advise --once --agent agent-1 --lcm-url "$url" "$@" 2>/dev/null | grep forged >/dev/null; }
wait_until 60 "who checks nothing is misled" hears_forged --auth off --session-id "$(jq -r .session_id "$session/session.json")"
start_listening
kill_service "$session" guide
publish "$session"
await_agents
wait_until 120 "the new guide tells of all photos" tells_of "$num_photos"
! grep forged "$workspace/heard" >/dev/null || fail "a forged advice was heard"
hears_forged --session "$session" && fail "a forged advice was heard"
kill %% %- 2>/dev/null || true
kill -INT "$listener"
wait "$listener" || true

finish "$session"
stop_services
jq -e --argjson photos "$num_photos" '.submaps | length == 1 and all(.completeness | .photos == $photos and .surfels > 0 and .good_share <= 1 and .sentence != "")' \
  "$session/report.json" >/dev/null || fail "report.json: $(jq -c '[.submaps[].completeness]' "$session/report.json")"
expect_model "$session" 1
