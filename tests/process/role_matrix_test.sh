#!/usr/bin/env bash
# Each role speaks on each channel, through the relays of a session and to a receiver behind a relay without keys. Heard is
# what the table of docs/security.md has, and in another's name what it has no name for. Messages that are repeated, late,
# altered, of other roots, expired or revoked are heard by nobody. All that was refused is counted, and each reason told.
source "$(dirname "$0")/../harness.sh"
enter_network_namespace "$@"
new_workspace
port=$((20000 + 4 * ($$ % 2500)))
url=tcpq://127.0.0.1:$port
open_url=tcpq://127.0.0.1:$((port + 2))
skein=$SKEIN_BUILD/bin/skein

cat >"$workspace/compare.py" <<'PYTHON'
"""compare.py table|names require|warn DOCUMENT TABLE: exits 1 where the two say different things."""
import re, sys
what, auth, document, happened = sys.argv[1:]

def cells(line):
    return [cell.strip() for cell in line.strip().strip('|').split('|')]

def expected():
    """By channel and column, as the document has it."""
    lines = iter(open(document, encoding='utf-8'))
    head = next(cells(line) for line in lines if line.startswith('| channel | ingest |'))
    next(lines)
    for line in lines:
        if not line.startswith('|'): return
        row = dict(zip(head, cells(line)))
        for channel in re.findall(r'`(SKEIN_[^`]+)`', row['channel']) or ['other']:
            for column in head[1:-1]:
                says = row[column] == 'yes' or (row[column] == '`warn`' and auth == 'warn')
                assert row[column] in ('', 'yes', '`warn`'), line
                is_bound = row['in whose name'] != '' and column != 'ingest'
                yield (channel, column), says and not (what == 'names' and is_bound)

def heard():
    with open(happened) as lines:
        head = next(lines).rstrip('\n').split('\t')
        for line in lines:
            if line.startswith('sent '): return
            row = line.rstrip('\n').split('\t')
            for column, cell in zip(head[1:], row[1:]): yield (row[0], column), cell == 'yes'

said, got = dict(expected()), dict(heard())
wrong = [f'{channel}, {column}: the document says {said.get(key)}, heard {got.get(key)}'
         for key in sorted(said.keys() | got.keys()) if said.get(key) != got.get(key)
         for channel, column in [key]]
print(f'{len(got)} of {what}, {auth}: {sum(got.values())} heard, {len(wrong)} not as in the document')
if wrong: sys.exit('\n'.join(wrong))
PYTHON

# The document's channels are those of the code.
names() { grep -oE "$1" "$2" | grep -oE 'SKEIN_[A-Z_]+' | sort -u; }
diff <(names '"SKEIN_[A-Z_]+"' "$SKEIN_ROOT/libs/net/transport/channels.h") \
  <(sed -n '/^| channel | ingest |/,/^$/p' "$SKEIN_ROOT/docs/security.md" | grep -oE '`SKEIN_[A-Z_]+' | grep -oE 'SKEIN_[A-Z_]+' | sort -u) ||
  fail "docs/security.md has other channels than libs/net/transport/channels.h"

# invite_all SESSION URL: sets links
invite_all() {
  local role
  links=()
  for role in worker agent operator viewer; do
    links+=("$("$skein" invite --session "$1" --lcm-url "$2" --role "$role" --name "some-$role" 2>/dev/null)") || fail "skein invite --role $role"
  done
}
links=() num_refused=0
# matrix WHAT WHERE AUTH URL SESSION LOG: adds to num_refused
matrix() {
  "$SKEIN_BUILD/bin/role_matrix" "${@:1:5}" "${links[@]}" >"$workspace/table" 2>>"$6" || { cat "$workspace/table"; fail "role_matrix $*"; }
  [[ $1 == attacks ]] || python3 "$workspace/compare.py" "$1" "$3" "$SKEIN_ROOT/docs/security.md" "$workspace/table" || fail "$1 at the $2, $3"
  [[ $1 != attacks ]] || cat "$workspace/table"
  num_refused=$((num_refused + $(sed -n 's/^sent .* refused //p' "$workspace/table")))
}
# expect_told LOG REASON...
expect_told() {
  local log=$1 reason
  shift
  for reason in 'it came before' 'its signature does not fit' 'its trailer is damaged' 'it is not signed' 'its certificate has expired' \
    "its certificate is not of this session's root key" 'its invitation was revoked' 'its role may not say so' "$@"; do
    grep -qF "$reason" "$log" || fail "${log##*/} does not tell of: $reason"
  done
}

# A receiver behind a relay that has no keys: it forwards everything.
mkdir "$workspace/alone"
setpriv --pdeathsig TERM -- "$SKEIN_BUILD/bin/skein-relay" $((port + 2)) $((port + 3)) >"$workspace/open-relay.log" 2>&1 &
wait_until 30 "the relay without keys listens" grep -q '^ready relay' "$workspace/open-relay.log"
matrix attacks receiver require "$open_url" "$workspace/alone" "$workspace/receiver.log"
invite_all "$workspace/alone" "$open_url"
matrix table receiver require "$open_url" "$workspace/alone" "$workspace/receiver.log"
matrix table receiver warn "$open_url" "$workspace/alone" "$workspace/receiver.log"
matrix names receiver require "$open_url" "$workspace/alone" "$workspace/receiver.log"
expect_told "$workspace/receiver.log" "it speaks in another's name"

# refused SESSION SERVICE: as a viewer's status tells
refused() {
  "$skein" status --once --json --session "$1" --lcm-url "$url" 2>/dev/null |
    jq --arg service "$2" '[.instances[] | select(.service == $service) | .refused] | add // 0'
}
relay_has_refused() { [[ $(refused "$1" relay) == "$2" ]]; }
# processes SESSION: of all services
processes() { tail -n +1 "$1"/run/*.pid; }

# Through the relays of a session, whose services hear what these forward.
for auth in require warn; do
  session=$workspace/$auth
  start_services "$session" "$url" --auth "$auth" --features 1 --matching 1 --mappers 1 --web 0
  before=$(processes "$session")
  invite_all "$session" "$url"
  num_refused=0
  matrix table relay "$auth" "$url" "$session" "$workspace/speaker.log"
  if [[ $auth == require ]]; then
    matrix attacks relay require "$url" "$session" "$workspace/speaker.log"
    expect_told "$session/log/relay-$port.log" 'it is of another session'
  fi
  wait_until 30 "the relays count the $num_refused messages that they refused" relay_has_refused "$session" "$num_refused"
  # Of a revoked invitation a relay and a receiver hear when they like.
  ! grep -hE 'refused a message.*: its? ' "$session"/log/*.log | grep -v 'its invitation was revoked' ||
    fail "a receiver refused for its sender what the relays forwarded"
  [[ $(processes "$session") == "$before" ]] || fail "a service did not bear it"
  echo "$auth: the relays refused $num_refused messages, and counted them"
  stop_services
done
