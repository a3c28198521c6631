#!/usr/bin/env bash
# SIGSTOP of each process in turn, in mid-session, all in one session over relays: launch.sh finds what
# hangs, starts it again, and nothing accepted is lost.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
port=$((20000 + 2 * ($$ % 5000)))
url=tcpq://127.0.0.1:$port
use_small_place
session=$workspace/session
readonly hang_after_s=5

# hang INSTANCE...: stops them, and waits until launch.sh has started them again
hang() {
  local instance
  local -A old=()
  for instance in "$@"; do old[$instance]=$(<"$session/run/$instance.pid"); done
  kill -STOP "${old[@]}"
  for instance in "$@"; do
    wait_until $((hang_after_s + 20)) "$instance hangs and is started again" is_started_anew "$session" "$instance" "${old[$instance]}"
  done
}

started=$SECONDS
start_services "$session" "$url" --mappers 1 --hang-after "$hang_after_s" # so that it is mapper-1 that holds the submap
publish_part "$session" 1 3 # of both agents
hang "relay-$port"
hang "relay-$((port + 1))"
publish "$session"
hang ingest
wait_until 60 "features are found" has_facts "$session" features 7
hang features-1
wait_until 60 "candidates are found" has_facts "$session" candidates 8
hang retrieval
wait_until 60 "photos are matched" has_facts "$session" matches 9
hang matching-1
hang merger
wait_until 60 "photos are registered" has_facts "$session" registration 3
hang mapper-1
hang guide dense # neither waits for the other
await_agents
finish "$session"
stop_services
expect_model "$session" 1
echo "$((SECONDS - started)) s with ten hung processes"
