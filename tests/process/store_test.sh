#!/usr/bin/env bash
# The session folder as a store: a disk that is full for a while, a copy beside a live session, a clone that
# goes on by itself, a damaged session that is repaired and finished.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
skein=$SKEIN_BUILD/bin/skein
session=$workspace/session

refuses() {
  local want=$1
  shift
  ! "$@" >"$workspace/out" 2>&1 || fail "not refused: $*"
  grep -F "$want" "$workspace/out" >/dev/null || fail "$*: $(tail -n 3 "$workspace/out")"
}

echo "a disk that is almost full: photos wait, and come in once there is room"
cat >"$workspace/full.toml" <<<$'[ingest]\nmin-free = 1000000000000000'
start_reconstruction "$session" "$url" --config "$workspace/full.toml"
publish "$session"
# tells WHAT: as what a person has to mend
tells() { status_holds "$session" --arg what "$1" 'any(.troubles[]; (.what | contains($what)) and .remedy != "")'; }
wait_until 30 "status tells it" tells 'the disk is almost full'
wait_until 30 "the agents tell it" grep -q "skein agent: On .*: the disk is almost full.* on the disk that holds $session\. .* nothing that was sent is lost" "$workspace/agents.log"
[[ $(count_facts "$session" image) == 0 ]] || fail "a photo was taken in without room"
stop_services
start_services "$session" "$url" --mappers 1
await_agents
wait_until 30 "nothing is to be mended" status_holds "$session" '.troubles == []'

echo "a copy beside the live session ends nothing of it, and does not run"
cp -a "$session" "$workspace/copy"
before=$(cat "$session"/run/*.pid)
refuses "is a copy of the session in" timeout 60 "$SKEIN_ROOT/scripts/launch.sh" --session "$workspace/copy" --lcm-url "$url" --build "$SKEIN_BUILD"
kill -0 $before || fail "the copy ended processes of the original"

finish "$session"
stop_services
expect_model "$session" 1
"$skein" check "$session" || fail "a finished session is not whole"

echo "a clone is a session of its own"
"$skein" clone "$session" "$workspace/clone"
[[ $(jq -r .session_id "$session/session.json") != $(jq -r .session_id "$workspace/clone/session.json") ]] || fail "one id"
start_reconstruction "$workspace/clone" "$url"
finish "$workspace/clone"
stop_services
expect_model "$workspace/clone" 1

echo "damage is told, and a repaired session ends as before"
mv "$session" "$workspace/moved" # a moved folder goes on
session=$workspace/moved
# Four bytes of the fact in the ledger's middle, the id, a model and a photo's two names.
sqlite3 "$session/ledger.db" "UPDATE facts SET payload = CAST(substr(payload, 1, 20) || X'deadbeef' || substr(payload, 25) AS BLOB)
  WHERE seq = (SELECT MAX(seq) / 2 FROM facts)"
echo >"$session/session.json"
truncate -s 100 "$session/sparse/0/points3D.bin"
photo=$(find "$session/images" -type f | sort | head -n 1)
printf '\x55\x55\x55\x55' | dd of="$photo" bs=1 seek=3000 conv=notrunc status=none
refuses "findings" "$skein" check "$session"
for what in ledger.db session.json sparse/0/points3D.bin "${photo#"$session/"}"; do
  grep -F "$what" "$workspace/out" >/dev/null || fail "check does not name $what: $(<"$workspace/out")"
done
"$skein" repair "$session" | tee "$workspace/repair.out"
grep -F "send it again" "$workspace/repair.out" >/dev/null || fail "the lost photo is not told"
start_reconstruction "$session" "$url"
publish "$session"
await_agents
finish "$session"
stop_services
expect_model "$session" 1
"$skein" check "$session" || fail "a repaired session is not whole"
