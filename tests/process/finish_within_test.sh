#!/usr/bin/env bash
# A finish with a deadline ends in time: with photos in work, with a mapper that is silent, and by a
# second command on a finish that waits. It names what was left out, and the next finish takes it up.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
report=$session/report.json
readonly grace_s=3 slack_s=7

# signal_services SIGNAL INSTANCE_PREFIX
signal_services() {
  local file
  for file in "$session/run/$2"*.pid; do kill "-$1" "$(<"$file")"; done
}

# finish_within SECONDS: ends by then, but for the grace and the writing
finish_within() {
  local start=$SECONDS
  "$SKEIN_BUILD/bin/skein" finish --within "$1" --session "$session" --lcm-url "$url" >"$workspace/finish.log" 2>&1 ||
    { cat "$workspace/finish.log"; fail "finish --within $1 failed"; }
  ((SECONDS - start <= $1 + grace_s + slack_s)) || fail "finish --within $1 took $((SECONDS - start)) s"
  tail -n 1 "$workspace/finish.log"
}

# expect_report JQ_CONDITION
expect_report() {
  jq -e "$1" "$report" >/dev/null || fail "the report does not hold $1: $(jq -c '{images, cut, submaps}' "$report")"
}

# all_registered N: nothing is in work, and so many photos are registered
all_registered() { status_holds "$session" --argjson n "$1" '.images | .in_flight == 0 and .registered == $n'; }

# expect_exportable N: the largest model has so many photos
expect_exportable() {
  local text=$workspace/text-$SECONDS
  "$SKEIN_BUILD/bin/skein" export --model "$session/sparse/0" --output "$text" --format text >/dev/null ||
    fail "the model cannot be exported"
  (($(find "$text" -name images.txt -exec cat {} + | grep -c '\.jpg$') == $1)) || fail "not $1 photos in the model"
}

cat >"$workspace/skein.toml" <<EOF
[ingest]
cut_grace = $grace_s
EOF
start_reconstruction "$session" "$url" --mappers 1 --config "$workspace/skein.toml" --hang-after 0 # what is stopped stays so
publish_part "$session" 1 5
wait_until 120 "the first photos are registered" all_registered 10

# Photos in work: nobody matches the later ones.
signal_services STOP matching
publish_part "$session" 6 8
finish_within 3
grep -q '6 photos not matched in time' "$workspace/finish.log" || fail "not told: $(<"$workspace/finish.log")"
expect_report '.cut | .during == "matching" and (.not_matched | length) == 6'
expect_report '.images | .received == 16 and .registered == 10'
expect_exportable 10

# A finish that waits for them has no deadline until a second command sets one.
"$SKEIN_BUILD/bin/skein" finish --session "$session" --lcm-url "$url" >"$workspace/waiting.log" 2>&1 &
waiting=$!
wait_until 20 "the finish waits" has_facts "$session" finish 6
finish_within 2
wait "$waiting" || fail "the command that waits was not answered"
expect_report '.cut.not_matched | length == 6'

# A mapper that is silent: its newest model is taken.
signal_services STOP mapper
finish_within 2
grep -q 'map [0-9]*: its mapper did not answer' "$workspace/finish.log" || fail "not told: $(<"$workspace/finish.log")"
expect_report '.cut.submaps[0].id == .submaps[0].id'
expect_exportable 10

# Nothing is lost: what was left out is there in the next one.
signal_services CONT mapper
signal_services CONT matching
finish "$session"
stop_services
expect_report 'has("cut") | not'
expect_model "$session" 1
