#!/usr/bin/env bash
# What Prometheus has of a session: photos that wait for each stage, photos by state, memory of the large processes.
#
#   benchmark/live/metrics_picture.sh --picture FILE.png [--images DIR] [--rate HZ]
#
#   --picture FILE.png  drawn of what Prometheus answers (needs gnuplot)
#   --images DIR        one agent's photos: a folder that holds nothing else (default: south-building of ../shared/datasets)
#   --rate HZ           photos a second (default 4, more than two cores place)
#
# Prometheus scrapes skein-web once a second by docs/deploy/prometheus.yml. Needs a network namespace of its own, so root or
# user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

picture='' images=$SKEIN_ROOT/../shared/datasets/south-building/images rate=4
take_options "picture images rate" "$@"
[[ -n $picture ]] || usage_error "--picture is needed"
[[ -d $images ]] || usage_error "--images: no folder $images"
enter_network_namespace "$@"
prometheus=$(command -v prometheus || echo "$SKEIN_DEPS/prometheus/usr/bin/prometheus")
[[ -x $prometheus ]] || die "no prometheus: scripts/setup.sh --tests gets it"
new_workspace
url=$(test_lcm_url)
use_photos agent "$images" "$images"
session=$workspace/session

answers() { curl -fsS --max-time 20 --data-urlencode "query=up" http://127.0.0.1:9199/api/v1/query | jq -e '.data.result[0].value[1] == "1"' >/dev/null 2>&1; }
# series EXPRESSION LABEL FILE: since the start, a block of "seconds value" a series, the label as its title
series() {
  curl -fsS --max-time 60 --data-urlencode "query=$1" --data-urlencode "start=$began" --data-urlencode "end=$(date +%s)" \
    --data-urlencode step=1 http://127.0.0.1:9199/api/v1/query_range |
    jq -r --arg name "$2" --argjson began "$began" '.data.result[] | "\"\(.metric[$name])\"", (.values[] | "\(.[0] - $began) \(.[1])"), "", ""' >"$3"
  [[ -s $3 ]] || fail "Prometheus has nothing of $1"
}

start_services "$session" "$url" --web 8470 >/dev/null
sed 's/15s/1s/' "$SKEIN_ROOT/docs/deploy/prometheus.yml" >"$workspace/prometheus.yml"
"$prometheus" --config.file="$workspace/prometheus.yml" --storage.tsdb.path="$workspace/prometheus" \
  --web.listen-address=127.0.0.1:9199 >"$workspace/prometheus.log" 2>&1 &
wait_until 60 "prometheus scrapes" answers
began=$(date +%s)
publish "$session" --rate "$rate"
await_agents
finish "$session"
series 'skein_stage_backlog' stage "$workspace/backlog"
series 'skein_photos' state "$workspace/photos"
series 'skein_process_resident_memory_bytes{service=~"ingest|features|matching|mapper|dense"} / 1e6' process "$workspace/memory"
stop_services
gnuplot <<PLOT
set terminal pngcairo size 900,900
set output '$(realpath -m "$picture")'
set multiplot layout 3,1
set xlabel 's'
set grid
set yrange [0:]
set key outside right reverse Left autotitle columnheader noenhanced
do for [panel in "backlog photos memory"] {
  file = '$workspace/'.panel
  set ylabel panel eq 'backlog' ? 'photos that wait for a stage' : panel eq 'photos' ? 'photos' : 'MB resident'
  stats file using 1:2 nooutput
  plot for [i = 0:STATS_blocks - 1] file index i using 1:2 with lines lw 2
}
PLOT
say "$picture"
