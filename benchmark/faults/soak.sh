#!/usr/bin/env bash
# Endurance test: agents and pages of the live view come and go for hours. Memory, file descriptors and threads of
# every process and the size of the session folder are sampled.
#
#   benchmark/faults/soak.sh [--minutes M] [--agents N] [--walk N] [--period S] [--keep DIR] [--picture FILE]
#
#   --minutes M     how long photos come (default 120)
#   --agents N      agents at the same time (default 3)
#   --walk N        photos of an agent, after which another agent starts at once (default 24)
#   --period S      seconds between two photos of an agent (default 20)
#   --keep DIR      keeps the session and samples.csv there
#   --picture FILE.png  draws memory, descriptors and disk over the photos (needs gnuplot)
#
# Over tcpq, with relays. Every third agent is killed (kill -9) half-way and begins again. A page of the
# live view is open for five minutes, then closed for five. Every 30 s /proc of each process of launch.sh and the
# size of the session folder are sampled.
#
# Prints a row for each process that ran from the second quarter to the end: memory at the end (MiB), growth after the
# first quarter (KiB a photo), file descriptors and threads in the second and in the last quarter (medians). Exit code 1:
# a process has over two descriptors or threads more in the last quarter, or a photo is lost. Needs a network namespace
# of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

minutes=120 agents=3 walk=24 period=20 keep='' picture=''
readonly sample_every_s=30 page_for_s=300
take_options "minutes agents walk period keep picture" "$@"
enter_network_namespace "$@"
new_workspace
url=tcpq://127.0.0.1:7700 web_port=8470
num_walks=$(((minutes * 60 * agents / period + walk - 1) / walk))
((num_walks <= 64)) || usage_error "$num_walks walks of $walk photos: 64 at most, so --walk $((minutes * 60 * agents / period / 64 + 1)) or more"
use_place "$num_walks" "$walk" --seed 1 --size 640x480
session=$workspace/session samples=$workspace/samples.csv
walks=("$place"/images/*/)
declare -A agent_of=() killed_at=()
next_walk=0 page_pid=''

start_agent() {
  "$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name "$(basename "$1")" --images "$1" \
    --rate "$(jq -n "1 / $period")" >>"$workspace/agents.log" 2>&1 &
  agent_of[$1]=$!
}

# Replaces agents that have sent all their photos by new ones. Kills every third agent once, half-way, and restarts it.
change_agents() {
  local folder
  for folder in "${!agent_of[@]}"; do
    if ! kill -0 "${agent_of[$folder]}" 2>/dev/null; then
      unset "agent_of[$folder]"
    elif [[ -n ${killed_at[$folder]:-} ]] && ((SECONDS >= killed_at[$folder])); then
      unset "killed_at[$folder]"
      kill -9 "${agent_of[$folder]}"
      wait "${agent_of[$folder]}" 2>/dev/null || true
      start_agent "$folder"
    fi
  done
  while ((${#agent_of[@]} < agents && next_walk < ${#walks[@]})); do
    start_agent "${walks[next_walk]}"
    ((next_walk % 3)) || killed_at[${walks[next_walk]}]=$((SECONDS + walk * period / 2))
    next_walk=$((next_walk + 1))
  done
}

change_page() {
  if (((SECONDS - started) / page_for_s % 2)); then
    [[ -n $page_pid ]] || { "$SKEIN_ROOT/benchmark/live/live_viewer.py" 127.0.0.1 "$web_port" >>"$workspace/pages.json" & page_pid=$!; }
  elif [[ -n $page_pid ]]; then
    kill -TERM "$page_pid"
    wait "$page_pid" || true
    page_pid=''
  fi
}

# sample: a line for each process: seconds, photos, instance, pid, memory in KiB, descriptors, threads
sample() {
  local now=$((SECONDS - started)) photos file pid status
  photos=$(count_facts "$session" image)
  for file in "$session"/run/*.pid; do
    pid=$(<"$file")
    status=$(awk '/^VmRSS/ { memory = $2 } /^Threads/ { print memory "," $2 }' "/proc/$pid/status" 2>/dev/null) || continue
    echo "$now,$photos,$(basename "$file" .pid),$pid,${status%,*},$(find "/proc/$pid/fd" -mindepth 1 2>/dev/null | wc -l),${status#*,}"
  done >>"$samples"
  echo "$now,$photos,$(du -sk "$session" | cut -f1)" >>"$workspace/disk.csv"
}

print_table() {
  awk -F, -v end="$1" '
    function median(list, count,   i, j, x) {
      for (i = 2; i <= count; i++) { x = list[i]; for (j = i - 1; j > 0 && list[j] > x; j--) list[j + 1] = list[j]; list[j + 1] = x }
      return list[int((count + 1) / 2)]
    }
    { quarter = int(4 * $1 / end); name = $3 " (" $4 ")" }
    quarter >= 1 && !(name in first) { first[name] = $5; first_photos[name] = $2; first_quarter[name] = quarter }
    { last[name] = $5; last_photos[name] = $2; last_quarter[name] = quarter }
    quarter == 1 || quarter >= 3 { q = quarter == 1 ? 1 : 3; n = ++count[name, q]; fds[name, q, n] = $6; threads[name, q, n] = $7 }
    END {
      for (name in last) {
        if (first_quarter[name] != 1 || last_quarter[name] < 3) continue
        for (q = 1; q <= 3; q += 2) {
          n = count[name, q]
          for (i = 1; i <= n; i++) list[i] = fds[name, q, i]
          f[q] = median(list, n)
          for (i = 1; i <= n; i++) list[i] = threads[name, q, i]
          t[q] = median(list, n)
        }
        photos = last_photos[name] - first_photos[name]
        shown = name; sub(/ .*/, "", shown)
        printf "| %s | %.0f | %.1f | %d, %d | %d, %d |\n", shown, last[name] / 1024, photos ? (last[name] - first[name]) / photos : 0, f[1], f[3], t[1], t[3] | "sort"
        if (f[3] > f[1] + 2 || t[3] > t[1] + 2) grown = 1
      }
      close("sort")
      exit grown
    }' "$samples"
}

draw() {
  has_gnuplot || return 0
  local instances
  instances=$(cut -d, -f3 "$samples" | sort | uniq -c | sort -k2 | awk '$1 > 10 { print $2 }')
  {
    echo "set datafile separator ','; set terminal pngcairo size 1000,900; set output '$picture'"
    echo "set multiplot layout 3,1; set key outside right; set grid; set xlabel 'photos'; set yrange [0:]"
    echo "set ylabel 'memory, MiB'; plot $(plots '$5 / 1024')"
    echo "set ylabel 'descriptors'; plot $(plots '$6')"
    echo "set ylabel 'folder of the session, MiB'; plot '$workspace/disk.csv' using 2:(\$3 / 1024) with lines notitle"
  } | gnuplot
}
# plots EXPRESSION: a line for each of `instances`
plots() {
  local instance lines=()
  for instance in $instances; do
    lines+=("'<grep \",$instance,\" $samples' using 2:($1) with lines title '$instance'")
  done
  local IFS=,
  echo "${lines[*]}"
}

print_machine
start_services "$session" "$url" --web "$web_port" >"$workspace/services.log"
started=$SECONDS
next_sample=0
while ((next_walk < ${#walks[@]} || ${#agent_of[@]} > 0)); do
  change_agents
  change_page
  if ((SECONDS - started >= next_sample)); then
    sample
    next_sample=$((next_sample + sample_every_s))
  fi
  sleep 1
done
end=$((SECONDS - started))
sample
finish_started=$SECONDS
finish "$session"
finish_s=$((SECONDS - finish_started))
sample
stop_services
broken=0
echo "$end s, $(jq -c .images "$session/report.json"), position RMSE $(position_rmse "$session") % of the extent, finish $finish_s s, folder $(($(tail -n 1 "$workspace/disk.csv" | cut -d, -f3) / 1024)) MiB"
echo '| process | memory at the end, MiB | KiB more a photo | descriptors | threads |'
echo '|---|---|---|---|---|'
print_table "$end" || { broken=1; warn "descriptors or threads grow"; }
jq -e --argjson n "$num_photos" '.images.received == $n' "$session/report.json" >/dev/null || { broken=1; warn "of $num_photos photos not all came"; }
[[ -z $picture ]] || draw
if [[ -n $keep ]]; then
  mkdir -p "$keep"
  cp -a "$session" "$samples" "$workspace/disk.csv" "$keep/"
fi
exit "$broken"
