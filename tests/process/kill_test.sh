#!/usr/bin/env bash
# kill -9 of each service in turn, in mid-session, all in one session: nothing accepted is lost.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session

start_services "$session" "$url" --mappers 1 # so that it is mapper-1 that holds the submap
publish "$session" --rate 2 # so that photos come all the time
wait_until 60 "photos are taken in" has_facts "$session" image 2
kill_service "$session" ingest
wait_until 60 "features are found" has_facts "$session" features 3
kill_service "$session" features-1
wait_until 60 "candidates are found" has_facts "$session" candidates 5
kill_service "$session" retrieval
wait_until 60 "photos are matched" has_facts "$session" matches 6
kill_service "$session" matching-1
kill_service "$session" merger
wait_until 60 "photos are registered" has_facts "$session" registration 3
kill_service "$session" mapper-1
kill_service "$session" guide
kill_service "$session" dense
await_agents
finish "$session"
stop_services
expect_model "$session" 1
