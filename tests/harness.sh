# What every test script shares: source it first.
source "$(dirname "${BASH_SOURCE[0]}")/../scripts/lib.sh"
export_build_environment

fail() {
  echo "FAILED: $*" >&2
  exit 1
}
# ctest counts exit code 77 as skipped.
skip() {
  echo "SKIPPED: $*"
  exit 77
}

# tracked_files PATTERN...: NUL-separated; in a tree without git, every such file outside build folders
tracked_files() {
  if git -C "$SKEIN_ROOT" rev-parse --git-dir >/dev/null 2>&1; then
    git -C "$SKEIN_ROOT" ls-files -z -- "$@"
    return
  fi
  local pattern
  for pattern in "$@"; do
    find . \( -path ./build -o -path ./.deps \) -prune -o -type f -path "*${pattern#\*}" -print0
  done
}

drop_shim=$SKEIN_BUILD/tests/libdrop_datagrams.so
stop_shim=$SKEIN_BUILD/tests/libstop_at_datagram.so

# new_workspace: a scratch folder; services stop and the folder goes when the test ends, logs are
# shown when it failed, wherever the output went that the test was then writing. With SKEIN_KEEP_FAILED=DIR
# the folder of a failed test is moved there.
new_workspace() {
  workspace=$(mktemp -d "${TMPDIR:-/tmp}/skein_test.XXXXXX")
  exec {test_output}>&1
  trap 'end_test >&"$test_output" 2>&1' EXIT
  trap 'trap "" INT TERM; exit 130' INT TERM
}

end_test() {
  local status=$? log
  trap '' INT TERM
  stop_services
  kill $(jobs -p) 2>/dev/null || true
  if ((status != 0 && status != 77)); then
    for log in "$workspace"/*/log/*.log "$workspace"/*.log; do
      [[ -s $log ]] && { echo "--- ${log##*/}"; tail -n 15 "$log"; }
    done
    [[ -z ${SKEIN_KEEP_FAILED:-} ]] || { mkdir -p "$SKEIN_KEEP_FAILED" && mv "$workspace" "$SKEIN_KEEP_FAILED/"; }
  fi
  rm -rf "$workspace"
  return "$status"
}

# has_gnuplot: for the pictures of benchmarks
has_gnuplot() { command -v gnuplot >/dev/null || { warn "no gnuplot: no picture"; return 1; }; }

# wait_until DEADLINE_S WHAT COMMAND...: polls the command; fails with WHAT after the deadline
wait_until() {
  local deadline=$((SECONDS + $1)) what=$2
  shift 2
  until "$@"; do
    ((SECONDS < deadline)) || fail "not within the deadline: $what"
    sleep 0.1
  done
}

# enter_network_namespace "$@": runs the rest of the calling test in a network namespace of its own,
# loopback with multicast, and with mounts of its own. Where that isn't permitted the test goes on outside, over tcpq.
# Sets IN_NAMESPACE (empty outside).
enter_network_namespace() {
  IN_NAMESPACE=${IN_NAMESPACE:-}
  if [[ -n $IN_NAMESPACE ]]; then
    ip link set lo up multicast on
    ip route add 224.0.0.0/4 dev lo src 127.0.0.1 # with an address of a further link the kernel drops it
    return
  fi
  local unshare=(unshare --net --mount)
  ((EUID == 0)) || unshare+=(--map-root-user)
  if "${unshare[@]}" true 2>/dev/null; then
    IN_NAMESPACE=1 exec "${unshare[@]}" bash "$0" "$@"
  fi
  echo "no network namespace may be made here: going on over TCP on 127.0.0.1"
}

# The LCM URL of this test.
test_lcm_url() {
  if [[ -n ${IN_NAMESPACE:-} ]]; then
    echo 'udpm://239.255.76.67:7667?ttl=0'
  else
    echo "tcpq://127.0.0.1:$((20000 + 2 * ($$ % 5000)))"
  fi
}

# The line above a benchmark's table: where and of what it was measured.
print_machine() {
  echo "$(nproc) cores, $(sed -n 's/^model name.*: //p' /proc/cpuinfo | head -n 1), commit $(git -C "$SKEIN_ROOT" rev-parse --short HEAD)"
}
