#!/usr/bin/env bash
# The service as the package installs it has an exposure of 3.0 at most, as `systemd-analyze security` grades it.
source "$(dirname "$0")/../harness.sh"
readonly max_exposure=30 # tenths
command -v systemd-analyze >/dev/null || skip "no systemd-analyze: apt-get install systemd"
unit=$SKEIN_ROOT/packaging/skein@.service
grep -qF 'install -D -m 644 "$packaging/skein@.service" "$root/usr/lib/systemd/system/skein@.service"' "$SKEIN_ROOT/scripts/package.sh" ||
  fail "scripts/package.sh does not install packaging/skein@.service as it is: grade what it installs"
status=0
graded=$(systemd-analyze security --offline=true --threshold="$max_exposure" --no-pager "$unit" 2>&1) || status=$?
exposure=$(grep -o 'Overall exposure level.*' <<<"$graded") || fail "systemd-analyze does not grade it: $graded"
((status == 0)) || fail "$exposure; above $max_exposure tenths:
$(grep '^✗' <<<"$graded")"
echo "$exposure"
