#!/usr/bin/env bash
# Visitors of other hosts without a browser: invitations, what each role may have, photos that are uploaded in parts while
# skein-web is killed, and bad input. Every photo that was received is in the session, once.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
[[ -n $IN_NAMESPACE ]] || skip "no network namespace may be made here"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
skein=$SKEIN_BUILD/bin/skein

start_services "$session" "$url" --web 8600 --web-public 127.0.0.1 --web-public-port 8700 --web-plain 8701 --guide off --dense off >"$workspace/launch.out"
secure=https://127.0.0.1:8700 plain=http://127.0.0.1:8701 own=http://127.0.0.1:8600
curl -fsS "$own/skein.crt" | openssl x509 -inform der -out "$workspace/issuer.pem" || fail "no certificate to install"

# invite ROLE NAME [OPTION...]: a pass
invite() {
  local role=$1 name=$2
  shift 2
  "$skein" invite --session "$session" --role "$role" --name "$name" --browser "$@" | sed -n '1s|.*#||p'
}
# ask STATUS NAME ARGUMENT...: with the cookie jar of NAME; the answer stands in $workspace/answer
ask() {
  local status=$1 jar=$workspace/$2.jar got
  shift 2
  got=$(curl -s -o "$workspace/answer" -D "$workspace/header" -w '%{http_code}' --max-time 30 --path-as-is \
    --cacert "$workspace/issuer.pem" -b "$jar" -c "$jar" "$@" || true)
  [[ $got == "$status" ]] || fail "$got in place of $status: $* ($(head -c 300 "$workspace/answer"))"
}
says() { grep -qi -- "$1" "$workspace/answer" || fail "no line about '$1': $(head -c 300 "$workspace/answer")"; }
enter() { ask "$1" "$2" -X POST "$secure/api/enter" -H 'Content-Type: application/json' -d "{\"pass\":\"$3\"}"; }
sha_of() { sha256sum "$1" | cut -d ' ' -f 1; }
# send STATUS NAME FILE OFFSET [BYTES]: that many bytes of the file from there on, all by default
send() {
  local size
  size=$(stat -c %s "$3")
  dd if="$3" of="$workspace/part" bs=64k iflag=skip_bytes,count_bytes skip="$4" count="${5:-$size}" status=none
  ask "$1" "$2" -X PATCH "$secure/api/uploads/$(sha_of "$3")" --data-binary "@$workspace/part" \
    -H "Upload-Offset: $4" -H "Upload-Length: $size" -H "Upload-Name: $(basename "$3")" -H 'Upload-Gps: 47.5,8.2,430'
}
offset_of() { ask 200 "$1" -I "$secure/api/uploads/$(sha_of "$2")"; tr -d '\r' <"$workspace/header" | sed -n 's/^Upload-Offset: //Ip'; }
state_of() {
  ask 200 "$1" -X POST "$secure/api/uploads/states" -d "{\"photos\":[[\"$(sha_of "$2")\",\"$(basename "$2")\"]]}"
  jq -r '.states[0].state' "$workspace/answer"
}
is_registered() { [[ $(state_of "$1" "$2") == placed ]]; }
is_refused_photo() { [[ $(state_of "$1" "$2") == refused ]]; }

# Invitations.
enter 200 anna "$(invite agent anna)"
jq -e '.role == "agent" and .name == "anna"' "$workspace/answer" >/dev/null || fail "not anna"
grep -q '#HttpOnly_127.0.0.1.*TRUE.*skein_' "$workspace/anna.jar" || fail "the cookie is not for https alone, or scripts can read it"
enter 200 bert "$(invite agent bert)"
enter 200 vera "$(invite viewer vera)"
enter 200 otto "$(invite operator otto)"
pass=$(invite agent late --expires 1s)
sleep_until=$((SECONDS + 2))
wait_until 10 "the invitation expires" eval '((SECONDS >= sleep_until))'
enter 401 late "$pass" && says 'expired'
enter 401 late "$(invite agent x | tr A-M B-N)"
fingerprint=$(openssl x509 -in "$workspace/issuer.pem" -noout -fingerprint -sha256)
"$skein" invite --session "$session" --role agent --name y --browser --qr >"$workspace/answer" || fail "no invitation"
says "certificate, SHA-256: ${fingerprint#*=}"
says 'The code is the http link, which is not encrypted'
enter 400 late '"' && enter 401 late 'AAAA'
"$skein" invite --session "$session" --role worker --browser 2>"$workspace/answer" && fail "a worker has a page"
says 'worker has no page'

# What each may have. The page itself says nothing of the session.
ask 200 nobody "$secure/phone"
ask 401 nobody "$secure/api/session" && says 'invitation'
ask 401 nobody "$secure/api/events"
ask 200 anna "$secure/api/session"
for path in /api/events /api/report /api/submaps/1 /download/model.zip /ws /api/photos/1/matches; do ask 403 anna "$secure$path"; done
ask 403 anna -X POST "$secure/api/finish" && says 'not for that'
ask 403 anna -X POST "$secure/api/invitations" -d '{"role":"agent"}'
ask 200 vera "$secure/api/events"
ask 403 vera -X POST "$secure/api/finish"
ask 403 vera -I "$secure/api/uploads/$(printf '0%.0s' {1..64})"
ask 403 nobody -X POST "$own/api/finish"
ask 200 nobody -X POST "$own/api/invitations" -d '{"role":"agent","name":"from-page"}'
jq -e '.secure.link | test("^https://127.0.0.1:8700/phone#")' "$workspace/answer" >/dev/null || fail "no link from the page"
ask 400 nobody -X POST "$own/api/invitations" -d '{"role":"operator"}'
ask 403 otto -X POST "$secure/api/finish" -H 'Origin: https://evil.example'
ask 403 nobody -X POST "$own/api/invitations" -H 'Origin: http://evil.example' -d '{"role":"agent"}'
ask 403 anna "$secure/api/session" -H 'Host: evil.example'

# Bad input.
photos=("$place"/images/agent-1/*) first=${photos[0]}
zeros=$(printf '0%.0s' {1..64})
patch() { ask "$1" anna -X PATCH "$secure/api/uploads/$2" -H "Upload-Offset: ${3:-0}" -H "Upload-Length: ${4:-3}" -H "Upload-Name: ${5:-a.jpg}" --data-binary "${6:-abc}"; }
patch 400 "$zeros" 0 3 '../../evil.jpg' && says 'leaves its folder'
patch 400 "$zeros" 0 3 '%2e%2e%2fevil.jpg' && says 'leaves its folder'
patch 400 "$zeros" 0 3 '/etc/passwd'
patch 400 'nohash' && says 'SHA-256'
patch 404 "$zeros/more"
patch 413 "$zeros" 0 2 a.jpg abc && says 'longer'
patch 413 "$zeros" 2 3 a.jpg abc
patch 413 "$zeros" 0 99999999999 && says 'smaller'
patch 409 "$zeros" 1 5 a.jpg abc && says 'go on there'
patch 422 "$zeros" 0 3 a.jpg abc && says 'not the photo'
patch 400 "$zeros" x 3
ask 404 anna -I "$secure/api/uploads/$zeros"
ask 400 anna -X POST "$secure/api/uploads/states" -d '{"photos":[[1,2]]}'
ask 413 anna -X POST "$secure/api/uploads/states" --data-binary "@$first"
ask 411 anna -X PATCH "$secure/api/uploads/$zeros" -H 'Transfer-Encoding: chunked' -d abc
ask 405 anna -X DELETE "$secure/api/uploads/$zeros"
[[ -z $(find "$session/uploads" -name '*.part') ]] || fail "something was kept of what was refused"
html="$workspace/<img src=x onerror=alert(1)>.jpg"
head -c 5000 /dev/urandom >"$html"
ask 201 anna -X PATCH "$secure/api/uploads/$(sha_of "$html")" --data-binary "@$html" -H 'Upload-Offset: 0' -H 'Upload-Length: 5000' -H 'Upload-Name: %3Cimg%20src=x%20onerror=alert(1)%3E.jpg'
wait_until 30 "what is no photo is refused" is_refused_photo anna "$html"

# A photo in parts; skein-web dies in between, and after it was received.
send 200 anna "$first" 0 10000
[[ $(offset_of anna "$first") == 10000 ]] || fail "not at 10000"
kill_service "$session" web
is_served() { curl -fs -o /dev/null --cacert "$workspace/issuer.pem" "$secure/phone"; }
wait_until 30 "skein-web answers again" is_served
[[ $(offset_of anna "$first") == 10000 ]] || fail "not at 10000 after skein-web was killed"
send 409 anna "$first" 0
send 201 anna "$first" 10000
kill_service "$session" web
wait_until 30 "skein-web answers again" is_served
for photo in "${photos[@]:1}"; do send 201 anna "$photo" 0; done
for photo in "${photos[@]}"; do wait_until 60 "$photo is placed" is_registered anna "$photo"; done
[[ -z $(find "$session/uploads" -type f) ]] || fail "copies of uploads stay: $(find "$session/uploads" -type f)"
[[ $(ls "$session/images/anna" | wc -l) == "${#photos[@]}" ]] || fail "not each photo once"
cmp "$first" "$session/images/anna/$(basename "$first")" || fail "a photo was changed"

# One's own photos, and nobody else's. The position came beside them.
all_events() { curl -fsS "$own/api/events?from=1"; }
photo=$(all_events | jq '.events[] | select(.kind == "photo" and .agent == "anna") | .image' | sed -n 1p)
all_events | jq -e --argjson photo "$photo" '.events[] | select(.kind == "photo" and .image == $photo) | .gps | length == 3' >/dev/null || fail "no position"
ask 200 anna "$secure/api/photos/$photo/thumbnail"
ask 403 bert "$secure/api/photos/$photo/thumbnail"
ask 403 bert "$secure/api/photos/$photo"
ask 200 vera "$secure/api/photos/$photo/thumbnail"
send 409 bert "$first" 5 100 # it has nothing of it

# 1,000 sockets that say nothing, on each public port, and uploads that stand still.
python3 - 8700 8701 >"$workspace/sockets" <<'PY' &
import resource, socket, sys, time
resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
kept = []
for i in range(1000):
    for port in sys.argv[1:]:
        s = socket.create_connection(('127.0.0.1', int(port)))
        try: s.send(b'PATCH /api')
        except OSError: pass
        kept.append(s)
print('open', flush=True)
time.sleep(600)
PY
sockets=$!
wait_until 60 "the sockets are open" grep -q open "$workspace/sockets"
others=("$place"/images/agent-2/*)
for photo in "${others[@]}"; do send 201 bert "$photo" 0; done
wait_until 60 "a photo is placed beside 1,000 sockets" is_registered bert "${others[0]}"
rss=$(awk '/VmRSS/ { print $2 }' "/proc/$(<"$session/run/web.pid")/status")
((rss < 300000)) || fail "skein-web has $rss kB"
kill "$sockets"

# An operator finishes.
ask 202 otto -X POST "$secure/api/finish"
finished() { [[ -e $session/report.json ]]; }
wait_until 120 "the session is finished" finished
jq -e '.images | .received == 17 and .registered == 16 and .failed == 1' "$session/report.json" >/dev/null ||
  fail "not 16 photos placed and one refused: $(jq -c .images "$session/report.json")"
echo "16 photos of two phones, skein-web killed twice, $rss kB with 1,000 sockets a port"
