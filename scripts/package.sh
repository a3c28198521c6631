#!/usr/bin/env bash
# Builds skein_VERSION_ARCH.deb for the Debian release that it runs on.
#
#   scripts/package.sh [--build DIR] [--output DIR] [--version V] [--maintainer "NAME <ADDRESS>"]
#
#   --build DIR     a release build that is there; default: sets up and builds build/release
#   --output DIR    where the package goes (default build/package)
#   --version V     default: CMakeLists.txt's, revision 1 and the release, as 0.1.0-1+deb12
#   --maintainer M  default: $DEBFULLNAME <$DEBEMAIL>, else git's user, else this one
#
# With --build it needs dpkg-dev, python3 and binutils, which scripts/setup.sh installs otherwise.
# Exit codes: 0 built, 1 error, 2 bad usage.
source "$(dirname "$0")/lib.sh"

build='' output=$SKEIN_ROOT/build/package maintainer=''
version=$(sed -n 's/^project(skein VERSION \([0-9.]*\) .*/\1/p' "$SKEIN_ROOT/CMakeLists.txt")-1+deb$(. /etc/os-release && echo "${VERSION_ID:-}")
take_options 'build output version maintainer' "$@"
setting() { git -C "$SKEIN_ROOT" config "user.$1" 2>/dev/null || true; }
if [[ -z $maintainer ]]; then
  name=${DEBFULLNAME:-$(setting name)} address=${DEBEMAIL:-$(setting email)}
  maintainer="${name:-$(id -un)} <${address:-$(id -un)@$(hostname)}>"
fi
[[ $maintainer =~ ^[^\<]*[^\<[:space:]][[:space:]]\<[^@]+@[^@]+\>$ ]] || usage_error "--maintainer needs \"NAME <ADDRESS>\", not '$maintainer'"

if [[ -z $build ]]; then
  "$SKEIN_ROOT/scripts/setup.sh"
  build_skein release reconstruction
  build=$SKEIN_ROOT/build/release
fi
for tool in dpkg-shlibdeps dpkg-deb python3 strip; do
  command -v "$tool" >/dev/null || die "no $tool: install dpkg-dev, python3 and binutils"
done
SKEIN_BUILD=$(cd "$build" && pwd)
[[ -e $SKEIN_BUILD/web/index.html ]] || die "no page in $SKEIN_BUILD/web: scripts/setup.sh says what it lacks"
packaging=$SKEIN_ROOT/packaging
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git -C "$SKEIN_ROOT" log -1 --format=%ct 2>/dev/null || stat -c %Y "$SKEIN_ROOT/CHANGELOG.md")}
umask 022

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root doc=$work/root/usr/share/doc/skein

install_programs() {
  local program
  DESTDIR=$root cmake --install "$SKEIN_BUILD" --prefix /usr >"$work/install.log" || die "$(tail -n 5 "$work/install.log")"
  for program in "$root"/usr/lib/skein/bin/*; do strip --strip-unneeded -R .comment -R .note "$program"; done
  # Debian's own bash, whatever comes first on the path.
  sed -i '1s|^#!/usr/bin/env bash$|#!/bin/bash|' "$root"/usr/lib/skein/scripts/{demo,launch,reconstruct,service,worker_job,engines/*}.sh
}

install_pages() {
  "$packaging/pages.py" --skein "$SKEIN_BUILD/bin/skein" --man "$root/usr/share/man/man1" \
    --completion "$root/usr/share/bash-completion/completions/skein"
  gzip -9n "$root"/usr/share/man/man1/*
}

install_documents() {
  local document
  mkdir -p "$doc/examples"
  for document in README.md docs/deploy.md docs/at_the_site.md docs/channels.md docs/exchange.md docs/security.md; do
    cp "$SKEIN_ROOT/$document" "$doc/"
  done
  cp "$SKEIN_ROOT"/clients/examples/* "$doc/examples/"
  "$SKEIN_BUILD/bin/skein" config >"$doc/examples/skein.toml"
  cp "$packaging/copyright" "$doc/"
  gzip -9nc "$SKEIN_ROOT/CHANGELOG.md" >"$doc/changelog.gz"
  {
    printf 'skein (%s) unstable; urgency=medium\n\n' "$version"
    printf '  * Built from %s; changelog.gz tells what changed.\n\n' "$("$SKEIN_BUILD/bin/skein" --version)"
    printf ' -- %s  %s\n' "$maintainer" "$(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH")"
  } | gzip -9nc >"$doc/changelog.Debian.gz"
}

install_service() {
  install -D -m 644 "$packaging/skein@.service" "$root/usr/lib/systemd/system/skein@.service"
  install -D -m 644 "$packaging/sysusers.conf" "$root/usr/lib/sysusers.d/skein.conf"
  install -D -m 644 "$packaging/tmpfiles.conf" "$root/usr/lib/tmpfiles.d/skein.conf"
  mkdir -p "$root/etc/skein"
}

# The packages of the libraries that the programs link.
linked_packages() {
  mkdir -p "$work/source/debian"
  printf 'Source: skein\n\nPackage: skein\nArchitecture: any\n' >"$work/source/debian/control"
  (cd "$work/source" && dpkg-shlibdeps -O "$root"/usr/lib/skein/bin/* 2>"$work/shlibdeps.log") | sed -n 's/^shlibs:Depends=//p'
}

write_control() {
  local linked architecture control
  linked=$(linked_packages)
  [[ -n $linked ]] || die "dpkg-shlibdeps: $(<"$work/shlibdeps.log")"
  architecture=$(dpkg --print-architecture)
  mkdir -p "$root/DEBIAN"
  control=$(<"$packaging/control.in")
  control=${control//@VERSION@/"$version"} control=${control//@ARCH@/"$architecture"}
  control=${control//@MAINTAINER@/"$maintainer"} control=${control//@SHLIBS@/"$linked"}
  control=${control//@SIZE@/"$(du -sk --apparent-size --exclude=DEBIAN "$root" | cut -f1)"}
  printf '%s\n' "$control" >"$root/DEBIAN/control"
  install -m 755 "$packaging"/{postinst,prerm,postrm} "$root/DEBIAN/"
  (cd "$root" && find usr -type f -print0 | LC_ALL=C sort -z | xargs -0 md5sum) >"$root/DEBIAN/md5sums"
}

say "packing $version of $SKEIN_BUILD"
install_programs
install_pages
install_documents
install_service
chmod -R u=rwX,go=rX "$root/usr" "$root/etc"
write_control
mkdir -p "$output"
package=$output/skein_${version}_$(dpkg --print-architecture).deb
dpkg-deb --root-owner-group --build "$root" "$package" >/dev/null
say "package: $package ($(($(stat -c %s "$package") / 1000000)) MB)"
