#!/usr/bin/env bash
# The live view without a browser: two agents whose maps merge, while skein-web and a mapper are killed, and ten of twenty
# pages stop. Its events are the ledger's, its shapes the maps'; `skein view` on a copy of the folder gives the same.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_place 2 12 --scenario disjoint --seed 2 --size 800x600
session=$workspace/session

get() { curl -fsS --max-time 20 "$view$1"; }
# all_events FILE: one a line
all_events() {
  local from=1 page
  : >"$1"
  while page=$(get "/api/events?from=$from"); do
    jq -c '.events[]' <<<"$page" >>"$1"
    from=$(jq .next <<<"$page")
    ((from <= $(jq .head <<<"$page"))) || return 0
  done
  return 1
}
events_of() { jq -s --arg kind "$1" 'map(select(.kind == $kind)) | length' "$2"; }
live_submaps() { jq -rs '[.[] | select(.kind == "submap")] | group_by(.submap)[] | select(all(.state != "ended")) | .[0].submap' "$1"; }
shows_photos() { (($(get "/api/submaps/$1" 2>/dev/null | jq '.photos | length') >= $2)); }
is_served() { get /api/session >/dev/null 2>&1; }
has_read_all() { (($(get /api/session | jq .head) == $(sqlite3 "file:$session/ledger.db?mode=ro" 'SELECT MAX(seq) FROM facts'))); }

# points_of SUBMAP: downloads all chunks; prints how many points they hold, and that the shape tells as many
points_of() {
  local shape id version points total=0
  shape=$(get "/api/submaps/$1")
  while read -r id version points; do
    get "/api/submaps/$1/chunks/$id?v=$version" >"$workspace/chunk" || return 1
    (($(stat -c %s "$workspace/chunk") == 48 + 10 * points)) || fail "chunk $id: not the size of $points points"
    [[ $(head -c 4 "$workspace/chunk") == SKC1 ]] || fail "chunk $id: not a chunk"
    total=$((total + points))
  done < <(jq -r '.chunks[] | "\(.id) \(.version) \(.points)"' <<<"$shape")
  echo "$total"
}

start_services "$session" "$url" --web 8600 --guide off --dense off >"$workspace/launch.out"
view=$(sed -n 's|.*view: \(http://[^ ]*[0-9]\)/$|\1|p' "$workspace/launch.out")
[[ -n $view ]] || fail "launch.sh does not tell where the view is: $(cat "$workspace/launch.out")"
wait_until 20 "the view answers" is_served

# What it refuses.
refused() {
  local status=$1
  shift
  [[ $(curl -s -o /dev/null -w '%{http_code}' --max-time 10 --path-as-is "$@") == "$status" ]] || fail "not $status: $*"
}
refused 403 -H 'Host: evil.example' "$view/api/session"
refused 405 -X POST -d x "$view/api/session"
refused 404 "$view/../../etc/passwd"
refused 404 "$view/api/photos/1"
refused 403 -H 'Origin: http://evil.example' -H 'Connection: Upgrade' -H 'Upgrade: websocket' \
  -H 'Sec-WebSocket-Version: 13' -H 'Sec-WebSocket-Key: x3JJHMbDL1EzLkh9GBhXDw==' "$view/ws"

# By the own port a viewer does not finish; who shows an operator's pass may, but no other page for them.
grep -q 'operator: .* invite .*--view' "$workspace/launch.out" || fail "launch.sh does not tell how an operator comes in: $(cat "$workspace/launch.out")"
pass=$("$SKEIN_BUILD/bin/skein" invite --session "$session" --role operator --view "$view" | sed 's|.*#||')
refused 403 -X POST "$view/api/finish"
refused 403 -X POST -H "Authorization: Bearer $pass" -H 'Origin: http://127.0.0.1:1' "$view/api/finish"
refused 403 -X POST -H "Authorization: Bearer $pass" -H 'Host: evil.example' "$view/api/finish"
[[ $(get /api/session | jq .finishes) == false ]] || fail "anybody on this host may finish"
[[ $(curl -fsS --max-time 20 -H "Authorization: Bearer $pass" "$view/api/session" | jq .finishes) == true ]] || fail "an operator may not finish by the own port"

# A page that was never built.
"$SKEIN_BUILD/bin/skein-web" --session "$session" --lcm-url "$url" --instance web-2 --port 8601 --page "$workspace/no_page" >"$workspace/no_page.log" 2>&1 &
no_page=$!
wait_until 20 "skein-web tells where it is" grep -q 'view: http' "$workspace/no_page.log"
grep -q 'scripts/setup.sh' "$workspace/no_page.log" || fail "no warning: $(cat "$workspace/no_page.log")"
curl -s --max-time 20 http://127.0.0.1:8601/ | grep '<code>scripts/setup.sh</code>' >/dev/null || fail "no text for people"
kill "$no_page" && wait "$no_page" || fail "skein-web without a page ends with $?"

publish_part "$session" 1 6
wait_until 120 "each walk has its submap" two_submaps_have "$session" 5
all_events "$workspace/early"
submap=$(live_submaps "$workspace/early" | head -n 1)
wait_until 30 "submap $submap has a shape" shows_photos "$submap" 2
# The chunks of a shape are gone once there is a newer one.
has_many_points() { (($(points_of "$1" || echo 0) > 100)); }
wait_until 30 "a shape of more than a hundred points" has_many_points "$submap"

kill_service "$session" web
wait_until 20 "the view answers again" is_served
kill_service "$session" mapper-1

# Twenty pages, of which ten stop in the middle: the others are told everything.
pages=()
for i in {1..20}; do
  "$SKEIN_ROOT/benchmark/live/live_viewer.py" 127.0.0.1 8600 >"$workspace/page-$i.json" &
  pages+=($!)
done
has_pages() { "$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url" | grep '"[^"]*20 viewers' >/dev/null; }
wait_until 30 "twenty pages are open" has_pages
before=$(count_facts "$session" registration)
kill -STOP "${pages[@]:10}"
publish_part "$session" 7 12
finish "$session"
told=$(($(count_facts "$session" registration) - before))
wait_until 20 "the view has read the ledger" has_read_all
kill -TERM "${pages[@]}"
kill -CONT "${pages[@]:10}"
wait "${pages[@]}" || true
for i in {1..10}; do
  jq -e --argjson told "$told" '.registrations >= $told and .shapes > 0 and .points > 100' "$workspace/page-$i.json" >/dev/null ||
    fail "a page beside ten that had stopped: $(cat "$workspace/page-$i.json"), $told registrations"
done

all_events "$workspace/live"
for pair in photo:image described:features candidates:candidates matched:matches registration:registration merge:merge failure:failure finish:finish; do
  events=$(events_of "${pair%:*}" "$workspace/live") facts=$(count_facts "$session" "${pair#*:}")
  [[ $events == "$facts" ]] || fail "$events events ${pair%:*}, but $facts facts"
done
jq -es 'any(.kind == "merge" and .state == "done")' "$workspace/live" >/dev/null || fail "no merge was seen"
diff <(head -n "$(wc -l <"$workspace/early")" "$workspace/live") "$workspace/early" >/dev/null ||
  fail "what was told early is told otherwise now"

mapfile -t submaps < <(live_submaps "$workspace/live")
submap=${submaps[0]}
registered=$(jq .images.registered "$session/report.json")
[[ $(get /api/report | jq .images.registered) == "$registered" ]] || fail "not the report"
((${#submaps[@]} != 1)) || wait_until 30 "the map shows all photos" shows_photos "$submap" "$registered"
photo=$(jq -rs 'map(select(.kind == "photo" and .image == 1))[0] | "\(.agent)/\(.name)"' "$workspace/live")
get /api/photos/1 | cmp - "$session/images/$photo" || fail "a photo is not given as stored"
get /api/photos/1/thumbnail >"$workspace/thumbnail"
[[ $(od -An -tx1 -N 2 "$workspace/thumbnail") == ' ff d8' ]] || fail "the thumbnail is no JPEG"
other=$(get /api/photos/1/matches | jq '.[0].image')
[[ $(get "/api/photos/1/matches/$other" | jq '.points | length') == "$(get /api/photos/1/matches | jq '.[0].inliers')" ]] ||
  fail "not all inliers of photos 1 and $other"
shape=$(get "/api/submaps/$submap")
chunk=$(jq -r '.chunks[0] | "\(.id)/points/0?v=\(.version)"' <<<"$shape")
(($(get "/api/submaps/$submap/chunks/$chunk" | jq '.photos | length') >= 2)) || fail "nobody sees a point"
stop_services

# Without services, on a copy.
mkdir "$workspace/copied"
cp -r "$session" "$workspace/copied/session"
"$SKEIN_BUILD/bin/skein" view "$workspace/copied/session" --port 0 >"$workspace/view.out" 2>"$workspace/view.log" &
view_pid=$!
wait_until 20 "skein view tells where it is" grep -q 'view: http' "$workspace/view.out"
view=$(sed -n 's|.*view: \(http://[^ ]*[0-9]\)/ .*|\1|p' "$workspace/view.out")
all_events "$workspace/again"
diff "$workspace/live" "$workspace/again" >/dev/null || fail "skein view tells other events"
told=$(jq -s --argjson submap "$submap" 'map(select(.kind == "submap" and .submap == $submap and .state == "final"))[-1].points' "$workspace/live")
points=$(points_of "$submap")
[[ $points == "$told" ]] || fail "$points points in chunks, but the model has $told"
shows_photos "$submap" "$(jq .submaps[0].images "$session/report.json")" || fail "photos are missing"
get /download/model.zip >"$workspace/model.zip"
unzip -tq "$workspace/model.zip" >/dev/null || fail "no zip file"
unzip -p "$workspace/model.zip" 0/points3D.bin | cmp - <("$SKEIN_BUILD/bin/skein" export --session "$session" --output "$workspace/exported" >/dev/null && cat "$workspace/exported/0/points3D.bin") ||
  fail "not what skein export writes"
kill -TERM "$view_pid"
wait "$view_pid" || fail "skein view ends with $?"
echo "$(wc -l <"$workspace/live") events, $points points, $registered photos"
