#!/usr/bin/env bash
# Two hosts: features, matching and mapper run in a second network namespace, joined by a cable
# (veth), over tcpq, by an invitation; the session folder is hidden from them. Prints the bytes moved.
#
#   tests/process/hosts_test.sh [PHOTOS TRUTH MAX_RMSE_PERCENT]
#
# PHOTOS: a folder of real photos instead of the small synthetic place, TRUTH: what they are
# evaluated against.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
unshare --mount true 2>/dev/null || skip "no mount namespace may be made here"
new_workspace
url=tcpq://10.77.0.1:7700
if (($#)); then
  use_photos real "$1" "$2"
else
  use_small_place
fi
session=$workspace/session

add_other_host 30

start_services "$session" "$url" --features 0 --matching 0 --mappers 0
invitation=$("$SKEIN_BUILD/bin/skein" invite --session "$session" --role worker --name other-host) || fail "skein invite"
mkdir -p "$workspace/remote"
nsenter --net -t "$other_host" unshare --mount bash -c \
  'mount -t tmpfs none "$1" && exec "$2/scripts/launch.sh" --join "$3" --session "$4" --build "$5"' - \
  "$session" "$SKEIN_ROOT" "$invitation" "$workspace/remote" "$SKEIN_BUILD" &
remote_pid=$!

publish "$session"
await_agents
finish "$session"
received=$(<"/proc/$other_host/net/dev" awk '/cable_end/ { print $2, $10 }')
echo "bytes over the cable, to and from the workers: $received"
kill -TERM "$remote_pid"
wait "$remote_pid" || true
stop_services
expect_model "$session" "${3:-1}"
