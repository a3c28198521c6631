#!/usr/bin/env bash
# Everything is killed at once in mid-session, launch.sh and the agents too, and started again on
# the session folder.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session

start_services "$session" "$url"
publish "$session" --rate 2 # so that photos come all the time
wait_until 60 "photos are registered" has_facts "$session" registration 3
kill_everything "$session"
start_services "$session" "$url"
publish "$session"
await_agents
finish "$session"
stop_services
expect_model "$session" 1
