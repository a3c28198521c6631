#!/usr/bin/env bash
# Runs an image without a container engine: its entrypoint by chroot, with mounts and processes of its own, as the image's user without
# capabilities. The root cannot be written; /tmp can. Network and /etc/hosts are those of the caller. As root.
#
#   scripts/image_run.sh unpack IMAGE FOLDER     holds each blob against its digest
#   scripts/image_run.sh run FOLDER [--volume SOURCE:TARGET[:ro]]... [--entrypoint PROGRAM] [WORD...]
#
# WORDs take the place of the image's own. SIGTERM goes to the container's first process, and SIGKILL 30 s later.
# Exit codes: those of that process, 1 where a signal ended it (all that unshare of Debian 12 tells); 1 error, 2 bad usage.
source "$(dirname "$0")/lib.sh"

readonly grace_s=30 # stop_grace_period of packaging/compose.yaml

# blob LAYOUT DIGEST: its path
blob() {
  local path=$1/blobs/${2/://}
  sha256sum --check --status <<<"${2#sha256:}  $path" || die "$2 of the image has other bytes"
  echo "$path"
}

unpack() {
  local folder=$2 layout=$2/layout manifest config layer path
  mkdir -p "$layout" "$folder/root"
  tar -xf "$1" -C "$layout"
  manifest=$(blob "$layout" "$(jq -r '.manifests[0].digest' "$layout/index.json")")
  config=$(blob "$layout" "$(jq -r .config.digest "$manifest")")
  jq .config "$config" >"$folder/config"
  for layer in $(jq -r '.layers[].digest' "$manifest"); do
    path=$(blob "$layout" "$layer")
    tar -xf "$path" -C "$folder/root" --numeric-owner
  done
  rm -r "$layout"
}

# mount_devices FOLDER: of /dev what a container has
mount_devices() {
  local device
  mount -t tmpfs -o mode=755 none "$1"
  for device in null zero full random urandom; do
    touch "$1/$device"
    mount --bind "/dev/$device" "$1/$device"
  done
  ln -s /proc/self/fd "$1/fd"
}

# A volume is a folder or a file.
mount_volume() {
  local source target mode
  IFS=: read -r source target mode <<<"$1"
  if [[ -d $source ]]; then mkdir -p "$root$target"; else touch "$root$target"; fi
  mount --bind "$source" "$root$target"
  [[ -z $mode ]] || mount -o "remount,bind,$mode" "$root$target"
}

# enter FOLDER VOLUME... -- WORD...: in namespaces of its own; does not return
enter() {
  local config=$1/config root=$1/root user environment
  shift
  mount --bind "$root" "$root"
  mount -t proc proc "$root/proc"
  mount_devices "$root/dev"
  mount -t tmpfs -o mode=1777 none "$root/tmp"
  touch "$root/etc/hosts"
  mount --bind /etc/hosts "$root/etc/hosts"
  while [[ $1 != -- ]]; do mount_volume "$1"; shift; done
  shift
  mount -o remount,bind,ro "$root"
  mapfile -t environment < <(jq -r '.Env[]' "$config")
  user=$(jq -r .User "$config")
  exec chroot "$root" /usr/bin/env -i --chdir="$(jq -r .WorkingDir "$config")" "${environment[@]}" \
    /usr/bin/setpriv --reuid "${user%:*}" --regid "${user#*:}" --clear-groups --bounding-set=-all --inh-caps=-all --no-new-privs -- "$@"
}

# end_container OUTER: SIGTERM to its first process once there is one; the kernel drops it where that has no handler yet
told_s=''
end_container() {
  if [[ -z $told_s ]]; then
    ! pkill -TERM -P "$1" || told_s=$SECONDS
  elif ((SECONDS - told_s >= grace_s)); then
    pkill -KILL -P "$1" || true
  fi
}

run() {
  local folder outer words=() default_words=() volumes=() status=0 ending=''
  folder=$(realpath "$1")
  mapfile -t words < <(jq -r '.Entrypoint[]' "$folder/config")
  mapfile -t default_words < <(jq -r '.Cmd[]' "$folder/config")
  shift
  while (($#)); do
    case $1 in
      --volume) volumes+=("$2") ;;
      --entrypoint) words=("$2") default_words=() ;; # as engines do
      *) break ;;
    esac
    shift 2
  done
  if (($#)); then words+=("$@"); else words+=("${default_words[@]}"); fi
  exec {never}<> <(:) # a pipe into which nobody writes
  trap 'ending=1' INT TERM
  unshare --mount --pid --uts --ipc --kill-child "$0" enter "$folder" "${volumes[@]}" -- "${words[@]}" </dev/null &
  outer=$!
  # Looks instead of waiting: launch.sh, pause, tells why.
  while kill -0 "$outer" 2>/dev/null; do
    [[ -z $ending ]] || end_container "$outer"
    read -r -t 0.1 -u "$never" || true
  done
  wait "$outer" || status=$?
  exit "$status"
}

case ${1:-} in
  unpack) (($# == 3)) || usage_error "unpack IMAGE FOLDER"; unpack "${@:2}" ;;
  run) (($# >= 2)) || usage_error "run FOLDER WORD..."; run "${@:2}" ;;
  enter) enter "${@:2}" ;;
  -h | --help) print_help ;;
  *) usage_error "unpack or run" ;;
esac
