#!/usr/bin/env bash
# `skein scale --engine slurm` with Debian's slurmctld, munged and two slurmd, each in a network namespace of its own. Workers come and
# go; a node dies with its worker, the controller dies, Slurm refuses a job, an invitation ends in the queue: each is told in one
# line, and the session goes on.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
source "$(dirname "$0")/../scaling.sh"
for program in slurmctld slurmd sbatch munged; do
  command -v "$program" >/dev/null || skip "no $program: apt-get install slurmctld slurmd slurm-client munge"
done
((EUID == 0)) || skip "slurmd runs as root alone"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
url=tcpq://10.78.0.1:7700
use_place 2 8 --seed 1
session=$workspace/session
cluster=$workspace/cluster
export SLURM_CONF=$cluster/slurm.conf
chmod 755 "$workspace" # for munge's socket

write_configuration() {
  cat >"$SLURM_CONF" <<CONF
ClusterName=test
SlurmctldHost=$(hostname)(10.78.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$cluster/munge/socket
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool.%n
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/slurmd.%n.pid
SlurmctldLogFile=$workspace/slurmctld.log
SlurmdLogFile=$workspace/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SchedulerType=sched/builtin
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdTimeout=10
MessageTimeout=5
ReturnToService=2
NodeName=node1 NodeAddr=10.78.0.11 CPUs=1 State=UNKNOWN
NodeName=node2 NodeAddr=10.78.0.12 CPUs=1 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE
CONF
}

start_munge() {
  mkdir -p "$cluster/munge" "$cluster/state"
  (umask 077 && head -c 1024 /dev/urandom >"$cluster/munge.key")
  setpriv --pdeathsig KILL -- munged --foreground --force --key-file="$cluster/munge.key" --socket="$cluster/munge/socket" --pid-file="$cluster/munge/pid" \
    --log-file="$workspace/munge.log" --seed-file="$cluster/munge/seed" >>"$workspace/munge.log" 2>&1 &
  wait_until 20 "munged answers" munge -S "$cluster/munge/socket" -n -o /dev/null
}

start_controller() {
  setpriv --pdeathsig KILL -- slurmctld -D >>"$workspace/slurmctld.out.log" 2>&1 &
  controller_pid=$!
}

# start_node NUMBER: its daemon and its jobs are a process namespace of their own, which ends with node_pids[NUMBER]
start_node() {
  mkdir -p "$cluster/spool.node$1"
  setpriv --pdeathsig KILL -- unshare --net --uts --pid --fork --kill-child --mount-proc bash -c '
    hostname "node$1" && ip link set lo up
    until ip link show eth0 >/dev/null 2>&1; do read -r -t 0.1 <> <(:) || true; done
    ip addr add "10.78.0.1$1/24" dev eth0 && ip link set eth0 up && exec slurmd -D -N "node$1"' - "$1" >>"$workspace/slurmd.out.log" 2>&1 &
  node_pids[$1]=$!
  wait_until 20 "node$1 has its namespace" is_apart "${node_pids[$1]}"
  ip link add "to_node$1" type veth peer name eth0 netns "${node_pids[$1]}"
  ip link set "to_node$1" master cluster up
}
is_apart() { [[ $(readlink "/proc/$1/ns/net") != "$(readlink /proc/self/ns/net)" ]]; }
nodes_are() { [[ $(sinfo -h -N -o %T 2>/dev/null | sort | uniq -c | xargs) == "$1" ]]; }
# num_jobs_is STATES NUMBER
num_jobs_is() { (($(squeue -h -r -t "$1" -o %i | wc -l) == $2)); }

node_pids=()
mkdir -p "$cluster"
ip link add cluster type bridge
ip addr add 10.78.0.1/24 dev cluster
ip link set cluster up
write_configuration
start_munge
start_controller
start_node 1
start_node 2
wait_until 60 "both nodes are idle" nodes_are '2 idle'

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
scale_says 'workers leave: they are spare|worker leave: they are spare' || fail "it does not say that they leave"
stop_scale

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
echo "said: $(grep -c . "$workspace/scale.log") lines"
