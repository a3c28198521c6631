#!/usr/bin/env bash
# A session folder that somebody sent: links, FIFOs, keys of another host, a ledger with a trigger. launch.sh and the
# commands refuse each at once, with a line that says what to do, and nothing outside of the folder is read or changed.
# `skein clone` and launch.sh --adopt take the session itself.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
skein=$SKEIN_BUILD/bin/skein
home=$workspace/home outside=$workspace/outside sent=$workspace/sent
export XDG_STATE_HOME=$home
launch=("$SKEIN_ROOT/scripts/launch.sh" --build "$SKEIN_BUILD" --lcm-url "$url" --mappers 1 --web 0 --guide off)

# What the receiver has beside the session.
reset_outside() {
  rm -rf "$outside"
  mkdir -p "$outside/folder"
  echo 'export PATH' >"$outside/bashrc"
  echo 'secret' >"$outside/secret"
}
outside_state() { (cd "$outside" && find . -printf '%p %y %s %T@\n' | sort && cat bashrc secret); }

# The sender's session, with a photo that nothing is made of.
export XDG_STATE_HOME=$workspace/sender
start_services "$sent" "$url" --mappers 1 --web 0 --guide off >"$workspace/launch.log" 2>&1
stop_services
export XDG_STATE_HOME=$home

# copy_sent: `session` is a new copy, with keys of this host
own=$workspace/own
start_services "$own" "$url" --mappers 1 --web 0 --guide off >"$workspace/launch.log" 2>&1
stop_services
copy_own() {
  rm -rf "$session"
  cp -a "$own" "$session"
}
session=$workspace/session

# expect_refused WHAT: launch.sh, at once
expect_refused() {
  local before status=0
  before=$(outside_state)
  timeout 20 "${launch[@]}" --session "$session" >"$workspace/refused" 2>&1 || status=$?
  [[ $status == 1 ]] || fail "$1: launch.sh ended with $status: $(tail -n 3 "$workspace/refused")"
  grep -qE 'does not hold|is not opened' "$workspace/refused" || fail "$1: unclear refusal: $(cat "$workspace/refused")"
  [[ $(outside_state) == "$before" ]] || fail "$1: something outside of the folder was changed"
}

# Row 1: links, as files, as folders, and hard ones.
reset_outside
for file in log/ingest.log log/mapper-1.log run/ingest.pid run/launch.lock run/lcm_url run/ingest.alive run/mapper-1.step \
  ledger.db ledger.db-wal ledger.db.lock session.json report.json results.sha256 retrieval/hnsw.bin keys/root.key keys/counters; do
  copy_own
  mkdir -p "$session/$(dirname "$file")"
  ln -sfn "$outside/bashrc" "$session/$file"
  expect_refused "$file as a link"
done
for folder in log run retrieval damaged keys images uploads blobs sparse; do
  copy_own
  rm -rf "${session:?}/$folder"
  ln -s "$outside/folder" "$session/$folder"
  expect_refused "$folder/ as a link"
done
copy_own
ln -f "$outside/bashrc" "$session/log/ingest.log"
expect_refused "log/ingest.log as a second name"
# A folder of which not all can be listed at once: what lies deeper is found all the same.
copy_own
deep=$session/log/$(printf 'd/%.0s' {1..300})
mkdir -p "$deep"
ln -s "$outside/bashrc" "$deep/link"
(ulimit -Sn 128 && expect_refused "a link below 300 folders") || exit 1
echo "links are refused"

# Names that steer a terminal or look like another line of what a command says.
copy_own
name=$(printf 'x\033]0;title\007\033[2J\nsession.json: is damaged')
mkdir -p "$session/images/alice" && touch "$session/images/alice/$name"
ln -s "$outside/secret" "$session/log/$name"
for command in admit check repair; do
  "$skein" "$command" "$session" >"$workspace/said" 2>&1 || true
  grep -q '\\x1b\[2J\\x0asession.json' "$workspace/said" || fail "skein $command does not name the file: $(cat -v "$workspace/said")"
  ! grep -q $'[\033\007]\|^session.json' "$workspace/said" || fail "skein $command steers the terminal: $(cat -v "$workspace/said")"
done

# A file that takes no room on the disk, and much where it is read as one.
copy_own
mkdir -p "$session/retrieval" && truncate -s 1200M "$session/retrieval/hnsw.bin"
mkdir -p "$session/uploads/alice" && truncate -s 1200M "$session/uploads/alice/$(printf '0%.0s' {1..64}).photo"
peak_kb=$(python3 -c 'import resource, subprocess, sys
subprocess.run(sys.argv[2:], stdout=open(sys.argv[1], "w"), timeout=100)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)' "$workspace/said" "$skein" check "$session" 2>/dev/null)
((peak_kb < 800000)) || fail "skein check took $peak_kb kB for sparse files"
grep -q '^retrieval/hnsw.bin: is damaged' "$workspace/said" && grep -q '^uploads/alice/0.*: is damaged' "$workspace/said" ||
  fail "skein check, sparse files: $(cat "$workspace/said")"

# Row 4: FIFOs. Nobody writes to them: who opens one waits for ever.
for file in images/alice/1.jpg report.json session.json keys/root.key keys/revoked ledger.db ledger.db-wal sparse/0/images.bin \
  log/ingest.log run/launch.lock retrieval/hnsw.bin results.sha256; do
  copy_own
  mkdir -p "$session/$(dirname "$file")"
  rm -f "$session/$file"
  mkfifo "$session/$file"
  expect_refused "$file as a FIFO"
  timeout 20 "$skein" check "$session" >"$workspace/check" 2>&1 && fail "skein check calls $file, a FIFO, whole"
  [[ $? != 124 ]] || fail "skein check waits for $file"
  grep -q "^$file: is a FIFO" "$workspace/check" || fail "skein check does not name $file: $(cat "$workspace/check")"
done
copy_own
mkfifo "$workspace/fifo.toml"
timeout 10 "${launch[@]}" --session "$session" --config "$workspace/fifo.toml" 2>"$workspace/refused" && fail "--config took a FIFO"
[[ $? == 2 ]] && grep -q 'is no file' "$workspace/refused" || fail "--config, a FIFO: $(cat "$workspace/refused")"
timeout 10 "$SKEIN_BUILD/bin/skein-mapper" --session "$session" --config "$workspace/fifo.toml" 2>"$workspace/refused" && fail "a mapper took a FIFO"
grep -q 'not a regular file' "$workspace/refused" || fail "a mapper's --config, a FIFO: $(cat "$workspace/refused")"
echo "FIFOs are refused"

# `skein view` gives nothing from elsewhere, and waits for nothing.
copy_own
ln -s "$outside/secret" "$session/report.json"
"$skein" view "$session" --port 8499 >"$workspace/view.log" 2>&1 &
view=$!
wait_until 20 "the view answers" curl -sf -o /dev/null http://127.0.0.1:8499/api/session
[[ $(curl -s -o "$workspace/answer" -w '%{http_code}' http://127.0.0.1:8499/api/report) == 404 ]] || fail "a link is served as the report"
! grep -q secret "$workspace/answer" || fail "the view gives what the link leads to"
rm "$session/report.json" && mkfifo "$session/report.json"
[[ $(curl -s -m 10 -o /dev/null -w '%{http_code}' http://127.0.0.1:8499/api/report) == 404 ]] || fail "a FIFO as the report is waited for"
kill "$view"
timeout 20 "$skein" repair "$session" >"$workspace/repair" || fail "skein repair: $(cat "$workspace/repair")"
grep -q 'report.json, a FIFO, is removed' "$workspace/repair" || fail "skein repair does not tell: $(cat "$workspace/repair")"
"$skein" check "$session" >/dev/null || fail "the session is not whole after its repair"

# `skein clone` copies no file from elsewhere, though checksums fit.
copy_own
echo '{}' >"$outside/secret"
mkdir -p "$session/sparse"
ln -s "$outside/secret" "$session/report.json"
(cd "$session" && sha256sum report.json >results.sha256)
mkdir -p "$session/uploads" && ln -s "$outside" "$session/uploads/alice"
timeout 20 "$skein" clone "$session" "$workspace/clone" >"$workspace/clone.log" 2>&1 || fail "skein clone: $(cat "$workspace/clone.log")"
[[ -z $(find "$workspace/clone" -not -type f -not -type d) && ! -e $workspace/clone/report.json && ! -e $workspace/clone/uploads/alice/secret ]] ||
  fail "the clone holds what the links lead to"
rm -rf "$workspace/clone"
reset_outside

# Row 2: keys that were made elsewhere. Its sender has an operator's pass for it.
rm -rf "$session" && cp -a "$sent" "$session"
timeout 20 "${launch[@]}" --session "$session" 2>"$workspace/refused" && fail "keys of another host were taken"
grep -q 'skein clone' "$workspace/refused" && grep -q -- '--adopt' "$workspace/refused" || fail "unclear refusal: $(cat "$workspace/refused")"
"$skein" invite --session "$session" --role agent --lcm-url tcpq://127.0.0.1:7700 >/dev/null 2>"$workspace/refused" && fail "an invitation by foreign keys"
grep -q 'skein clone' "$workspace/refused" || fail "unclear refusal of an invitation: $(cat "$workspace/refused")"
"$skein" check "$session" >/dev/null || fail "a sent session is whole"
"$skein" clone "$session" "$workspace/clone" >/dev/null || fail "a sent session is cloned"
[[ ! -e $workspace/clone/keys ]] || fail "a clone has the sender's keys"
start_services "$workspace/clone" "$url" --mappers 1 --web 0 --guide off >"$workspace/launch.log" 2>&1
stop_services
mv "$sent" "$workspace/elsewhere" # as on its sender's host: beside a session no copy of it runs
start_services "$session" "$url" --mappers 1 --web 0 --guide off --adopt >"$workspace/launch.log" 2>&1
stop_services
grep -q 'the session is adopted' "$workspace/launch.log" || fail "launch.sh does not tell that it adopted: $(cat "$workspace/launch.log")"
! cmp -s "$workspace/elsewhere/keys/root.key" "$session/keys/root.key" || fail "the sender's root is still there"
cmp -s "$workspace/elsewhere/keys/root.key" "$session/damaged/keys/root.key" || fail "the sender's keys are not in damaged/"
start_services "$session" "$url" --mappers 1 --web 0 --guide off >"$workspace/launch.log" 2>&1 # it is our own now
stop_services
mv "$session" "$workspace/moved"
start_services "$workspace/moved" "$url" --mappers 1 --web 0 --guide off >"$workspace/launch.log" 2>&1
stop_services
echo "keys of another host are refused, cloned without, or adopted"

# A folder that leads to another host, with keys or without: no command goes there, no link names it.
copy_own
echo tcpq://203.0.113.7:7700 >"$session/run/lcm_url"
echo https://203.0.113.7:8471 >"$session/run/web_public"
for keys in kept removed; do
  [[ $keys == kept ]] || rm -rf "$session/keys"
  timeout 20 "$skein" status --session "$session" --once >"$workspace/said" 2>&1 && fail "skein status follows a sent run/lcm_url, keys $keys"
  grep -q 'not written by skein launch of this user' "$workspace/said" || fail "skein status, a sent run/lcm_url: $(cat "$workspace/said")"
  for options in "" --browser "--lcm-url $url --qr"; do
    "$skein" invite --session "$session" --role agent $options >"$workspace/said" 2>"$workspace/refused" || true
    ! grep -q 203.0.113.7 "$workspace/said" || fail "skein invite $options, keys $keys: a link to another's host"
    grep -q 'not written by skein launch of this user' "$workspace/refused" || fail "skein invite $options: $(cat "$workspace/refused")"
  done
done
copy_own
[[ $(head -n 1 "$session/run/lcm_url") == "$url" ]] || fail "launch.sh does not note its URL"
echo "a folder leads to no other host"

# `skein scale` starts workers by the shell, which writes their logs and process ids to run/scale.
for entry in run/scale/w123.log run/scale/lock run/scale; do
  copy_own
  mkdir -p "$session/$(dirname "$entry")"
  ln -s "$outside/bashrc" "$session/$entry"
  before=$(outside_state)
  timeout 20 "$skein" scale --session "$session" --lcm-url "$url" --max 1 >"$workspace/said" 2>&1 && fail "skein scale goes by $entry, a link"
  grep -q 'is a symbolic link, which a session does not hold' "$workspace/said" || fail "skein scale, $entry: $(cat "$workspace/said")"
  [[ $(outside_state) == "$before" ]] || fail "skein scale, $entry: something outside of the folder was changed"
done
echo "skein scale goes by no link"

# Row 5: a ledger that does more than hold facts.
copy_own
sqlite3 "$session/ledger.db" 'CREATE TRIGGER t AFTER INSERT ON facts BEGIN DELETE FROM facts; END'
facts=$(sqlite3 "$session/ledger.db" 'SELECT COUNT(*) FROM facts')
"$skein" check "$session" >"$workspace/check" && fail "skein check calls a ledger with a trigger whole"
grep -q 'holds a trigger that Skein did not make' "$workspace/check" || fail "skein check: $(cat "$workspace/check")"
"$skein" repair "$session" >"$workspace/repair" || fail "skein repair: $(cat "$workspace/repair")"
[[ $(sqlite3 "$session/ledger.db" "SELECT COUNT(*) FROM sqlite_master WHERE type = 'trigger'") == 0 ]] || fail "the trigger is still there"
(($(sqlite3 "$session/ledger.db" 'SELECT COUNT(*) FROM facts') == facts)) || fail "facts went with the trigger"
echo "a ledger with a trigger is refused and repaired"

# launch.sh obeys at once, also while it starts, and reads no more of a file than it needs.
truncate -s 1T "$own/run/mapper-9.pid"
"${launch[@]}" --session "$own" >"$workspace/launch.log" 2>&1 &
launch_pid=$!
wait_until 20 "ingest is started" test -e "$own/run/ingest.pid"
begin=$SECONDS
kill -TERM "$launch_pid"
wait "$launch_pid" || true
launch_pid=''
((SECONDS - begin <= 5)) || fail "launch.sh took $((SECONDS - begin)) s to obey SIGTERM"
[[ -z $(pgrep -f "SKEIN_RUN_FOLDER=$own/run|--session $own" || true) ]] || fail "processes stayed"
