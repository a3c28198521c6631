#!/usr/bin/env bash
# How soon after a registration the guide has told quality and advice of a map with that photo, and what that costs, as
# the map grows.
#
#   benchmark/guidance/guide_latency.sh [--agents N] [--photos N] [--size WxH] [--rate HZ] [--keep DIR]
#
#   --agents N   each walks through one synthetic place (default 3)
#   --photos N   of each (default 200)
#   --size WxH   of the photos (default 640x480)
#   --rate HZ    photos a second of each (default 0: at full speed)
#   --keep DIR   keeps the session there
#
# A row a hundred photos: the median and the 95th percentile of the time from ingest's commit
# of a registration to the guide's message of a map with so many photos. Then medians of what that time is made of: until
# the mapper had made a shape with so many photos, until the guide had it, until the guide began with it or a later one, and
# until it told; and the median of the processor time that a computation of such a map takes. At the end the guide's share
# of the services' processor time, the finish included. Needs a network namespace of its own, so root or user namespaces.
source "$(dirname "$0")/../../tests/harness.sh"
source "$(dirname "$0")/../../tests/session.sh"

agents=3 photos=200 size=640x480 rate=0 keep=''
take_options "agents photos size rate keep" "$@"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
session=${keep:-$workspace}/session
mkdir -p "$(dirname "$session")"
rm -rf "$session"

# Seconds of processor time of each service so far
print_cpu() {
  local file
  for file in "$session"/run/*.pid; do
    awk -v name="$(basename "$file" .pid)" -v hz="$(getconf CLK_TCK)" '{ sub(/^.*\) /, ""); print name, ($12 + $13) / hz }' \
      "/proc/$(<"$file")/stat" 2>/dev/null || continue
  done
}

# Commits of registrations, then the shapes that came to the guide, when it began, and what it told. Seconds since 1970.
print_events() {
  sqlite3 -separator ' ' "file:$session/ledger.db?mode=ro" \
    "SELECT 'commit', printf('%.6f', utime_us / 1e6) FROM facts WHERE kind = 'registration' ORDER BY seq"
  awk -v day="$(date -d "$(date -r "$session/ledger.db" +%F)" +%s)" '
    function seconds(clock, t) { sub(/^#/, "", clock); split(clock, t, ":"); return sprintf("%.3f", day + 3600 * t[1] + 60 * t[2] + t[3]) }
    function photos(i) { for (i = 1; i <= NF; ++i) if ($i ~ /^photos,?$/) return $(i - 1) }
    / a shape of [0-9]+ photos, made [0-9.]+ s ago$/ { print "came", seconds($1), photos(), $(NF - 2) }
    / begins with [0-9]+ photos$/ { print "begins", seconds($1) }
    / photos, .*; [0-9.]+ s of CPU$/ { print "told", seconds($1), photos(), $(NF - 3) }' "$session/log/guide.log"
}

print_table() {
  echo "| photos in the map | told after, s: p50 | p95 | shape made, s | here | begun | told | a computation, CPU s |"
  echo "|---|---|---|---|---|---|---|---|"
  # A line for each photo that was told of: its hundred, seconds till it was told, in all and of each stage; and one for each
  # computation: its hundred, CPU seconds.
  print_events | awk '
    $1 == "commit" { commit[++committed] = $2 }
    $1 == "came" { while (here < $3) { came[++here] = $2; made[here] = $2 - $4 } }
    $1 == "begins" { begun = $2 }
    $1 == "told" {
      print int(($3 - 1) / 100), $4
      while (heard < $3 && heard < committed) {
        ++heard
        print int((heard - 1) / 100), $2 - commit[heard], made[heard] - commit[heard], came[heard] - made[heard], \
          begun - came[heard], $2 - begun
      }
    }' | jq -Rrn 'def at($p): sort | if . == [] then "-" else .[((length - 1) * $p) | round] * 1000 | round / 1000 end;
    [inputs / " " | map(tonumber)] | group_by(.[0])[]
    | map(select(length > 2)) as $photos | map(select(length == 2)) as $work
    | select($photos != []) | (100 * .[0][0]) as $before
    | [$photos | map(.[1]) | at(0.5, 0.95)] + [range(2; 6) as $i | $photos | map(.[$i]) | at(0.5)]
    | "| \($before + 1) to \($before + ($photos | length)) | \(join(" | ")) | \($work | map(.[1]) | at(0.5)) |"'
}

print_machine
use_place "$agents" "$photos" --seed 1 --size "$size"
start_services "$session" "$url" --verbose >/dev/null
publish "$session" --rate "$rate"
await_agents
finish "$session" >/dev/null
cpu=$(print_cpu)
stop_services
jq -r '"\(.images.registered) of \(.images.received) photos registered, \(.submaps | length) map(s), \(.wall_s | round) s"' "$session/report.json"
print_table
awk '{ all += $2; if ($1 ~ /^guide/) guide += $2 } END { printf "guide: %.1f of %.1f s of processor time, %.1f %%\n", guide, all, 100 * guide / all }' <<<"$cpu"
