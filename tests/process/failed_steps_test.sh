#!/usr/bin/env bash
# A mapper whose jobs fail: whatever throws or crashes is left out after the third time, the session goes on, and
# its finish ends with every photo accounted for.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 2 8 --scenario disjoint --seed 2 --size 800x600

use_faulty mapper

# run_with NAME FAULTS: a whole session
run_with() {
  session=$workspace/$1
  (
    SKEIN_BUILD=$programs
    export SKEIN_TEST_FAULTS=$2
    start_reconstruction "$session" "$url" --mappers 2
    publish "$session"
    await_agents
    # A map that begins after the last match is not consolidated.
    wait_until 120 "a map has begun" status_holds "$session" '.images.registered >= 4'
    finish "$session"
    stop_services
  )
  jq -e '.images.received == 16' "$session/report.json" >/dev/null || fail "$1: $(jq -c .images "$session/report.json")"
}

# was_left_out STEP
was_left_out() {
  jq -e --arg step "$1" '[.failures[] | select(.image | contains($step)) | select(.attempts >= 3)] | length > 0' \
    "$session/report.json" >/dev/null || fail "$1 was not left out: $(jq -c .failures "$session/report.json")"
}

registered_at_least() {
  jq -e --argjson n "$1" '.images.registered >= $n' "$session/report.json" >/dev/null || fail "photos: $(jq -c .images "$session/report.json")"
}

# A merge that throws: services/mapper/failed_steps_test.cc.
run_with throw "photo 3=throw,consolidation=throw,final=throw,maintenance=throw"
for step in "photo 3" maintenance consolidation final; do was_left_out "$step"; done
registered_at_least 12

# launch.sh waits longer after each crash, so there are few.
run_with crash "photo 3=crash,final=crash"
for step in "photo 3" final; do was_left_out "$step"; done
registered_at_least 12
