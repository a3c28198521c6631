# A Slurm cluster of Debian's packages, each node in namespaces of its own: source it after session.sh. Wants `workspace`, and root in a
# network namespace of its own. The host is 10.78.0.1, node N is 10.78.0.1N.
cluster=$workspace/cluster
export SLURM_CONF=$cluster/slurm.conf
node_pids=()

has_slurm() {
  local program
  for program in slurmctld slurmd sbatch munged; do command -v "$program" >/dev/null || return 1; done
}

# start_cluster NODES: of one core each
start_cluster() {
  local node
  chmod 755 "$workspace" # for munge's socket
  mkdir -p "$cluster/munge" "$cluster/state"
  ip link add cluster type bridge
  ip addr add 10.78.0.1/24 dev cluster
  ip link set cluster up
  write_configuration "$1"
  start_munge
  start_controller
  for ((node = 1; node <= $1; node++)); do start_node "$node"; done
  wait_until 60 "all nodes are idle" nodes_are "$1 idle"
}

# The daemons write into the workspace until they are gone.
stop_cluster() {
  kill -KILL "$controller_pid" "$munge_pid" "${node_pids[@]}" 2>/dev/null || true
  wait "$controller_pid" "$munge_pid" "${node_pids[@]}" 2>/dev/null || true
}

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
$(for ((node = 1; node <= $1; node++)); do echo "NodeName=node$node NodeAddr=10.78.0.1$node CPUs=1 State=UNKNOWN"; done)
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE
CONF
}

start_munge() {
  (umask 077 && head -c 1024 /dev/urandom >"$cluster/munge.key")
  setpriv --pdeathsig KILL -- munged --foreground --force --key-file="$cluster/munge.key" --socket="$cluster/munge/socket" --pid-file="$cluster/munge/pid" \
    --log-file="$workspace/munge.log" --seed-file="$cluster/munge/seed" >>"$workspace/munge.log" 2>&1 &
  munge_pid=$!
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
