#!/usr/bin/env bash
# A session's relays under many workers: messages and MB a second through them, and whose processor time that takes.
#
#   benchmark/live/relay_load.sh [--workers "LIST"] [--seconds S] [--auth MODE] [--megabytes N] [--keep DIR] [--picture FILE.png]
#
#   --workers "LIST"  processes that pull blobs, a row each (default "4 16 64")
#   --seconds S     over which a row is measured, after 5 s that do not count (default 20)
#   --auth MODE     require (default): each message is signed, and the relays check it, as for other hosts; or off
#   --megabytes N   of a blob; a source serves 16 of them (default 2)
#   --keep DIR      keeps load.csv there
#   --picture FILE.png  draws MB a second and processor time over the workers (needs gnuplot)
#
# Two relays, as launch.sh starts them: 7700 carries messages (here requests and heartbeats), 7701 bulk data (chunks). Every worker
# pulls from one source, two blobs at a time, and drops what it has. All processes share this host's cores.
#
# A row: MB and messages a second that came to the workers; messages a second that each relay received; cores that each relay,
# the source and all workers together kept busy; from the start on, messages dropped for clients that do not keep up, times that a
# relay read a client later as it says too much, and fetches that failed. Needs a network namespace of its own, so root or
# user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"

workers="4 16 64" seconds=20 auth=require megabytes=2 keep='' picture=''
readonly warm_up_s=5 num_blobs=16
take_options "workers seconds auth megabytes keep picture" "$@"
[[ $auth == require || $auth == off ]] || usage_error "--auth $auth: require or off"
[[ $workers =~ ^[0-9\ ]+$ && $seconds =~ ^[1-9][0-9]*$ && $megabytes =~ ^[1-9][0-9]*$ ]] ||
  usage_error "--workers, --seconds and --megabytes want numbers"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || die "no network namespace may be made here"
new_workspace
url=tcpq://127.0.0.1:7700
load=$SKEIN_BUILD/bin/relay_load
[[ -x $load ]] || die "no $load: build first"
table=$workspace/load.csv
ticks_a_second=$(getconf CLK_TCK)
readonly ticks_a_second

# start NAME COMMAND...: its output goes to $run/NAME, its log to $run/log/NAME.log; notes its process
start() {
  local name=$1
  shift
  setpriv --pdeathsig TERM -- "$@" >"$run/$name" 2>"$run/log/$name.log" &
  pid_of[$name]=$!
}

start_relays() {
  local port
  for port in 7700 7701; do
    start "relay-$port" "$SKEIN_BUILD/bin/skein-relay" --port "$port" --session "$run/session" --lcm-url "$url" --auth "$auth" \
      --loopback --instance "relay-$port"
    wait_until 30 "relay-$port is ready" grep -q '^ready' "$run/relay-$port"
  done
}

start_source() {
  start source "$load" serve "$num_blobs" "$megabytes" --session "$run/session" --lcm-url "$url" --auth "$auth"
  wait_until 60 "the source is ready" grep -q '^ready source' "$run/source"
  wait_until 30 "both relays are heard" are_relays_heard
  mapfile -t blobs < <(sed -n 's/^blob //p' "$run/source")
}
are_relays_heard() { grep -q '^relay relay-7700 ' "$run/source" && grep -q '^relay relay-7701 ' "$run/source"; }

start_workers() {
  local i as
  for ((i = 1; i <= num; i++)); do
    as=(--session-id "$(jq -r .session_id "$run/session/session.json")" --instance "w-$i")
    [[ $auth == off ]] || as=(--invite "$("$SKEIN_BUILD/bin/skein" invite --session "$run/session" --lcm-url "$url" --role worker --name "w-$i" 2>/dev/null)")
    start "worker-$i" "$load" pull "${blobs[@]}" --lcm-url "$url" --auth "$auth" "${as[@]}"
  done
  wait_until 120 "every worker pulls" do_all_pull
}
do_all_pull() { (($(grep -lE '^pulled [0-9.]+ [1-9]' "$run"/worker-* | wc -l) == num)); }

# snapshot FILE: lines "cpu NAME MS TICKS", "pulled S BYTES MESSAGES FAILURES" of each worker, "relay INSTANCE S MESSAGES STATE"
snapshot() {
  local name i port ticks
  {
    for name in "${!pid_of[@]}"; do
      ticks=$(awk '{ print $14 + $15 }' "/proc/${pid_of[$name]}/stat") || fail "$name has ended: $(tail -n 3 "$run/log/$name.log")"
      echo "cpu ${name/#worker-*/workers} $((${EPOCHREALTIME/[.,]/} / 1000)) $ticks"
    done
    for ((i = 1; i <= num; i++)); do tail -n 1 "$run/worker-$i" | sed "s/^pulled/pulled worker-$i/"; done
    for port in 7700 7701; do grep "^relay relay-$port " "$run/source" | tail -n 1; done
  } >"$1"
}

# rates BEFORE AFTER: one line of the table's columns, with commas
rates() {
  awk -v ticks="$ticks_a_second" -v num="$num" '
    function count(pattern) { return match($0, "[0-9]+ " pattern) ? substr($0, RSTART, RLENGTH) + 0 : 0 }
    FNR == 1 { after = NR != FNR }
    $1 == "cpu" { sign = after ? 1 : -1; cpu[$2] += sign * $4; at[$2, after] += $3; ++n[$2, after] }
    $1 == "pulled" && !after { s[$2] = $3; bytes[$2] = $4; messages[$2] = $5 }
    $1 == "pulled" && after && $3 > s[$2] {
      mb += ($4 - bytes[$2]) / 1e6 / ($3 - s[$2])
      delivered += ($5 - messages[$2]) / ($3 - s[$2])
    }
    $1 == "pulled" && after { failures += $6 }
    $1 == "relay" && !after { s[$2] = $3; received[$2] = $4 }
    $1 == "relay" && after {
      received[$2] = $3 > s[$2] ? ($4 - received[$2]) / ($3 - s[$2]) : 0
      dropped += count("messages dropped")
      held += count("times a client was read later")
    }
    function cores(name) { return cpu[name] / ticks / ((at[name, 1] / n[name, 1] - at[name, 0] / n[name, 0]) / 1000) }
    END {
      printf "%d,%.1f,%.0f,%.0f,%.0f,%.2f,%.2f,%.2f,%.2f,%d,%d,%d\n", num, mb, delivered, received["relay-7700"], received["relay-7701"],
        cores("relay-7700"), cores("relay-7701"), cores("source"), cores("workers"), dropped, held, failures
    }' "$1" "$2"
}

stop_all() {
  kill -TERM "${pid_of[@]}" 2>/dev/null || true
  wait "${pid_of[@]}" 2>/dev/null || true
}

row() {
  num=$1 run=$workspace/run-$1
  declare -gA pid_of=()
  mkdir -p "$run/log"
  start_relays
  start_source
  start_workers
  sleep "$warm_up_s"
  snapshot "$run/before"
  sleep "$seconds"
  snapshot "$run/after"
  stop_all
  rates "$run/before" "$run/after" >>"$table"
  tail -n 1 "$table" | sed 's/,/ | /g; s/^/| /; s/$/ |/'
}

draw() {
  has_gnuplot || return 0
  gnuplot <<PLOT
set datafile separator ','
set terminal pngcairo size 900,420
set output '$picture'
set multiplot layout 1,2
set xlabel 'workers'
set yrange [0:]
set grid ytics
set ylabel 'MB a second to all workers'
set style data histograms
set style fill solid noborder
set boxwidth 0.6
plot '$table' using 2:xtic(1) notitle lc rgb '#1976d2'
set style histogram rowstacked
set ylabel 'cores kept busy'
set key outside right reverse Left
plot '$table' using 6:xtic(1) title 'relay, messages' lc rgb '#bbdefb', '' using 7 title 'relay, bulk data' lc rgb '#1976d2', \
  '' using 8 title 'source' lc rgb '#388e3c', '' using 9 title 'workers' lc rgb '#9e9e9e'
PLOT
}

print_machine
echo "blobs of $megabytes MB, $seconds s a row, --auth $auth"
echo '| workers | MB/s | messages/s to workers | received/s by relay 7700 | by relay 7701 | cores: relay 7700 | relay 7701 | source | workers | dropped | read later | failed |'
echo '|---|---|---|---|---|---|---|---|---|---|---|---|'
for num in $workers; do row "$num"; done
[[ -z $picture ]] || draw
[[ -z $keep ]] || { mkdir -p "$keep" && cp "$table" "$keep/"; }
