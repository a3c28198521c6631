#!/usr/bin/env bash
# 64 agents vanish as ingest begins to pull their photos: the photos of another agent are stored within
# seconds all the same, and a finish gives the 64 up by name.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
readonly num_vanishing=64 stored_within_s=60

# vanishing_agent NUMBER: stops right before its first chunk
vanishing_agent() {
  mkdir -p "$workspace/gone-$1"
  head -c 50000 /dev/urandom >"$workspace/gone-$1/photo.jpg"
  LD_PRELOAD=$stop_shim SKEIN_STOP_AT=before SKEIN_STOP_TEXT=SKEIN_BLOB_CHUNK SKEIN_STOP_MARK=$workspace/stopped-$1 \
    "$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name "gone-$1" \
    --images "$workspace/gone-$1" >/dev/null 2>&1 &
  vanishing+=($!)
}
all_have_stopped() { (($(find "$workspace" -maxdepth 1 -name 'stopped-*' -size +0 | wc -l) == num_vanishing)); }

start_reconstruction "$session" "$url"
vanishing=()
for ((i = 1; i <= num_vanishing; i++)); do vanishing_agent "$i"; done
wait_until 120 "all agents are half-way" all_have_stopped
kill -9 "${vanishing[@]}"
wait "${vanishing[@]}" 2>/dev/null || true

started=$SECONDS
publish "$session"
wait_until "$stored_within_s" "the photos of the others are stored" has_facts "$session" image "$num_photos"
echo "$num_photos photos stored in $((SECONDS - started)) s beside $num_vanishing vanished agents"
await_agents
finish "$session"
stop_services
jq -e --argjson n "$num_vanishing" '[.failures[] | select(.reason | startswith("agent vanished"))] | length == $n' \
  "$session/report.json" >/dev/null || fail "not all who vanished are told: $(jq -c .failures "$session/report.json")"
jq -e --argjson n "$num_photos" '.images.registered == $n' "$session/report.json" >/dev/null ||
  fail "not all photos of the others: $(jq -c .images "$session/report.json")"
