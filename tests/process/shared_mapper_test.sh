#!/usr/bin/env bash
# A pool of one mapper: two submaps share it, outlive its kill -9, and are one map in the end.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 2 12 --scenario disjoint --seed 2 --size 800x600
session=$workspace/session

# has_leases_of EPOCH N: so many submaps are leased in it
has_leases_of() {
  [[ $(sqlite3 "file:$session/ledger.db?mode=ro" ".timeout 5000" \
    "SELECT COUNT(*) FROM facts WHERE fact_id LIKE 'submap/%/$1/lease'" 2>/dev/null) == "$2" ]]
}

start_reconstruction "$session" "$url" --mappers 1
publish_part "$session" 1 6
wait_until 120 "each walk has its submap" two_submaps_have "$session" 5
kill_service "$session" mapper-1
wait_until 60 "both submaps are leased anew" has_leases_of 2 2
publish_part "$session" 7 12
finish "$session"
stop_services
report=$session/report.json
[[ $(jq '.submaps | length' "$report") == 1 ]] || fail "not one map: $(jq -c '[.submaps, .merges]' "$report")"
expect_model "$session" 1
