#!/usr/bin/env bash
# `skein scale` on this host: workers come with a backlog and go without one, outlive a scale that is killed, leave on
# SIGTERM within 5 s. What is given wrongly, and a host without Slurm, is told in one line.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../scaling.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
mkdir "$workspace/without_slurm"
skein=$SKEIN_BUILD/bin/skein
readonly leave_limit_ms=5000 # an engine kills after 5 s (clients/scale/engine.h)

# refuses STATUS TEXT OPTION...: one line that holds TEXT
refuses() {
  local expected=$1 text=$2 status=0
  shift 2
  timeout 60 "$skein" scale --session "$session" --lcm-url "$url" "$@" >"$workspace/said" 2>&1 || status=$?
  ((status == expected)) || fail "skein scale $*: exit code $status, not $expected: $(<"$workspace/said")"
  grep -qF -- "$text" "$workspace/said" && (($(wc -l <"$workspace/said") == 1)) || fail "skein scale $*: $(<"$workspace/said")"
}
num_workers_is() { (($(find "$session/run/scale" -name '*.pid' | wc -l) == $1)); }

start_reconstruction "$session" "$url" --features 0 --matching 0
refuses 2 '--max is required' --min 1
refuses 2 '--min is above --max' --min 3 --max 2
refuses 2 '--engine' --max 2 --engine cloud
refuses 2 '--expires soon: give a number of s, m, h or d' --max 2 --expires soon
# A host without Slurm's commands.
cp -s /usr/bin/* "$workspace/without_slurm/" 2>/dev/null || true
rm -f "$workspace/without_slurm/"{sbatch,squeue,scancel}
status=0
PATH=$workspace/without_slurm timeout 60 "$skein" scale --session "$session" --lcm-url tcpq://10.99.0.1:7700 \
  --max 2 --engine slurm >"$workspace/said" 2>&1 || status=$?
((status == 1)) && grep -qF 'slurm: no command sbatch: install Slurm' "$workspace/said" ||
  fail "without Slurm: exit code $status: $(<"$workspace/said")"

start_scale --engine local --max 2 --target 1 --idle-after 6
wait_until 60 "it is heard" scale_tells '^running: 0 workers'
refuses 1 'another skein scale runs on' --max 2
publish "$session"
wait_until 120 "two workers come" scale_tells '^running: 2 workers, waiting in the queue of local: 0;'
workers=("$session"/run/scale/*.pid)

kill -9 "$scale_pid"
wait "$scale_pid" || true
start_scale --engine local --max 2 --target 1 --idle-after 6
wait_until 60 "the next one takes the workers over" grep -q 'takes over 2 workers' "$workspace/scale.log"
await_agents

# A worker that leaves while it works.
leaving=$(<"${workers[0]}")
group=$(ps -o pid= -g "$leaving")
start_ms=$(date +%s%3N)
kill -TERM "$leaving"
is_gone() { ! kill -0 $group 2>/dev/null; }
wait_until 15 "a worker that is told to leave leaves" is_gone
took_ms=$(($(date +%s%3N) - start_ms))
echo "a worker of $(wc -w <<<"$group") processes left within $took_ms ms"
((took_ms <= leave_limit_ms)) || fail "a worker that is told to leave took $took_ms ms, more than $leave_limit_ms"

finish "$session"
expect_model "$session" 1
[[ $(jq '.failures | length' "$session/report.json") == 0 ]] || fail "work failed: $(jq -c .failures "$session/report.json")"
wait_until 120 "spare workers leave" num_workers_is 0
[[ -z $(find "${TMPDIR:-/tmp}" -maxdepth 1 -name "skein-$(basename "${workers[0]}" .pid).*") ]] || fail "a worker left its folder"

publish_part "$session" 1 1
stop_scale
num_workers_is 0 || wait_until 15 "workers leave with skein scale" num_workers_is 0
