#!/usr/bin/env bash
# Memory a photo in every process, over a session of one's own photos by one agent.
#
#   benchmark/live/memory.sh --images DIR [--from N] [--rate HZ] [--keep DIR]
#
#   --images DIR   the photos (JPEG)
#   --from N       photos matched after which growth counts (default 32)
#   --rate HZ      photos a second (default 2)
#   --keep DIR     keeps the session and samples.csv there
#
# A page of the live view is open. A sample a second of what /proc/PID/smaps_rollup tells of each process that
# launch.sh runs. A row: anonymous memory once N photos are matched and once all are (what has files behind it, such as
# programs and the ledger, is left out), the growth a photo between, the largest resident memory, finish included. Needs a
# network namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

images='' from=32 rate=2 keep=''
take_options "images from rate keep" "$@"
[[ -d $images ]] || usage_error "--images: a folder of photos is wanted"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url) web_port=8470
out=${keep:-$workspace/memory}
mkdir -p "$out"
session=$out/session samples=$out/samples.csv
use_photos agent "$images" "$images"
((num_photos > from)) || usage_error "--from $from: there are $num_photos photos only"

# A line for each process: photos matched, instance, resident and anonymous memory in KiB
sample() {
  local photos file memory
  photos=$(count_facts "$session" matches)
  for file in "$session"/run/*.pid; do
    memory=$(awk '/^Rss/ { resident = $2 } /^Anonymous/ { print resident "," $2 }' "/proc/$(<"$file")/smaps_rollup" 2>/dev/null) || continue
    [[ -n $memory ]] && echo "$photos,$(basename "$file" .pid),$memory"
  done >>"$samples"
}

has_samples() { # has_samples PHOTOS N: N samples at least once so many photos are matched
  (($(grep -c "^$1,ingest," "$samples") >= $2))
}

sample_until() { # sample_until FILE: a sample a second until FILE is there
  until [[ -e $1 ]]; do
    sample
    sleep 1
  done
}

print_table() {
  echo "| process | anonymous at $from photos, MiB | at $num_photos | KiB more a photo | largest resident, MiB |"
  echo "|---|---|---|---|---|"
  awk -F, -v from="$from" -v all="$num_photos" '
    $3 > largest[$2] { largest[$2] = $3 }
    $1 >= from && !($2 in first) { first[$2] = $4; first_photos[$2] = $1 }
    $1 <= all && !(all_at[$2] >= all) { last[$2] = $4; all_at[$2] = $1 }
    END {
      for (name in first) {
        photos = all_at[name] - first_photos[name]
        if (photos > 0)
          printf "| %s | %.1f | %.1f | %.1f | %.0f |\n", name, first[name] / 1024, last[name] / 1024, (last[name] - first[name]) / photos, largest[name] / 1024 | "sort"
      }
    }' "$samples"
}

print_machine
rm -rf "$session" "$samples"
start_services "$session" "$url" --web "$web_port" >"$workspace/services.log"
"$SKEIN_ROOT/benchmark/live/live_viewer.py" 127.0.0.1 "$web_port" >"$workspace/pages.json" &
page_pid=$!
sample_until "$workspace/finished" &
sampler_pid=$!
publish "$session" --rate "$rate"
await_agents
wait_until 300 "all photos are matched" has_facts "$session" matches "$num_photos"
wait_until 30 "two samples with all photos" has_samples "$num_photos" 2
finish "$session"
touch "$workspace/finished"
wait "$sampler_pid"
kill -TERM "$page_pid"
wait "$page_pid" || true
stop_services
print_table
