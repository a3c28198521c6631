#!/usr/bin/env bash
# `skein scale --engine slurm` with Debian's slurmctld, munged and two slurmd, each in a network namespace of its own. Workers come and
# go; a node dies with its worker, the controller dies, Slurm refuses a job, an invitation ends in the queue: each is told in one
# line, and the session goes on.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../scaling.sh"
((EUID == 0)) || skip "slurmd runs as root alone"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
source "$(dirname "$0")/../slurm_cluster.sh"
has_slurm || skip "no slurm: apt-get install slurmctld slurmd slurm-client munge"
url=tcpq://10.78.0.1:7700
use_place 2 8 --seed 1
session=$workspace/session
start_cluster 2

start_services "$session" "$url" --features 0 --matching 0 --web 0 --guide off
refused=$("$SKEIN_BUILD/bin/skein" scale --session "$session" --lcm-url 'udpm://239.255.76.67:7667?ttl=0' --engine slurm --max 2 2>&1) &&
  fail "workers of other hosts for a session that they cannot hear"
[[ $refused == *'is heard on this host alone'* ]] || fail "unclear: $refused"

# From none to two, one a node, and through the finish.
start_scale --engine slurm --max 2 --target 1 --idle-after 6
publish "$session"
wait_until 120 "two jobs run" scale_tells '^running: 2 workers, waiting in the queue of slurm: 0;'
nodes_are '2 allocated' || fail "the jobs run on one node: $(sinfo -N)"
await_agents

# The controller dies: told, and its workers work.
kill -9 "$controller_pid"
wait_until 120 "the dead controller is told" scale_says 'slurm: .*[Uu]nable to contact slurm controller.*; the session goes on'
"$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url" | jq -r '.troubles[].what' |
  grep 'On .* (scale): slurm: ' >/dev/null || fail "skein status does not tell it"
start_controller
finish "$session"
expect_model "$session" 1
wait_until 120 "spare workers leave" num_jobs_is PD,R,CG 0
scale_says 'tells [12] workers? to leave: spare' || fail "it does not say that they leave"
stop_scale
wait_until 60 "they are silent" hears_workers 0

# A node dies with its worker: another takes the place.
start_scale --engine slurm --min 1 --max 1
wait_until 120 "a worker runs and is heard" hears_workers 1
node=$(squeue -h -t R -o %N)
kill -9 "${node_pids[${node#node}]}"
wait_until 120 "the dead node's worker is told" scale_says 'has ended, and was not told to|its node may be down'
wait_until 120 "another runs" num_jobs_is R 1
[[ $(squeue -h -t R -o %N) != "$node" ]] || fail "a job runs on the dead $node"
wait_until 120 "it is heard" hears_workers 1
stop_scale
wait_until 60 "it leaves with skein scale" num_jobs_is PD,R 0

# Slurm refuses.
start_scale --engine slurm --min 1 --max 1 --job-option --partition=nowhere
wait_until 120 "a refusal is told" scale_says 'slurm: sbatch: error: .*; the session goes on without more workers'
stop_scale

# No node takes jobs, and the invitation ends in the queue. With ReturnToService=2, a node that was set down and answers is idle
# again at its next registration (slurm.conf(5)); one that is drained stays so.
scontrol update nodename=node1,node2 state=drain reason=test
start_scale --engine slurm --min 1 --max 1 --expires 120s
wait_until 120 "a job waits" scale_tells '^running: 0 workers, waiting in the queue of slurm: 1;'
wait_until 120 "an invitation that ends in the queue is told" scale_says 'is cancelled: its invitation ended while it waited in the queue'
stop_scale
stop_cluster
echo "said: $(grep -c . "$workspace/scale.log") lines"
