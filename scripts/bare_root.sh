# Bare roots of a Debian release, made by debootstrap. Source it after lib.sh, as root, in a mount namespace of its own: what is
# mounted in the root goes with it. Wants `root`, the root's folder.

# open_root: the root's programs find /proc, /dev and the network; packages start no service
open_root() {
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  cp /etc/resolv.conf "$root/etc/"
  printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
  chmod +x "$root/usr/sbin/policy-rc.d"
}

# inside COMMAND...: in the root, with an environment of its own
inside() { chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
