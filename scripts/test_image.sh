#!/usr/bin/env bash
# Runs an image of scripts/image.sh: the demo, then a session with workers as packaging/compose.yaml says, which is stopped and goes on
# in new containers. By podman where it runs a container, which keeps the image, else by scripts/image_run.sh. Prints the seconds of
# each step. As root.
#
#   scripts/test_image.sh --image FILE [--engine podman|chroot]
#
# Exit codes: 0 passed, 1 failed, 2 bad usage.
source "$(dirname "$0")/lib.sh"

arguments=("$@") image='' engine=''
take_options 'image engine' "$@"
[[ -f $image ]] || usage_error "--image needs an image, not '$image'"
[[ $engine =~ ^(podman|chroot|)$ ]] || usage_error "--engine: podman or chroot"
((EUID == 0)) || die "root is needed to run an image"
python3 -c 'import yaml' 2>/dev/null || die "no python3-yaml: install it"
# Loopback and one address, in namespaces of its own: no port of this host's is taken, and what is mounted goes with it.
[[ -n ${SKEIN_OWN_NETWORK:-} ]] || SKEIN_OWN_NETWORK=1 exec unshare --mount --net "$0" "${arguments[@]}"
export SKEIN_HOST=10.77.0.1
ip link set lo up
ip addr add "$SKEIN_HOST/32" dev lo

work=$(mktemp -d)
containers=()
stop_containers() {
  local container
  for container in "${containers[@]}"; do kill -TERM "$container" 2>/dev/null || true; done
  for container in "${containers[@]}"; do wait "$container" || status=$?; done
  containers=()
}
end_test() {
  status=$?
  stop_containers
  ((status == 0)) || tail -n 20 "$work"/*.log >&2
  rm -rf --one-file-system "$work"
  exit "$status"
}
trap end_test EXIT

table=()
# timed WHAT COMMAND...
timed() {
  local what=$1 begin=${EPOCHREALTIME/./}
  shift
  say "$what"
  "$@" || die "failed: $what"
  table+=("$(printf '%-40s %7.1f s' "$what" "$(((${EPOCHREALTIME/./} - begin) / 100000))e-1")")
}

# container OPTION... [WORD...]: sets container_command; options are those of image_run.sh
container() {
  local options=()
  if [[ $engine != podman ]]; then
    container_command=("$SKEIN_ROOT/scripts/image_run.sh" run "$work/image" "$@")
    return
  fi
  while [[ ${1:-} == --?* ]]; do options+=("$1" "$2"); shift 2; done
  container_command=(podman run --rm --read-only --tmpfs /tmp --network host --cap-drop all --security-opt no-new-privileges
    --pull never "${options[@]}" "$name" "$@")
}

# service NAME: the same for a service of compose.yaml
service() {
  local words
  mapfile -t words < <(python3 - "$SKEIN_ROOT/packaging/compose.yaml" "$work" "$1" <<'PY'
import os, re, sys, yaml
path, work, name = sys.argv[1:]
service = yaml.safe_load(open(path))['services'][name]
for volume in service['volumes']: print('--volume', f'{work}/{volume}', sep='\n')
if 'entrypoint' in service: print('--entrypoint', service['entrypoint'], sep='\n')
for word in service['command']: print(re.sub(r'\$\{(\w+)[^}]*\}', lambda match: os.environ[match[1]], word))
PY
  )
  container "${words[@]}"
}

# start SERVICE NAME: in the background, its output in NAME.log
start() {
  service "$1"
  : >"$work/$2.log" # before anyone looks: the child's own redirection comes later
  "${container_command[@]}" >"$work/$2.log" 2>&1 &
  containers+=($!)
}
are_running() {
  local container
  for container in "${containers[@]}"; do kill -0 "$container" 2>/dev/null || return 1; done
}
is_ready() { grep -q 'processes are ready' "$work/$1.log"; }
await_ready() {
  local name deadline=$((SECONDS + 120))
  for name in "$@"; do
    until is_ready "$name"; do
      are_running && ((SECONDS < deadline)) || die "$name is not ready: $(tail -n 5 "$work/$name.log")"
      sleep 0.2
    done
  done
}
start_session() { start session session && await_ready session; }
start_workers() {
  service invitation
  "${container_command[@]}" || return 1
  start worker worker-1
  start worker worker-2
  await_ready worker-1 worker-2
}
# on VOLUME WORD...: of skein, its output in WORD.log
on() {
  container --volume "$work/$1:/var/lib/skein" "${@:2}"
  "${container_command[@]}" >"$work/$2.log" 2>&1
}
publish() { on sessions sim --output /var/lib/skein/place --session /var/lib/skein/site --agents 2 --photos 6 --size 800x600; }
is_complete() {
  local report=$work/sessions/site/report.json
  is_accounted_for "$report" && (($(jq .images.received "$report") == 12 && $(jq .images.registered "$report") > 0))
}
stop_session() {
  status=0
  stop_containers
  ((status == 0)) || die "a container ended with exit code $status"
}

unpack_image() {
  local owner
  "$SKEIN_ROOT/scripts/image_run.sh" unpack "$image" "$work/image" && owner=$(jq -r .User "$work/image/config") &&
    install -d -m 750 -o "${owner%:*}" -g "${owner#*:}" "$work"/{demo,sessions,invitation}
}
runs_in_podman() {
  name=$(podman load --quiet --input "$image" | sed -n 's/^Loaded image.*: //p') &&
    podman run --rm --pull never --network host "$name" --version >/dev/null
}
choose_engine() {
  [[ $engine != chroot ]] || return 0
  if command -v podman >/dev/null && runs_in_podman >"$work/podman.log" 2>&1; then
    engine=podman
  elif [[ $engine == podman ]]; then
    die "podman runs no container here: $(cat "$work/podman.log" 2>/dev/null)"
  else
    engine=chroot
  fi
}

timed "unpacking" unpack_image
choose_engine
timed "skein demo by $engine" on demo demo --photos 6
[[ -n $(find "$work/demo" -name model.png -size +0) ]] || die "the demo made no picture"
timed "a session is ready" start_session
timed "an invitation, two workers" start_workers
timed "12 photos by two agents" publish
timed "skein finish" on sessions finish --session /var/lib/skein/site
is_complete || die "photos are missing: $(jq -c .images "$work/sessions/site/report.json")"
timed "session and workers stop" stop_session
timed "the session in a new container" start_session
timed "it stops" stop_session

printf '%s\n' "${table[@]}"
say "passed by $engine; the image has $(($(stat -c %s "$image") / 1000000)) MB, its root $(du -sm "$work/image/root" | cut -f1) MB"
