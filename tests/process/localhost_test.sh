#!/usr/bin/env bash
# A relay that listens on IPv4 alone is found at "localhost" where /etc/hosts names ::1 first.
if [[ -z ${IN_MOUNT_NAMESPACE:-} ]]; then
  unshare --user --map-root-user --mount true 2>/dev/null || { echo "SKIPPED: no mount namespace may be made here"; exit 77; }
  IN_MOUNT_NAMESPACE=1 exec unshare --user --map-root-user --mount "$0" "$@"
fi
source "$(dirname "$0")/../harness.sh"
enter_network_namespace "$@"
new_workspace
printf '::1 localhost\n127.0.0.1 localhost\n' >"$workspace/hosts"
mount --bind "$workspace/hosts" /etc/hosts
[[ $(getent ahosts localhost | head -1) == ::1* ]] || fail "localhost is not ::1 first: $(getent ahosts localhost)"
"$SKEIN_BUILD/bin/skein-relay" 7700 &
"$SKEIN_BUILD/bin/skein" probe --timeout 20 --lcm-url tcpq://localhost:7700 || fail "the relay was not reached"
