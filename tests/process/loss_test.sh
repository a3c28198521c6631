#!/usr/bin/env bash
# With 5 % of all datagrams lost every photo is still accounted for and registered.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session

lose_datagrams 5 1
start_services "$session" "$url"
publish "$session"
await_agents
finish "$session"
stop_services
report_losses
expect_model "$session" 1
