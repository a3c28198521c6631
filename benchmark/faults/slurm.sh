#!/usr/bin/env bash
# `skein scale --engine slurm` in a session whose own host has mappers alone: workers grow from none to --max and leave again.
#
#   benchmark/faults/slurm.sh [--photos N] [--images DIR [--truth DIR]] [--max M] [--target S] [--keep DIR] [--picture FILE.png]
#
#   --photos N      of the synthetic place (default 600), published at full speed
#   --images DIR    one agent's photos instead: a folder that holds nothing else
#   --truth DIR     their ground truth, as `skein evaluate` takes it
#   --max M         workers at most, and nodes of one core (default 4)
#   --target S      seconds in which the backlog is to be worked off (default 30)
#   --keep DIR      keeps workers.csv there: seconds, workers that run, wait and are wanted, photos in work
#   --picture FILE.png  draws it (needs gnuplot)
#
# Slurm's daemons are Debian's (tests/slurm_cluster.sh); all nodes share this host's cores. Prints a row; exits 1 if a photo is lost or
# a worker stays. Needs root, and a network namespace of its own.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"
source "$(dirname "$0")/../../tests/scaling.sh"

photos=600 images='' truth='' max=4 target=30 keep='' picture=''
take_options "photos images truth max target keep picture" "$@"
for name in photos max target; do
  [[ ${!name} =~ ^[1-9][0-9]*$ ]] || usage_error "--$name needs a number from 1 on, not '${!name}'"
done
[[ -z $images || -d $images ]] || usage_error "--images: no folder $images"
((EUID == 0)) || die "slurmd runs as root alone"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || die "no network namespace may be made here"
new_workspace
source "$(dirname "$0")/../../tests/slurm_cluster.sh"
has_slurm || die "no slurm: apt-get install slurmctld slurmd slurm-client munge"
url=tcpq://10.78.0.1:7700
if [[ -n $images ]]; then
  use_photos agent "$images" "${truth:-$images}"
else
  use_place 1 "$photos" --seed 1 --size 800x600
fi
session=$workspace/session
table=$workspace/workers.csv

# note_workers: a line of the table, once a second
note_workers() {
  local started=$SECONDS
  while sleep 1; do
    status_of_scale | sed -nE "s/^running: ([0-9]+) workers?, waiting in the queue of slurm: ([0-9]+); ([0-9]+) wanted for ([0-9]+) photos? .*/$((SECONDS - started)),\1,\2,\3,\4/p"
  done
}
most() { sort -t , -rnk "$1,$1" "$table" | head -n 1 | cut -d , -f "$1"; }
# seconds_until COLUMN VALUE: when it first was so, or more
seconds_until() { awk -F , -v c="$1" -v v="$2" '$c >= v { print $1; exit }' "$table"; }

draw() {
  has_gnuplot || return 0
  gnuplot <<PLOT
set datafile separator ','
set terminal pngcairo size 900,420
set output '$picture'
set xlabel 'seconds'
set ylabel 'photos in work'
set y2label 'workers'
set yrange [0:]
set y2range [0:$max + 1]
set y2tics 1
set ytics nomirror
set grid ytics
plot '$table' using 1:5 with lines lw 2 lc rgb '#9e9e9e' title 'photos in work', \
  '' using 1:4 axes x1y2 with steps lw 1 lc rgb '#90caf9' title 'workers wanted', \
  '' using 1:2 axes x1y2 with steps lw 2 lc rgb '#1976d2' title 'workers that run'
PLOT
}

print_machine
start_cluster "$max"
start_reconstruction "$session" "$url" --features 0 --matching 0
start_scale --engine slurm --max "$max" --target "$target" --idle-after 10
note_workers >"$table" &
sampler_pid=$!
started=$SECONDS
publish "$session"
await_agents
finish "$session"
finished_s=$((SECONDS - started))
wait_until 300 "every worker has left" num_jobs_is PD,R,CG 0
left_s=$((SECONDS - started))
kill "$sampler_pid"
stop_scale
stop_cluster
echo '| photos | workers at most | the first after, s | all after, s | photos in work, at most | finished after, s | last worker left after, s | registered | placements a photo | position RMSE, % |'
echo '|---|---|---|---|---|---|---|---|---|---|'
rmse='-'
[[ -n $images && -z $truth ]] || rmse=$(position_rmse "$session")
echo "| $num_photos | $(most 2) | $(seconds_until 2 1) | $(seconds_until 2 "$(most 2)") | $(most 5) | $finished_s | $left_s | $(jq -r '.images |
  "\(.registered)/'"$num_photos"' | \(.placements / .registered * 1000 | round / 1000)"' "$session/report.json") | $rmse |"
[[ -z $picture ]] || draw
[[ -z $keep ]] || { mkdir -p "$keep" && cp "$table" "$workspace/scale.log" "$keep/"; }
(($(count_facts "$session" image) == num_photos)) || fail "photos lost: $(count_facts "$session" image) of $num_photos are in the ledger"
