#!/usr/bin/env bash
# From a bare root of this Debian release to the demo by a package alone: installs an older version, runs the demo, upgrades
# it under a live session, runs a session as the service's user, removes it. Before that lintian looks at the package, where it is
# installed; its errors fail. Prints the package's files by size, and the seconds of each step. As root.
#
#   scripts/test_package.sh --package DEB [--root DIR] [--keep]
#
#   --package DEB  of scripts/package.sh, for the release that it runs on
#   --root DIR     a root that debootstrap made, which is changed (default: a new one, by the mirror of apt's sources)
#   --keep         leave the root
#
# Exit codes: 0 passed, 1 failed, 2 bad usage.
source "$(dirname "$0")/lib.sh"
source "$SKEIN_ROOT/scripts/bare_root.sh"

package='' root='' keep=0
while (($#)); do
  case $1 in
    --package | --root) (($# > 1)) || usage_error "$1 needs a value" ;;&
    --package) package=$2; shift ;;
    --root) root=$2; shift ;;
    --keep) keep=1 ;;
    -h | --help) print_help; exit 0 ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ -f $package ]] || usage_error "--package needs a .deb, not '$package'"
((EUID == 0)) || die "root is needed to make a root"
command -v debootstrap >/dev/null || die "no debootstrap"
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
# In a mount namespace of its own: what is mounted in the root goes with it.
[[ -n ${SKEIN_OWN_MOUNTS:-} ]] || SKEIN_OWN_MOUNTS=1 exec unshare --mount "$0" --package "$package" ${root:+--root "$root"} $( ((!keep)) || echo --keep)

work=$(mktemp -d)
launch=''
stop_launch() { [[ -z $launch ]] || pkill -TERM -P "$launch" || true; }
trap 'stop_launch; umount -l "$root"/{proc,dev} 2>/dev/null; ((keep)) || rm -rf --one-file-system "$work"' EXIT
table=()
# timed WHAT COMMAND...
timed() {
  local what=$1 log=$work/log begin=${EPOCHREALTIME/./}
  shift
  say "$what"
  "$@" >"$log" 2>&1 || { tail -n 30 "$log" >&2; die "failed: $what"; }
  table+=("$(printf '%-52s %7.1f s' "$what" "$(((${EPOCHREALTIME/./} - begin) / 100000))e-1")")
}
# Loopback with multicast alone, as on a laptop without a network.
offline() {
  unshare --net bash -c 'ip link set lo up multicast on; ip route add 224.0.0.0/4 dev lo src 127.0.0.1; exec "$@"' - \
    chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"
}
check_by_lintian() {
  command -v lintian >/dev/null || { say "SKIPPED: lintian (apt-get install lintian)"; return; }
  timed "lintian" lintian --fail-on error "$package"
  cat "$work/log"
}
# Bytes and path of each file, largest first; links have 0.
list_files() {
  say "files of $(basename "$package"), $(stat -c %s "$package") bytes packed"
  dpkg-deb --contents "$package" | awk '$1 !~ /^d/ { printf "%11d %s\n", $3, $6; sum += $3 } END { printf "%11d in all\n", sum }' | sort -rn
}
install_package() { inside apt-get install -y -q "/root/$1"; }
version() { inside dpkg-query -W -f '${Version}' skein; }

check_by_lintian
list_files

mirror=$(debian_mirror)
if [[ -z $root ]]; then
  root=$work/root
  timed "debootstrap of $codename" debootstrap --variant=minbase "$codename" "$root" "$mirror"
fi
open_root

# The same files as an older version.
cp "$package" "$root/root/newer.deb"
dpkg-deb -R "$package" "$work/older"
sed -i 's/^Version: .*/Version: 0.0.1-1/' "$work/older/DEBIAN/control"
dpkg-deb -Zgzip -z1 --root-owner-group -b "$work/older" "$root/root/older.deb" >/dev/null
rm -rf "$work/older"

timed "apt-get update" inside apt-get update -q
timed "apt install of the older version, with what it needs" install_package older.deb
timed "skein demo" offline skein demo
cp "$work/log" "$work/demo.log"
[[ -s $root/root/.cache/skein/demo/session/model.png ]] || die "the demo made no picture"
grep -E '^(photos|maps|from received to placed|rmse|position)' "$work/demo.log" || true
[[ -s $root/usr/share/man/man1/skein-launch.1.gz ]] || die "no manual page"

# A live session, upgraded under it. It goes on with what it has, and a new start takes the new programs.
session=/root/sessions/house
offline skein launch --session "$session" --web 0 >"$work/launch.log" 2>&1 &
launch=$!
for ((i = 0; i < 600; i++)); do ! grep -q 'processes are ready' "$work/launch.log" || break; sleep 0.2; done
grep -q 'processes are ready' "$work/launch.log" || die "skein launch: $(<"$work/launch.log")"
timed "upgrade under a live session" install_package newer.deb
[[ $(version) == "$(dpkg-deb -f "$package" Version)" ]] || die "version $(version) is installed"
sleep 2
kill -0 "$launch" || die "the upgrade ended the session: $(<"$work/launch.log")"
[[ -s $root$session/run/ingest.pid ]] || die "the session lost its services"
stop_launch
wait "$launch" || die "skein launch did not stop: $(<"$work/launch.log")"
launch=''
timed "check of that session by the new version" inside skein check "$session"

# As skein@site.service runs it, but for systemd.
inside sh -c 'skein config >/etc/skein/site.toml'
offline setpriv --reuid skein --regid skein --init-groups env HOME=/var/lib/skein \
  timeout --preserve-status 60 /usr/lib/skein/scripts/service.sh /var/lib/skein/site /etc/skein/site.toml --web 0 >"$work/service.log" 2>&1 ||
  die "the service's session: $(<"$work/service.log")"
grep -q 'processes are ready' "$work/service.log" || die "the service's session: $(<"$work/service.log")"
[[ $(stat -c %U:%a "$root/var/lib/skein/site/keys" 2>/dev/null) == *:700 ]] || warn "keys: $(ls -ld "$root/var/lib/skein/site/keys")"

timed "apt remove" inside apt-get remove -y -q skein
inside apt-get purge -y -q skein >/dev/null 2>&1
rm "$root/etc/skein/site.toml"
left=$(cd "$root" && find . -xdev -iname '*skein*' -not -path './proc/*' -not -path './dev/*' | grep -vxE './(var/lib/skein(/.local/state/skein)?|root/\.cache/skein|root/\.local/state/skein|etc/skein)' || true)
[[ -z $left ]] || die "left behind: $left"
[[ -s $root/var/lib/skein/site/session.json && -s $root$session/session.json ]] || die "the sessions are gone"

say "seconds of each step"
printf '%s\n' "${table[@]}"
say "passed; the root had $(du -sxm "$root" | cut -f1) MB at the end"
