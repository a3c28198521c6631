#!/usr/bin/env bash
# Hostile peers forge and replay messages of ingest and of workers: one without a credential, one with a viewer's, one with
# an agent's. The session still ends with its model, and the ledger holds no forged fact. Only an operator's invitation can
# finish the session. With --auth off the same peer ruins a session.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
skein=$SKEIN_BUILD/bin/skein
# forge SESSION [LINK]
forge() {
  setpriv --pdeathsig TERM -- "$SKEIN_BUILD/bin/forger" "$url" "$(jq -r .session_id "$1/session.json")" "${@:2}" >>"$workspace/forger.log" 2>&1 &
}

start_reconstruction "$workspace/open" "$url" --auth off --features 1 --matching 0 --mappers 0
forge "$workspace/open"
wait_until 30 "the hostile peer listens" grep -q 'ready forger' "$workspace/forger.log"
! timeout 30 "$skein" agent --session "$workspace/open" --lcm-url "$url" --auth off --name alice \
  --images "$place/images/agent-1" >"$workspace/said" 2>&1 || fail "the hostile peer does no harm where nothing is signed"
grep -q 'refused .*: forged' "$workspace/said" || fail "unclear: $(cat "$workspace/said")"
kill %%
stop_services

start_services "$session" "$url"

# invite ROLE [option...]: the link
invite() { "$skein" invite --session "$session" --role "$@" 2>/dev/null || fail "skein invite --role $*"; }
# expect_refused WHAT PATTERN COMMAND...: it fails and says why
expect_refused() {
  local what=$1 pattern=$2
  shift 2
  ! timeout 30 "$@" >"$workspace/said" 2>&1 || fail "$what was not refused"
  grep -qE "$pattern" "$workspace/said" || fail "$what: unclear: $(cat "$workspace/said")"
}

session_id=$(jq -r .session_id "$session/session.json")
viewer=$(invite viewer --name mallory)
agent=$(invite agent --name mallory)
operator=$(invite operator --name chief)
forge "$session"
forge "$session" "$viewer"
forge "$session" "$agent"

[[ $(stat -c %a "$session/keys" "$session/keys/root.key" | tr '\n' ' ') == '700 600 ' ]] || fail "others may read the keys"
expect_refused "a viewer's invitation for a finish" 'is for the role viewer, this takes one for operator' \
  "$skein" finish --invite "$viewer"
expect_refused "an agent's name of one's own" 'invitation is for --name mallory' \
  "$skein" agent --invite "$agent" --name alice --images "$place/images/agent-1"
expect_refused "a damaged invitation" 'invitation .* give it whole' "$skein" status --once --invite "${viewer%??}"
expect_refused "a finish without a credential" 'not finished yet' \
  "$skein" finish --session-id "$session_id" --lcm-url "$url" --timeout 3
expired=$(invite operator --name late --expires 1s)
sleep 1.1
expect_refused "an invitation that has expired" 'has expired; ask for another' "$skein" finish --timeout 3 --invite "$expired"

publish "$session"
await_agents
count_refused() {
  "$skein" status --once --json --invite "$viewer" 2>/dev/null | jq '[.instances[] | select(.service == "ingest") | .refused] | add // 0'
}
refuses_much() { refused=$(count_refused) && ((refused > 100)); }
wait_until 60 "ingest has refused a hundred messages, as a viewer's status tells" refuses_much
"$skein" finish --invite "$operator" >"$workspace/finish.log" 2>&1 || { cat "$workspace/finish.log"; fail "an operator's finish"; }
expect_model "$session" 1
(($(count_facts "$session" failure) == 0)) || fail "there are failures: $(jq -c .failures "$session/report.json")"
[[ $(sqlite3 "$session/ledger.db" "SELECT COUNT(*) FROM facts WHERE kind = 'finish' AND fact_id LIKE 'finish/requested/%'") == 1 ]] ||
  fail "a finish that nobody asked for"
echo "ingest refused $refused messages"
