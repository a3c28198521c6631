#!/usr/bin/env bash
# A session's figures: scraped by curl and, where Debian's prometheus is, by that. They agree with report.json and `skein status`,
# and no counter begins anew when skein-web is killed. Prometheus understands each expression of the dashboard.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 2 12 --scenario disjoint --seed 2 --size 800x600
session=$workspace/session
prometheus=$(command -v prometheus || echo "$SKEIN_DEPS/prometheus/usr/bin/prometheus")
promtool=$(dirname "$prometheus")/promtool

scrape() { curl -fsS --max-time 20 http://127.0.0.1:8610/metrics >"$workspace/metrics"; }
# told NAME: of the last scrape; NAME with its labels
told() { awk -v name="$1" '$1 == name { print $2 }' "$workspace/metrics"; }
is_told() { scrape 2>/dev/null && [[ $(told "$1") == "$2" ]]; }
expect() { [[ $2 == "$3" ]] || fail "$1: $2 is told, and it is $3"; }
refused() {
  local status=$1
  shift
  [[ $(curl -s -o /dev/null -w '%{http_code}' --max-time 10 "$@") == "$status" ]] || fail "not $status: $*"
}

# ask EXPRESSION: the answer's values
ask() { curl -fsS --max-time 20 --data-urlencode "query=$1" http://127.0.0.1:9199/api/v1/query | jq -r '.data.result[].value[1]'; }
answers() { [[ $(ask "$1" 2>/dev/null) == "$2" ]]; }

start_prometheus() {
  sed -e 's/8470/8610/; s/15s/1s/' "$SKEIN_ROOT/docs/deploy/prometheus.yml" >"$workspace/prometheus.yml"
  "$promtool" check config "$workspace/prometheus.yml" >/dev/null || fail "docs/deploy/prometheus.yml"
  "$prometheus" --config.file="$workspace/prometheus.yml" --storage.tsdb.path="$workspace/prometheus" \
    --web.listen-address=127.0.0.1:9199 >"$workspace/prometheus.log" 2>&1 &
  wait_until 60 "prometheus scrapes" answers 'up' 1
}

# Of the dashboard, as Grafana would send them.
expect_expressions() {
  local expression num=0
  while IFS= read -r expression; do
    expression=${expression//\$instance/.*} expression=${expression//\$__rate_interval/5m}
    [[ -n $(ask "$expression") ]] || fail "no answer to $expression"
    num=$((num + 1))
  done < <(jq -r '.panels[].targets[].expr' "$SKEIN_ROOT/docs/deploy/grafana.json")
  echo "prometheus answered $num expressions of the dashboard"
}

# Of packaging/kubernetes/adapter.yaml, as prometheus-adapter would send it.
autoscaler_expression() { sed -e '1,/metricsQuery:/d' -e 's/<<.LabelMatchers>>/job="skein"/' "$SKEIN_ROOT/packaging/kubernetes/adapter.yaml"; }

start_services "$session" "$url" --web 8610 >"$workspace/launch.out"
wait_until 30 "metrics are told" is_told skein_photos_accepted_total 0
refused 403 -H 'Host: evil.example' http://127.0.0.1:8610/metrics
refused 405 -X POST -d x http://127.0.0.1:8610/metrics
[[ $(curl -fsS -o /dev/null -w '%{content_type}' http://127.0.0.1:8610/metrics) == 'text/plain; version=0.0.4; charset=utf-8' ]] ||
  fail "the content type"

has_prometheus=''
if [[ -x $prometheus ]]; then
  start_prometheus
  has_prometheus=1
else
  echo "SKIPPED: no prometheus (scripts/setup.sh --tests gets it): curl alone"
fi

publish_part "$session" 1 6
wait_until 60 "the photos are counted" is_told skein_photos_accepted_total 12
kill_service "$session" web
wait_until 30 "metrics are told again" is_told skein_photos_accepted_total 12
publish_part "$session" 7 12
finish "$session"
wait_until 30 "the finish is told" is_told skein_finishes_total 1

# The text against report.json.
report=$session/report.json
expect 'photos received' "$(awk '/^skein_photos\{/ { sum += $2 } END { print sum }' "$workspace/metrics")" "$(jq .images.received "$report")"
for state in registered failed; do
  expect "photos $state" "$(told "skein_photos{state=\"$state\"}")" "$(jq ".images.$state" "$report")"
done
deferred=$(awk '/^skein_photos\{state="(in_flight|waiting|unplaced)"/ { sum += $2 } END { print sum }' "$workspace/metrics")
expect 'photos deferred' "$deferred" "$(jq .images.deferred "$report")"
expect placements "$(told skein_placements_total)" "$(jq .images.placements "$report")"
expect 'first poses' "$(told skein_photo_latency_seconds_count)" "$(jq '[.images_in_time[] | select(.registered_s != null)] | length' "$report")"
for stage in ingest features retrieval matching mapper; do
  expect "items of $stage" "$(told "skein_stage_items_total{stage=\"$stage\"}")" "$(jq ".stages.$stage.count" "$report")"
  seconds=$(told "skein_stage_seconds_total{stage=\"$stage\"}")
  jq -e --argjson told "$seconds" ".stages.$stage | (.count * .mean_s - \$told) | fabs < 0.001" "$report" >/dev/null ||
    fail "seconds of $stage: $seconds are told, and it is $(jq -c ".stages.$stage" "$report")"
done
expect 'pairs verified' "$(told skein_pairs_verified_total)" "$(jq .retrieval.pairs_verified "$report")"
expect 'merges done' "$(told 'skein_merges_total{result="done"}')" "$(jq '[.merges[] | select(.state == "done")] | length' "$report")"
expect submaps "$(told 'skein_submaps{state="live"}')" "$(jq '.submaps | length' "$report")"
expect 'bytes of photos' "$(told skein_photo_bytes_total | awk '{ printf "%d", $1 }')" "$(find "$session/images" -type f -printf '%s\n' | awk '{ sum += $1 } END { printf "%d", sum }')"

# Against skein status and the kernel. A mapper without a submap retires after 10 s, perhaps between the two answers.
num_workers() { jq --arg stage "$1" '[.instances[] | select(.service == $stage)] | length' <<<"$status"; }
same_workers() {
  scrape || return 1
  status=$("$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url") || return 1
  local stage
  for stage in ingest features retrieval matching mapper; do
    [[ $(told "skein_workers{stage=\"$stage\"}") == "$(num_workers "$stage")" ]] || return 1
  done
}
wait_until 30 "the metrics and skein status tell the same workers" same_workers
expect 'in flight' "$(told 'skein_photos{state="in_flight"}')" "$(jq .images.in_flight <<<"$status")"
expect 'merges undone' "$(told 'skein_merges_total{result="undone"}')" "$(jq .merges.undone <<<"$status")"
told_kb=$(awk '/^skein_process_resident_memory_bytes\{process="features-1"/ { print int($2 / 1024) }' "$workspace/metrics")
kernel_kb=$(awk '/^VmRSS/ { print $2 }' "/proc/$(<"$session/run/features-1.pid")/status")
((told_kb > kernel_kb / 2 && told_kb < kernel_kb * 2)) || fail "features-1 has $kernel_kb kB, and $told_kb kB are told"

if [[ -n $has_prometheus ]]; then
  "$promtool" check metrics <"$workspace/metrics" || fail "promtool finds fault with the text above"
  wait_until 30 "prometheus has the last figures" answers 'sum(skein_finishes_total)' 1
  expect 'up' "$(ask up)" 1
  expect 'photos of prometheus' "$(ask skein_photos_accepted_total)" "$(jq .images.received "$report")"
  expect 'placements of prometheus' "$(ask skein_placements_total)" "$(jq .images.placements "$report")"
  for metric in skein_photos_accepted_total skein_ledger_facts_total skein_photo_latency_seconds_count; do
    expect "$metric began anew" "$(ask "resets($metric[1h])")" 0
  done
  expect_expressions
  expect "the autoscaler's seconds of work" "$(ask "$(autoscaler_expression)")" 0
fi
echo "$(grep -c '^# TYPE' "$workspace/metrics") metrics, $(wc -l <"$workspace/metrics") lines, $(wc -c <"$workspace/metrics") bytes"
