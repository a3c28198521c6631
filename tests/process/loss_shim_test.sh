#!/usr/bin/env bash
# The loss shim drops some datagrams when told to, and none otherwise.
source "$(dirname "$0")/../harness.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace

# lose PERCENT: prints SENT and DROPPED of a probe, which sends until one of its datagrams comes back
lose() {
  rm -f "$workspace/log"
  LD_PRELOAD=$drop_shim SKEIN_DROP_PERCENT=$1 SKEIN_DROP_SEED=1 SKEIN_DROP_LOG=$workspace/log \
    "$SKEIN_BUILD/bin/skein" probe --lcm-url 'udpm://239.255.76.67:7667?ttl=0' >/dev/null 2>&1 || true
  awk '$2 == "skein" { print $3, $4 }' "$workspace/log"
}
read -r sent dropped <<<"$(lose 60)"
((0 < dropped && dropped < sent)) || fail "60 %: $dropped of $sent"
read -r sent dropped <<<"$(lose 0)"
((sent > 0 && dropped == 0)) || fail "0 %: $dropped of $sent"
