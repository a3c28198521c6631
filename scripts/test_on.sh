#!/usr/bin/env bash
# From a bare root of a Debian release to README's commands: makes the root, clones the last commit into it, runs
# scripts/demo.sh and scripts/test.sh there and prints the seconds of each. As root.
#
#   scripts/test_on.sh RELEASE [--root DIR] [--mirror URL] [--keep] [SCRIPT...]
#
#   RELEASE       bookworm (Debian 12) or trixie (Debian 13)
#   SCRIPT        of scripts/, in place of the two: "package.sh", "test.sh --label unit"
#   --root DIR    a root of RELEASE that debootstrap made, which is changed (default: a new one)
#   --mirror URL  default: that of apt's sources
#   --keep        leave a new root
#
# Exit codes: 0 passed, 1 failed, 2 bad usage.
source "$(dirname "$0")/lib.sh"
source "$SKEIN_ROOT/scripts/bare_root.sh"

arguments=("$@")
release='' root='' mirror='' keep=0 commands=()
while (($#)); do
  case $1 in
    --root | --mirror) (($# > 1)) || usage_error "$1 needs a value" ;;&
    --root) root=$2; shift ;;
    --mirror) mirror=$2; shift ;;
    --keep) keep=1 ;;
    -h | --help) print_help; exit 0 ;;
    -*) usage_error "unknown option $1" ;;
    *) if [[ -z $release ]]; then release=$1; else commands+=("$1"); fi ;;
  esac
  shift
done
[[ -n $release ]] || usage_error "which release? bookworm or trixie"
((${#commands[@]})) || commands=(demo.sh test.sh)
for command in "${commands[@]}"; do
  [[ -x $SKEIN_ROOT/scripts/${command%% *} ]] || usage_error "no scripts/${command%% *}"
done
((EUID == 0)) || die "root is needed to make a root"
[[ -n $root ]] || command -v debootstrap >/dev/null || die "no debootstrap"
# In a mount namespace of its own: what is mounted in the root goes with it.
[[ -n ${SKEIN_OWN_MOUNTS:-} ]] || SKEIN_OWN_MOUNTS=1 exec unshare --mount "$0" "${arguments[@]}"

table=()
# timed WHAT COMMAND...
timed() {
  local what=$1 begin=$SECONDS
  shift
  say "$what"
  "$@" || die "failed on $release: $what"
  table+=("$(printf '%-36s %6d s' "$what" $((SECONDS - begin)))")
}

# Certificate authorities that this host's administrator added, as of a proxy.
trust_authorities() {
  cp -r /usr/local/share/ca-certificates "$root/usr/local/share/"
  inside update-ca-certificates
}

# A clone wants git and, over https, the certificates: README takes them for granted. No service is started.
prepare_root() {
  mount --bind "$root" "$root" # tests make mount namespaces, for which the root has to be a mount
  open_root
  mount --rbind /sys "$root/sys"
  inside apt-get update -q
  inside apt-get install -y -q --no-install-recommends git ca-certificates
  trust_authorities
  rm -rf "$root/root/skein"
  git clone -q --no-hardlinks "$SKEIN_ROOT" "$root/root/skein"
}

if [[ -z $root ]]; then
  [[ -n $mirror ]] || mirror=$(debian_mirror)
  root=$(mktemp -d)
  ((keep)) || trap 'umount -l "$root"/{proc,dev,sys} "$root" 2>/dev/null; rm -rf --one-file-system "$root"' EXIT
  timed "debootstrap" debootstrap --variant=minbase "$release" "$root" "$mirror"
fi
found=$(. "$root/etc/os-release" && echo "${VERSION_CODENAME:-}") || die "no root in $root"
[[ $found == "$release" ]] || die "$root holds $found, not $release"
timed "git and a clone" prepare_root
for command in "${commands[@]}"; do
  read -ra words <<<"$command"
  timed "scripts/$command" inside ${NODE_EXTRA_CA_CERTS:+env NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt} \
    "/root/skein/scripts/${words[0]}" "${words[@]:1}"
done

printf '%s\n' "${table[@]}"
say "passed on $release, $(git -C "$SKEIN_ROOT" rev-parse --short HEAD); the root $root has $(du -sxm "$root" | cut -f1) MB"
