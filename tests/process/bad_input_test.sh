#!/usr/bin/env bash
# Odd, damaged and hostile files among good photos: the odd are reconstructed, the bad are refused or set
# aside with a reason that the agent, `skein status` and the report tell, and the session goes on; so it
# does when an agent vanishes half-way and when messages come that are of another type.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 2 8 --seed 1
session=$workspace/session
skein=$SKEIN_BUILD/bin/skein
"$SKEIN_BUILD/bin/bad_photos" "$place/images/agent-1" "$workspace/photos" || fail "bad_photos"
printf 'no photo' >"$workspace/photos/bad/"$'invalid-\xff.jpg'
mkdir -p "$workspace/photos/bad/$(printf 'd%.0s' {1..200})"
cp "$workspace/photos/bad/text.jpg" "$workspace/photos/bad/$(printf 'd%.0s' {1..200})/$(printf 'n%.0s' {1..100}).jpg"

# agent_of NAME FOLDER EXPECTED_EXIT_CODE: its output goes to NAME.out
agent_of() {
  local status=0
  "$skein" agent --session "$session" --lcm-url "$url" --name "$1" --images "$2" \
    >"$workspace/$1.out" 2>&1 || status=$?
  ((status == $3)) || { cat "$workspace/$1.out"; fail "agent $1 ended with $status, not $3"; }
}
# expect_reason FILE PHOTO PATTERN: a line of the file names the photo and why
expect_reason() {
  grep -F "$2" "$1" | grep -E "$3" >/dev/null || { cat "$1"; fail "${1##*/} does not say why $2 is not taken ($3)"; }
}

# vanishing_agent_of NAME FOLDER: stopped after the first chunk of a photo, then killed
vanishing_agent_of() {
  LD_PRELOAD=$stop_shim SKEIN_STOP_AT=after SKEIN_STOP_TEXT=SKEIN_BLOB_CHUNK SKEIN_STOP_MARK=$workspace/stopped \
    "$skein" agent --session "$session" --lcm-url "$url" --name "$1" --images "$2" >"$workspace/$1.out" 2>&1 &
  local agent=$!
  wait_until 60 "the agent is half-way" test -s "$workspace/stopped"
  kill -9 "$agent"
  wait "$agent" 2>/dev/null || true
}

start_services "$session" "$url"
publish "$session"
await_agents
if [[ -n $IN_NAMESPACE ]]; then # over tcpq neither shim nor datagrams
  vanishing_agent_of odd "$workspace/photos/odd"
  for channel in SKEIN_IMAGE_OFFER SKEIN_SUBMIT_FEATURES SKEIN_WORK_REQUEST; do # as LCM frames a small message
    printf 'LC02\0\0\0\1%s\0of an older type' "$channel" >/dev/udp/239.255.76.67/7667
  done
fi
agent_of odd "$workspace/photos/odd" 0
agent_of agent-1 "$workspace/photos/twice" 0
agent_of bad "$workspace/photos/bad" 3
finish "$session"
"$skein" status --once --session "$session" --lcm-url "$url" >"$workspace/status.out" || fail "status"
stop_services

declare -A reasons=([truncated.jpg]='truncated|premature|damaged' [corrupt.jpg]='damaged|corrupt' [empty.jpg]='empty|bytes'
  [dot.png]='1 x 1' [text.jpg]='not a|no JPEG' [bomb.jpg]='60000 x 60000' [invalid-]='UTF-8' [dddd]='bytes, more than')
for photo in "${!reasons[@]}"; do
  for told in bad.out status.out; do expect_reason "$workspace/$told" "$photo" "${reasons[$photo]}"; done
done
grep -q ', 1 duplicate, ' "$workspace/bad.out" || { cat "$workspace/bad.out"; fail "the copy is not called a duplicate"; }

[[ -z $IN_NAMESPACE ]] || grep -qE '^ *ingest .*messages of another type or damaged: 3$' "$workspace/status.out" ||
  { cat "$workspace/status.out"; fail "status does not tell of messages that ingest cannot read"; }
grep -qF 'duplicates: 1' "$workspace/status.out" || { cat "$workspace/status.out"; fail "status does not tell of the duplicate"; }

report=$session/report.json
jq -e '[.deferred[] | select(.image == "bad/flat.jpg" and .reason != "")] + [.failures[] | select(.image == "bad/flat.jpg" and .reason != "")]
  | length == 1' "$report" >/dev/null || fail "the photo without texture: $(jq -c '{deferred, failures}' "$report")"
grep -qF flat.jpg "$workspace/status.out" || { cat "$workspace/status.out"; fail "status does not tell of flat.jpg"; }
jq -e '.images | .received == 30 and .registered == 21 and .failed == 8 and .duplicates == 1' "$report" >/dev/null ||
  fail "expected 16 good, 4 odd, one more of a name, one without texture, 8 refused: $(jq -c '{images, deferred, failures}' "$report")"
echo "$(jq -c .images "$report")"

# Nobody runs the session any more: an agent says so, and where it listens, and goes on waiting.
"$skein" agent --session "$session" --name late --images "$place/images/agent-1" >"$workspace/late.out" 2>&1 &
agent=$!
wait_until 30 "the agent says that nobody answers" grep -qF "no answer on $url" "$workspace/late.out"
start_reconstruction "$session" "$url" --features 0 --matching 0 --mappers 0 # its photos are there already
wait "$agent" || { cat "$workspace/late.out"; fail "the agent did not go on"; }
grep -qF 'late: ' "$workspace/late.out" || { cat "$workspace/late.out"; fail "the agent does not tell its photos"; }
stop_services
