#!/usr/bin/env bash
# skein-retrieval crashes over one photo and skein-guide over each place: after the third time both go on without, and the
# session ends with all other photos placed.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
use_faulty retrieval guide
session=$workspace/session
readonly photo=5 # its id: of 16 no other begins so

# failed_thrice FILE ITEM: a line "ITEM FAILURES KILLS"
failed_thrice() { grep -qE "^$2 3 0$" "$session/run/$1" 2>/dev/null; }

(
  SKEIN_BUILD=$programs
  export SKEIN_TEST_FAULTS="candidates $photo=crash,guidance=crash"
  start_services "$session" "$url" --mappers 1 --web 0 --dense off
  publish "$session"
  await_agents
  wait_until 60 "photo $photo is left out" failed_thrice retrieval.failed "$photo"
  wait_until 60 "the place is left out" failed_thrice guide.failed '[0-9]+'
  finish "$session"
  for service in retrieval guide; do kill -0 "$(<"$session/run/$service.pid")" || fail "$service does not go on"; done
  stop_services
)
is_accounted_for "$session/report.json" || fail "photos are not accounted for: $(jq -c .images "$session/report.json")"
jq -e --argjson n "$num_photos" '.images | .received == $n and .registered == $n - 1' "$session/report.json" >/dev/null ||
  fail "of $num_photos photos: $(jq -c '{images, failures}' "$session/report.json")"
