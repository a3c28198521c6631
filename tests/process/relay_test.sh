#!/usr/bin/env bash
# A session of two hosts over TLS (tcpqs): workers and an agent in a second network namespace join by
# invitations. What crosses the cable shows neither photos' names nor channels. A wrong fingerprint and a
# client without TLS are refused. lcm-logger hears on the port for listening, and is not heard there. What
# nobody signed, the relay forwards to nobody.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
unshare --mount true 2>/dev/null || skip "no mount namespace may be made here"
new_workspace
url=tcpqs://10.77.0.1:7700
watch_url=tcpq://127.0.0.1:7702
use_small_place
session=$workspace/session
skein=$SKEIN_BUILD/bin/skein

add_other_host 30
nsenter --net -t "$other_host" ip link set lo up
there() { nsenter --net -t "$other_host" "$@"; }

# record INTERFACE FILE: all that it carries, from now on
record() {
  setpriv --pdeathsig KILL -- python3 - "$1" "$2" <<'PYTHON' &
import socket, sys
heard = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))  # ETH_P_ALL
heard.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 64 << 20)
heard.bind((sys.argv[1], 0))
with open(sys.argv[2], 'wb', buffering=0) as out:
    out.write(b'begun\n')
    while True: out.write(heard.recv(1 << 17))
PYTHON
  wait_until 60 "$1 is recorded" test -s "$2"
}
record cable "$workspace/cable"
record lo "$workspace/lo"

start_services "$session" "$url" --features 0 --matching 0 --mappers 0 --web 0 --dense off
[[ $(stat -c %a "$session/keys/relay.pem") == 600 ]] || fail "others may read the relay's key"
invite() { "$skein" invite --session "$session" --role "$@" 2>/dev/null || fail "skein invite --role $*"; }
worker=$(invite worker --name other-host)
agent=$(invite agent --name agent-2)
viewer=$(invite viewer)
[[ $worker == skein://10.77.0.1:7700/tcpqs/* ]] || fail "not an invitation to TLS: $worker"

# The port for listening: open on this host, with LCM's own logger; not from the other.
lcm-logger --lcm-url "$watch_url" --quiet "$workspace/lcm.log" >/dev/null 2>&1 &
wait_until 20 "lcm-logger hears" grep -qa SKEIN_HEARTBEAT "$workspace/lcm.log"
! there timeout 5 bash -c 'exec 3<>/dev/tcp/10.77.0.1/7702' 2>/dev/null || fail "the port for listening is open to other hosts"
there timeout 5 bash -c 'exec 3<>/dev/tcp/10.77.0.1/7700' || fail "the cable does not carry"
cp "$workspace/lcm.log" "$workspace/replayed.log"
timeout 20 lcm-logplayer --lcm-url "$watch_url" --speed 10 "$workspace/replayed.log" >/dev/null 2>&1 || fail "lcm-logplayer does not run"
wait_until 10 "what is published on the port for listening is refused" grep -q 'this port is for listening' "$session/log/relay-7700.log"

# Neither a relay of another certificate nor one without TLS is taken, and neither is its client.
flipped=${viewer: -6:1}
[[ $flipped == A ]] && flipped=B || flipped=A
wrong=${viewer:0:-6}$flipped${viewer: -5}
! there timeout 40 "$skein" status --once --invite "$wrong" >"$workspace/said" 2>&1 || fail "a wrong fingerprint was taken"
grep -q 'its certificate has the fingerprint .* ask for a new invitation' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"
! timeout 40 "$skein" status --once --session "$session" --lcm-url tcpq://10.77.0.1:7700 >"$workspace/said" 2>&1 || fail "a client without TLS was heard"
wait_until 10 "the relay tells of it" grep -q 'does not speak TLS' "$session/log/relay-7700.log"
! timeout 40 "$skein" status --once --session "$session" --lcm-url "tcpqs://127.0.0.1:7702" >"$workspace/said" 2>&1 || fail "a relay without TLS was taken"
grep -q 'does not speak TLS' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"
! timeout 10 "$skein" status --once --session-id auto --lcm-url "$url" >"$workspace/said" 2>&1 || fail "tcpqs without a fingerprint"
grep -q 'by what is its relay known' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"

# A hostile peer that speaks TLS, but signs nothing.
session_id=$(jq -r .session_id "$session/session.json")
pin=$(sed -n 's/.*fingerprint of its certificate: //p' "$session/log/relay-7700.log" | head -n 1)
setpriv --pdeathsig TERM -- "$SKEIN_BUILD/bin/forger" "$url?pin=$pin" "$session_id" >>"$workspace/forger.log" 2>&1 &

mkdir -p "$workspace/remote"
nsenter --net -t "$other_host" unshare --mount bash -c \
  'mount -t tmpfs none "$1" && exec "$2/scripts/launch.sh" --join "$3" --session "$4" --build "$5"' - \
  "$session" "$SKEIN_ROOT" "$worker" "$workspace/remote" "$SKEIN_BUILD" &
remote_pid=$!
publish_agent "$session" "$place/images/agent-1/"
nsenter --net -t "$other_host" "$skein" agent --invite "$agent" --images "$place/images/agent-2" >>"$workspace/agents.log" 2>&1 &
agent_pids+=($!)
await_agents

# What the relays refused of the hostile peer, before anything else is refused: ingest hears of a revoked invitation when
# it likes, so it may refuse a message that a relay still forwarded.
refused() { jq --arg service "$1" '[.instances[] | select(.service == $service) | .refused] | add // 0' "$workspace/status.json"; }
refuses_much() {
  "$skein" status --once --json --session "$session" --lcm-url "$url" >"$workspace/status.json" 2>/dev/null && (($(refused relay) > 100))
}
wait_until 60 "the relays have refused a hundred messages of a peer that signs nothing" refuses_much

# An invitation that is taken back: the relay forwards nothing from it, and nothing to it.
lost=$(invite viewer --name lost-phone)
timeout 40 "$skein" status --once --invite "$lost" >/dev/null || fail "an invitation does not work"
"$skein" revoke --session "$session" --name lost-phone >"$workspace/said" || fail "skein revoke"
grep -qx 'revoked: lost-phone' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"
! "$skein" revoke --session "$session" --name lost-fone >"$workspace/said" 2>&1 || fail "a name that nobody was invited by looks revoked"
grep -q 'nobody is known to have been invited as "lost-fone" (invited: .*lost-phone' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"
! "$skein" invite --session "$session" --role viewer --name ingest >"$workspace/said" 2>&1 || fail "somebody is invited as ingest"
grep -q 'is a process of this host: give who is invited another name' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"
is_shut_out() { ! timeout 40 "$skein" status --once --invite "$lost" >"$workspace/said" 2>&1; }
wait_until 60 "a revoked invitation is refused" is_shut_out

finish "$session"
kill -TERM "$remote_pid"
wait "$remote_pid" || true
stop_services
expect_model "$session" 1

(($(refused ingest) == 0)) || fail "the relay forwarded what nobody signed: ingest refused $(refused ingest)"
photo=$(ls "$place/images/agent-2" | head -n 1)
grep -qa "$photo" "$session/ledger.db" || fail "no photo is called $photo"
(($(stat -c %s "$workspace/cable") > 1000000)) || fail "the cable was not recorded"
for text in "$photo" SKEIN_ skein; do
  ! grep -qaF -- "$text" "$workspace/cable" || fail "\"$text\" went over the cable in the clear"
done
grep -qaF SKEIN_HEARTBEAT "$workspace/lo" || fail "the recorder misses what is in the clear on the port for listening"
echo "recorded $(stat -c %s "$workspace/cable") bytes on the cable; the relays refused $(refused relay) messages"
