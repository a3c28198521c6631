#!/usr/bin/env bash
# Builds an image of Skein for podman, docker and Kubernetes (docs/deploy.md): build/package/skein_VERSION_ARCH.image.tar, an OCI
# archive named localhost/skein:VERSION. Its root is a Debian root that debootstrap makes, with the package; no registry is asked.
#
#   scripts/image.sh --package DEB [--output DIR] [--test]
#   scripts/image.sh --root DIR [--output DIR] [--test]
#
#   --package DEB  of scripts/package.sh, for the release that it runs on. As root
#   --root DIR     a root that has the package already, which is left as it is
#   --output DIR   where the image goes (default build/package)
#   --test         then runs it: scripts/test_image.sh
#
# buildah or podman builds it where one of them is installed, else packaging/oci_image.py. Manual pages and translations are left out.
# Exit codes: 0 built, 1 error, 2 bad usage.
source "$(dirname "$0")/lib.sh"
source "$SKEIN_ROOT/scripts/bare_root.sh"

arguments=("$@")
package='' root='' output=$SKEIN_ROOT/build/package test=0
while (($#)); do
  case $1 in
    --package | --root | --output) (($# > 1)) || usage_error "$1 needs a value" ;;&
    --package) package=$2; shift ;;
    --root) root=$2; shift ;;
    --output) output=$2; shift ;;
    --test) test=1 ;;
    -h | --help) print_help; exit 0 ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ -n $package || -n $root ]] || usage_error "give --package DEB or --root DIR"
[[ -z $package || -z $root ]] || usage_error "--package and --root exclude each other"
packaging=$SKEIN_ROOT/packaging
if [[ -n $package ]]; then
  [[ -f $package ]] || usage_error "--package needs a .deb, not '$package'"
  ((EUID == 0)) || die "root is needed to make a root"
  command -v debootstrap >/dev/null || die "no debootstrap"
  # In a mount namespace of its own: what is mounted in the root goes with it.
  [[ -n ${SKEIN_OWN_MOUNTS:-} ]] || SKEIN_OWN_MOUNTS=1 exec unshare --mount "$0" "${arguments[@]}"
fi
umask 022
mkdir -p "$output"
work=$(mktemp -d "$output/image.XXXXXX")
end_build() {
  local status=$?
  ((status == 0)) || tail -n 30 "$work/log" >&2 2>/dev/null || true
  umount -l "$work"/root/{proc,dev} 2>/dev/null || true
  rm -rf --one-file-system "$work"
  ((status <= 2)) || status=1 # apt and tar have codes of their own
  exit "$status"
}
trap end_build EXIT
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")

# Lines of this host's release and of its security updates, by the mirrors of apt's sources.
source_lines() {
  apt-get indextargets --format 'deb $(SITE) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' |
    grep -E " $codename(-updates|-security)? main$" | sort -u
}

# The package's user with the number that the image runs as: volumes keep numbers, not names.
fix_user() {
  local uid
  uid=$(sed -n 's/^USER \([0-9]*\):.*/\1/p' "$packaging/Containerfile")
  mkdir -p "$root/etc/sysusers.d"
  sed "s/^u skein - /u skein $uid /" "$packaging/sysusers.conf" >"$root/etc/sysusers.d/skein.conf"
}

install_package() {
  source_lines >"$root/etc/apt/sources.list"
  cp "$package" "$root/root/skein.deb"
  inside apt-get update -q
  inside apt-get upgrade -y -q
  # In place of systemd, which nothing starts in a container.
  inside apt-get install -y -q --no-install-recommends systemd-standalone-sysusers systemd-standalone-tmpfiles /root/skein.deb
  # A volume takes its owner from here (packaging/compose.yaml).
  inside install -d -m 750 -o skein -g skein /etc/skein/invitation
  rm "$root/root/skein.deb" "$root/usr/sbin/policy-rc.d"
}

make_root() {
  local mirror include=''
  mirror=$(debian_mirror)
  [[ $mirror != https:* ]] || include=--include=ca-certificates
  root=$work/root
  say "a root of $codename with $(basename "$package")"
  debootstrap --variant=minbase $include "$codename" "$root" "$mirror" >"$work/log" 2>&1
  open_root
  fix_user
  install_package >>"$work/log" 2>&1
}

# Without what the root has of this host, and what programs in a container do not read.
pack_root() {
  local left_out=(etc/hostname etc/resolv.conf etc/machine-id etc/apt/sources.list {dev,proc,sys,run,tmp}/'*'
    var/{cache,log,lib/apt/lists}/'*' usr/share/{man,info,locale}/'*')
  tar -C "$root" --one-file-system --sort=name --mtime="@$SOURCE_DATE_EPOCH" --clamp-mtime --numeric-owner --anchored \
    "${left_out[@]/#/--exclude=./}" -cf "$work/root.tar" .
}

# build_image ENGINE FILE
build_image() {
  cp "$packaging/Containerfile" "$work/"
  case $1 in
    buildah)
      buildah --storage-driver vfs --root "$work/storage" --runroot "$work/run" build --isolation chroot --timestamp "$SOURCE_DATE_EPOCH" \
        --tag "$name" --file "$work/Containerfile" "$work"
      buildah --storage-driver vfs --root "$work/storage" --runroot "$work/run" push "$name" "oci-archive:$2:$name"
      ;;
    podman)
      podman build --timestamp "$SOURCE_DATE_EPOCH" --tag "$name" --file "$work/Containerfile" "$work"
      podman save --format oci-archive --output "$2" "$name"
      ;;
    *)
      "$packaging/oci_image.py" --containerfile "$work/Containerfile" --root "$work/root.tar" --architecture "$architecture" \
        --name "$name" --output "$2"
      ;;
  esac
}

[[ -z $package ]] || make_root
read -r version architecture < <(dpkg-query --admindir "$root/var/lib/dpkg" -W -f '${Version} ${Architecture}\n' skein) ||
  die "the package is not in $root"
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(stat -c %Y "$root/usr/share/doc/skein/changelog.gz")}
name=localhost/skein:${version%%-*} # a tag holds no "+"
image=$output/skein_${version}_$architecture.image.tar
engine=$(basename "$(command -v buildah || command -v podman || echo oci_image.py)")
say "packing $name by $engine"
pack_root
build_image "$engine" "$work/image.tar" >"$work/log" 2>&1
rm "$work/log"
mv "$work/image.tar" "$image"
say "image: $image ($(($(stat -c %s "$image") / 1000000)) MB)"
((!test)) || "$SKEIN_ROOT/scripts/test_image.sh" --image "$image"
