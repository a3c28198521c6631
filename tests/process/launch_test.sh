#!/usr/bin/env bash
# launch.sh itself, with stand-ins for the services that only say that they are ready: restarts
# what dies or hangs, on a full disk, too, tells it how it died, grows and shrinks the mappers, refuses a second launch, takes over
# from a killed one, waits for the relays of a host it joins, tells why a service does not come up, bears signals to its
# group, stops all.
source "$(dirname "$0")/../harness.sh"
enter_network_namespace "$@" # for a small disk
new_workspace
relay=$SKEIN_BUILD/bin/skein-relay

mkdir -p "$workspace/bin"
cat >"$workspace/bin/skein-ingest" <<'SERVICE'
#!/usr/bin/env bash
while (($#)); do
  case $1 in
    --instance) instance=$2 ;;
    --session) session=$2 ;;
    --retire-after) elastic=1 ;;
    --config) echo "config $2" ;;
  esac
  shift
done
trap 'exit 0' TERM
echo "died of ${SKEIN_PREVIOUS_EXIT_SIGNAL:-nothing}"
echo "ready $instance"
while [[ -z ${elastic:-} || ! -e $session/retire ]]; do touch "$SKEIN_ALIVE_FILE"; sleep 0.05; done
SERVICE
chmod +x "$workspace/bin/skein-ingest"
for service in features retrieval matching mapper merger guide dense web; do
  ln -s skein-ingest "$workspace/bin/skein-$service"
done
# `skein demand`: says what the test has written for it. `skein admit` and `launched` are the real one.
cat >"$workspace/bin/skein" <<DEMAND
#!/usr/bin/env bash
[[ \$1 != admit && \$1 != launched ]] || exec "$SKEIN_BUILD/bin/skein" "\$@"
DEMAND
cat >>"$workspace/bin/skein" <<'DEMAND'
while (($#)); do
  case $1 in
    --instance) echo "ready $2" ;;
    --session) session=$2 ;;
  esac
  shift
done
trap 'exit 0' TERM
said=''
while :; do
  says=$(cat "$session/says" 2>/dev/null)
  [[ $says == "$said" ]] || echo "$says"
  said=$says
  touch "$SKEIN_ALIVE_FILE"
  sleep 0.05
done
DEMAND
chmod +x "$workspace/bin/skein"
SKEIN_BUILD=$workspace
session=$workspace/session
running() { pgrep -fc "$workspace/bin/skein" || true; }
pid_of() { cat "$session/run/$1.pid" 2>/dev/null || true; }
is_restarted() {
  local now
  now=$(pid_of "$1")
  [[ -n $now && $now != "$2" ]]
}
none_runs() { [[ $(running) == 0 ]]; }

echo '[features]' >"$workspace/my.toml"
start_services "$session" udpm://239.255.76.67:7667?ttl=0 --features 2 --mappers 2 --max-size 800 --hang-after 3 --config "$workspace/my.toml"
for instance in ingest features-2 retrieval matching-1 mapper-2 merger guide dense web; do
  grep -qx "config $workspace/my.toml" "$session/log/$instance.log" || fail "$instance did not get --config"
done
[[ $(ls "$session"/run/*.pid | wc -l) == 11 ]] || fail "expected 11 services: $(ls "$session/run")"
tr '\0' ' ' <"/proc/$(pid_of features-2)/cmdline" | grep -- '--max-size 800 ' >/dev/null || fail "features-2 does not know of --max-size"
tr '\0' ' ' <"/proc/$(pid_of matching-1)/cmdline" | grep -- '--max-size' >/dev/null && fail "only features take --max-size"

"$SKEIN_ROOT/scripts/launch.sh" --session "$session" --build "$workspace" 2>"$workspace/second" &&
  fail "a second launch on the session was not refused"
grep -q 'another skein launch' "$workspace/second" || fail "unclear refusal: $(cat "$workspace/second")"

old=$(pid_of merger)
kill -9 "$old"
wait_until 10 "the merger is started again" is_restarted merger "$old"
wait_until 10 "the new merger knows of the signal" grep -q 'died of 9' "$session/log/merger.log"

# A pause of the whole machine, longer than a process may be silent: nobody is to blame.
everybody() { cat "$session"/run/*.pid | tr '\n' ' '; }
before=$(everybody)
kill -STOP "$launch_pid" $before
sleep 4
kill -CONT $before "$launch_pid"
sleep 2 # four rounds of launch.sh's loop
[[ $(everybody) == "$before" ]] || fail "processes were killed for a pause of the machine"

old=$(pid_of ingest)
kill -STOP "$old"
wait_until 20 "what hangs is killed and started again" is_restarted ingest "$old"
wait_until 10 "the new ingest knows of the signal" grep -q 'died of 9' "$session/log/ingest.log"
stop_services
wait_until 10 "all stop" none_runs

# The clock is set back by an hour while a service waits to be started again.
clock_shim=$(find /usr/lib -name libfaketimeMT.so.1 -print -quit)
if [[ -n $clock_shim ]]; then
  echo '+0' >"$workspace/clock"
  (
    export LD_PRELOAD=$clock_shim FAKETIME_TIMESTAMP_FILE=$workspace/clock FAKETIME_CACHE_DURATION=1 DONT_FAKE_MONOTONIC=1 NO_FAKE_STAT=1
    exec "$SKEIN_ROOT/scripts/launch.sh" --session "$session" --lcm-url udpm://239.255.76.67:7667?ttl=0 --build "$workspace"
  ) >"$workspace/clock.log" 2>&1 &
  launch_pid=$!
  waits_long() { grep -q 'merger ended .* in 3\.2 s' "$workspace/clock.log"; }
  for ((i = 0; i < 5; i++)); do
    wait_until 20 "the merger runs" is_restarted merger "${old:-}"
    old=$(pid_of merger)
    kill -9 "$old"
  done
  wait_until 10 "the merger waits three seconds" waits_long
  echo '-3600' >"$workspace/clock"
  wait_until 20 "the merger is started although the clock was set back" is_restarted merger "$old"
  stop_services
  wait_until 10 "all stop" none_runs
else
  echo "no libfaketime: the clock is not set back"
fi

if [[ -n $IN_NAMESPACE ]]; then
  mkdir "$workspace/disk"
  mount -t tmpfs -o size=1m none "$workspace/disk"
  full_session=$workspace/disk/session
  start_services "$full_session" udpm://239.255.76.67:7667?ttl=0
  old=$(<"$full_session/run/merger.pid")
  keep_full() { # a file that is removed makes room
    while [[ ! -e $workspace/room ]]; do
      dd if=/dev/zero bs=4k >>"$workspace/disk/ballast" 2>/dev/null || sleep 0.01
    done
    rm "$workspace/disk/ballast"
  }
  keep_full &
  filler_pid=$!
  is_full() { ! head -c 8k /dev/zero >"$workspace/disk/more" 2>/dev/null; }
  wait_until 10 "the disk is full" is_full
  kill -9 "$old"
  has_new_merger() { pgrep -f "$workspace/bin/skein-merger" | grep -vx "$old" >/dev/null; }
  wait_until 20 "the merger is started again on a full disk" has_new_merger
  [[ ! -s $full_session/run/merger.pid ]] || fail "the disk is not full"
  touch "$workspace/room"
  wait "$filler_pid"
  is_noted() { [[ -s $full_session/run/merger.pid && $(<"$full_session/run/merger.pid") != "$old" ]]; }
  wait_until 20 "its process id is written once there is room" is_noted
  stop_services
  wait_until 10 "all stop" none_runs
  umount "$workspace/disk"
else
  echo "no mounts may be made here: no disk is filled"
fi

# The elastic pool: told by name which mappers are heard, it starts what is missing, no more than MAX.
mappers() { (cd "$session/run" && ls mapper-*.pid 2>/dev/null | tr '\n' ' '); }
mappers_are() { [[ $(mappers) == "$1" ]]; }
says() { echo "$1" >"$session/next" && mv "$session/next" "$session/says"; }
was_read() { grep -qxF "$1" "$session/log/demand.log"; }
start_services "$session" udpm://239.255.76.67:7667?ttl=0 --mappers 1:3 --guide off --dense off
[[ ! -e $session/run/guide.pid ]] || fail "the guide runs although it is off"
[[ ! -e $session/run/dense.pid ]] || fail "depth maps are made although they are off"
mappers_are 'mapper-1.pid ' || fail "not one mapper at the start: $(mappers)"
says "short 1 of mapper-1"
wait_until 10 "the pool grows" mappers_are 'mapper-1.pid mapper-2.pid '
says "short 2 of mapper-1" # mapper-2 may be one of the two
wait_until 10 "the word is there" was_read "short 2 of mapper-1"
sleep 3 # three turns of launch.sh's loop, each of which would start another
mappers_are 'mapper-1.pid mapper-2.pid ' || fail "grew before mapper-2 was heard: $(mappers)"
says "short 2 of mapper-1 mapper-2"
wait_until 10 "the pool grows to MAX" mappers_are 'mapper-1.pid mapper-2.pid mapper-3.pid '
old=$(pid_of mapper-2)
kill -9 "$old"
wait_until 10 "an elastic mapper that dies is started again" is_restarted mapper-2 "$old"
says "short 0 of mapper-1 mapper-2 mapper-3"
wait_until 10 "the word is there" was_read "short 0 of mapper-1 mapper-2 mapper-3"
touch "$session/retire"
wait_until 10 "idle mappers leave" mappers_are 'mapper-1.pid '
rm "$session/retire"
says "short 1 of mapper-1"
wait_until 10 "the pool grows again" mappers_are 'mapper-1.pid mapper-2.pid '

kill -9 "$launch_pid"
wait "$launch_pid" 2>/dev/null || true
wait_until 10 "the services die with their launcher" none_runs
echo "no process id" >"$session/run/broken.pid"
start_services "$session" udpm://239.255.76.67:7667?ttl=0 2>"$workspace/again"
[[ ! -s $workspace/again ]] || fail "speaks of processes that are gone: $(cat "$workspace/again")"
stop_services
wait_until 10 "all stop" none_runs
[[ -z $(ls "$session"/run/*.pid 2>/dev/null) ]] || fail "pid files are left"

printf '#!/bin/sh\necho no such option >&2\nexit 2\n' >"$workspace/bin/refusing"
chmod +x "$workspace/bin/refusing"
ln -sf refusing "$workspace/bin/skein-merger"
if (start_services "$workspace/other" udpm://239.255.76.67:7667?ttl=0) 2>"$workspace/refused"; then
  fail "started although the merger refuses its options"
fi
grep -q 'merger refused its options: no such option' "$workspace/refused" || fail "unclear: $(cat "$workspace/refused")"
wait_until 10 "nothing is left behind" none_runs

# Why a service does not come up is told at once, with launch.sh's names of its options.
printf '#!/bin/sh\necho "--public-host, --public-port and --plain-port: the address is taken; --port is not"\nexit 1\n' >"$workspace/bin/failing"
chmod +x "$workspace/bin/failing"
ln -sf skein-ingest "$workspace/bin/skein-merger"
ln -sf failing "$workspace/bin/skein-web"
"$SKEIN_ROOT/scripts/launch.sh" --session "$workspace/fails" --lcm-url udpm://239.255.76.67:7667?ttl=0 --build "$workspace" \
  >"$workspace/fails.out" 2>&1 &
launch_pid=$!
wait_until 20 "the reason is on the screen" \
  grep -qE 'web ended \(exit code [0-9]+: --web-public, --web-public-port and --web-plain: the address is taken; --web is not\); it is started again in ' "$workspace/fails.out"
kill -9 "$(<"$workspace/fails/run/retrieval.pid")"
kill -SEGV "$(<"$workspace/fails/run/guide.pid")"
ends_told() { grep -q 'retrieval ended (killed from outside: signal 9, .*; it is started again in 0\.2 s' "$workspace/fails.out" && grep -q 'guide ended (crashed: signal 11)' "$workspace/fails.out"; }
wait_until 10 "how they ended is told" ends_told
(($(grep -c 'retrieval' "$workspace/fails.out") == 1)) && ! grep -qE 'line [0-9]+:|Killed|setpriv' "$workspace/fails.out" || fail "bash's own words are told: $(<"$workspace/fails.out")"
stop_services
wait_until 10 "all stop" none_runs
printf '#!/bin/sh\necho "cannot reach udpm://239.255.76.67:7667: Network is unreachable"\nexit 1\n' >"$workspace/bin/failing"
status=0
"$SKEIN_ROOT/scripts/launch.sh" --session "$workspace/unreachable" --lcm-url udpm://239.255.76.67:7667?ttl=0 --build "$workspace" >"$workspace/unreachable.out" 2>&1 || status=$?
((status == 1)) && [[ $(<"$workspace/unreachable.out") == *': cannot reach udpm://239.255.76.67:7667: Network is unreachable' ]] &&
  (($(wc -l <"$workspace/unreachable.out") == 1)) || fail "without multicast: $status, $(<"$workspace/unreachable.out")"
ln -sf skein-ingest "$workspace/bin/skein-web"

# Two launches find the same port free: the second one to take it goes on to the next.
cat >"$workspace/bin/late" <<LATE
#!/usr/bin/env bash
for ((i = 1; i <= \$#; ++i)); do [[ \${!i} != --port ]] || { ((++i)); port=\${!i}; }; done
[[ -e $workspace/taken_port ]] && exec "$workspace/bin/skein-ingest" "\$@"
python3 -m http.server --bind 127.0.0.1 "\$port" >/dev/null 2>&1 9>&- &
echo \$! >"$workspace/other_pid"
until curl -s -o /dev/null "127.0.0.1:\$port"; do :; done
echo "\$port" >"$workspace/taken_port"
echo "skein-web (web): 127.0.0.1 port \$port is taken: give another one with --port"
exit 1
LATE
chmod +x "$workspace/bin/late"
ln -sf late "$workspace/bin/skein-web"
start_services "$workspace/beside" udpm://239.255.76.67:7667?ttl=0 --web 8470 >"$workspace/beside.out" 2>&1
kill "$(<"$workspace/other_pid")"
[[ $(<"$workspace/taken_port") == 8470 ]] && grep -qx 'view: http://127.0.0.1:8471/' <(sed 's/^== //' "$workspace/beside.out") ||
  fail "the port was taken: $(<"$workspace/beside.out")"
stop_services
ln -sf skein-ingest "$workspace/bin/skein-web"

# A signal to the whole process group, again and again while launch.sh waits for a service and while it stops.
cat >"$workspace/bin/slow" <<'SERVICE'
#!/usr/bin/env bash
trap '' HUP
trap 'stops=1' TERM
for ((rounds = 0; rounds < 60;)); do
  sleep 0.05
  touch "$SKEIN_ALIVE_FILE"
  [[ -z ${stops:-} ]] || ((++rounds))
done
SERVICE
chmod +x "$workspace/bin/slow"
ln -sf slow "$workspace/bin/skein-merger"
setsid "$SKEIN_ROOT/scripts/launch.sh" --session "$workspace/group" --lcm-url udpm://239.255.76.67:7667?ttl=0 --build "$workspace" \
  >"$workspace/group.out" 2>&1 &
launch_pid=$!
wait_until 20 "all are started, and the merger is waited for" test -s "$workspace/group/run/matching-1.pid"
while kill -0 "$launch_pid" 2>/dev/null; do
  kill -HUP -- "-$launch_pid" 2>/dev/null || true
  sleep 0.001 # time in which it gets on
done
wait "$launch_pid" 2>/dev/null || true # at its very end, bash no longer traps a signal
launch_pid=''
# In such a flood bash itself has something to say, too.
! grep -E 'operand expected|not ready' "$workspace/group.out" >/dev/null ||
  fail "launch.sh loses the time on a signal to its group: $(cat "$workspace/group.out")"
wait_until 10 "all stop" none_runs
ln -sf skein-ingest "$workspace/bin/skein-merger"

if [[ -n $IN_NAMESPACE ]]; then
  mkdir -p "$workspace/fixed/session/log" "$workspace/fixed/session/run"
  mount --bind "$workspace/fixed" "$workspace/fixed"
  mount -o remount,bind,ro "$workspace/fixed"
  "$SKEIN_ROOT/scripts/launch.sh" --session "$workspace/fixed/session" --build "$workspace" >"$workspace/fixed.out" 2>&1 &&
    fail "started on a session folder that cannot be written"
  [[ $(<"$workspace/fixed.out") == "launch.sh: cannot write to $workspace/fixed/session: Read-only file system" ]] ||
    fail "unclear: $(cat "$workspace/fixed.out")"
  umount "$workspace/fixed"
fi

# A link that somebody sent names workers, not commands.
for link in 'skein://127.0.0.1:7700/udpm-0/0123456789abcdef/worker/$(touch${IFS}run)/code' \
  'skein://$(touch${IFS}run)/udpm-0/0123456789abcdef/worker/name/code' 'skein://h:1/tcpq/0123456789abcdef/worker/a[$(touch run)]/code'; do
  status=0
  (cd "$workspace" && echo "$link" >link && exec timeout 20 "$SKEIN_ROOT/scripts/launch.sh" --join @link --session joins --build "$workspace") \
    >"$workspace/link.out" 2>&1 || status=$?
  [[ ! -e $workspace/run ]] || fail "a link's name ran as a command: $link"
  [[ $status == 2 ]] && grep -q 'give the whole link' "$workspace/link.out" || fail "$link: $status, $(cat "$workspace/link.out")"
done

# Workers wait for the relays of the host they join.
port=$((20000 + 2 * ($$ % 5000)))
"$SKEIN_ROOT/scripts/launch.sh" --join 1 --session "$workspace/joins" --lcm-url "tcpq://127.0.0.1:$port" \
  --build "$workspace" --ready-file "$workspace/joined" >"$workspace/joins.out" 2>&1 &
launch_pid=$!
wait_until 20 "it says what it waits for" grep -q "waiting for the relay on 127.0.0.1:$port" "$workspace/joins.out"
none_runs || fail "started before there is a relay"
"$relay" "$port" $((port + 1)) >/dev/null 2>&1 &
wait_until 20 "the workers join" test -s "$workspace/joined"
[[ ! -e $workspace/joins/run/lcm_url ]] || fail "a folder of workers is noted as a session"
stop_services

# The link is the role: a file that lay there for all to read does not get it.
rm "$workspace/joined"
(umask 022 && echo sent >"$workspace/joins/run/invitation")
"$SKEIN_ROOT/scripts/launch.sh" --join "skein://127.0.0.1:$port/tcpq/0123456789abcdef/worker/name/code" --session "$workspace/joins" \
  --build "$workspace" --ready-file "$workspace/joined" >"$workspace/joins.out" 2>&1 &
launch_pid=$!
wait_until 20 "the workers join by a link" test -s "$workspace/joined"
grep -q '^skein://' "$workspace/joins/run/invitation" || fail "no link in run/invitation"
[[ $(stat -c %a "$workspace/joins/run/invitation") == 600 ]] || fail "others can read run/invitation"
stop_services
wait_until 10 "all stop" none_runs
