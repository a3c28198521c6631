#!/usr/bin/env bash
# The example programs of clients/examples, built as their heads say, each offer a photo by an
# invitation to a session that takes nothing unsigned.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
start_reconstruction "$session" "$url" --auth require --features 0 --matching 0 --mappers 0
photos=("$place"/images/agent-1/*)

# offer NAME PHOTO PROGRAM...: the program offers the photo, and ingest has it under that name
offer() {
  local name=$1 photo=$2 link
  shift 2
  link=$("$SKEIN_BUILD/bin/skein" invite --session "$session" --role agent --name "$name" 2>/dev/null) || fail "skein invite"
  timeout 60 "$@" "$link" "$photo" || fail "$1 did not place $photo"
  cmp "$photo" "$session/images/$name/$(basename "$photo")" || fail "$name's photo is another in the session"
}

g++ -std=c++17 -Wall -Wextra -Werror "-I$SKEIN_BUILD/generated/cpp" -o "$workspace/offer_photo" \
  "$SKEIN_ROOT/clients/examples/offer_photo.cc" -llcm -lsodium || fail "offer_photo.cc does not compile"
offer phone "${photos[0]}" "$workspace/offer_photo"
encrypted=$("$SKEIN_BUILD/bin/skein" invite --session "$session" --role agent 2>/dev/null | sed -E 's|/(udpm-[0-9]+\|tcpq)/|/tcpqs/|')
! timeout 10 "$workspace/offer_photo" "$encrypted" "${photos[0]}" >"$workspace/said" 2>&1 || fail "LCM's library took an encrypted session"
grep -q "LCM's library has no TLS" "$workspace/said" || fail "unclear: $(cat "$workspace/said")"

python=/usr/bin/python3 # Debian's, which has Debian's packages

# Somebody who hears the network: what is no message at all, on a channel that the agents hear.
if [[ $url =~ ^udpm://([0-9.]+):([0-9]+) ]]; then
  "$python" - "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" <<'PY' &
import os, socket, sys, time
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
test = os.getppid()
while os.getppid() == test:
    for agent in b'GLUE', b'ROBOT_2':
        out.sendto(b'LC02\0\0\0\1SKEIN_BLOB_REQUEST_AGENT_' + agent + b'\0no message', (sys.argv[1], int(sys.argv[2])))
    time.sleep(0.02)
PY
fi
if "$python" -c 'import nacl.signing' 2>/dev/null; then
  lcm-gen -p --ppath "$workspace/types" "$SKEIN_ROOT"/lcmtypes/*.lcm || fail "lcm-gen -p"
  export PYTHONPATH=$workspace/types PYTHONDONTWRITEBYTECODE=1
  offer_python() { offer "$1" "$2" "$python" "$SKEIN_ROOT/clients/examples/offer_photo.py"; }
  offer_python glue "${photos[2]}"
  ! timeout 10 "$python" "$SKEIN_ROOT/clients/examples/offer_photo.py" "$encrypted" "${photos[0]}" >"$workspace/said" 2>&1 ||
    fail "the Python agent took an encrypted session"
  grep -qx 'offer_photo.py: this program has no TLS: join the session with `skein agent`' "$workspace/said" || fail "unclear: $(<"$workspace/said")"
else
  echo "SKIPPED: no PyNaCl (scripts/setup.sh --tests installs python3-nacl): offer_photo.py is not tested"
fi

! timeout 10 "$SKEIN_BUILD/bin/skein" agent --session-id "$(jq -r .session_id "$session/session.json")" --lcm-url "$url" \
  --name nobody --images "$place/images/agent-2" >"$workspace/unsigned.log" 2>&1 || fail "an unsigned photo was taken"

if command -v javac >/dev/null; then
  offer robot-2 "${photos[1]}" java -Djava.net.preferIPv4Stack=true -cp "$(lcm_jar):$SKEIN_BUILD/skein_lcmtypes.jar" \
    "$SKEIN_ROOT/clients/examples/OfferPhoto.java"
else
  echo "SKIPPED: no Java compiler: OfferPhoto.java is not tested"
fi

# The Python agent speaks LCM itself: also with the relay.
if declare -F offer_python >/dev/null; then
  stop_services
  start_reconstruction "$session" tcpq://127.0.0.1:7790 --auth require --features 0 --matching 0 --mappers 0
  offer_python relayed "${photos[3]}"
fi
