#!/usr/bin/env bash
# launch.sh itself, with stand-ins for the services that only say that they are ready: restarts
# what dies, tells it how it died, refuses a second launch, takes over from a killed one, stops all.
source "$(dirname "$0")/../harness.sh"
new_workspace

mkdir -p "$workspace/bin"
cat >"$workspace/bin/skein-ingest" <<'SERVICE'
#!/usr/bin/env bash
while (($#)); do [[ $1 != --instance ]] || instance=$2; shift; done
trap 'exit 0' TERM
echo "died of ${SKEIN_PREVIOUS_EXIT_SIGNAL:-nothing}"
echo "ready $instance"
while :; do sleep 0.05; done
SERVICE
chmod +x "$workspace/bin/skein-ingest"
for service in features retrieval matching mapper merger; do
  ln -s skein-ingest "$workspace/bin/skein-$service"
done
SKEIN_BUILD=$workspace
session=$workspace/session
running() { pgrep -fc "$workspace/bin/skein-" || true; }
pid_of() { cat "$session/run/$1.pid" 2>/dev/null || true; }
is_restarted() { [[ -n $(pid_of "$1") && $(pid_of "$1") != "$2" ]]; }
none_runs() { [[ $(running) == 0 ]]; }

start_services "$session" udpm://239.255.76.67:7667?ttl=0 --features 2 --mappers 2 --max-size 800
[[ $(ls "$session"/run/*.pid | wc -l) == 8 ]] || fail "expected 8 services: $(ls "$session/run")"
tr '\0' ' ' <"/proc/$(pid_of features-2)/cmdline" | grep -q -- '--max-size 800 ' || fail "features-2 does not know of --max-size"
tr '\0' ' ' <"/proc/$(pid_of matching-1)/cmdline" | grep -q -- '--max-size' && fail "only features take --max-size"

"$SKEIN_ROOT/scripts/launch.sh" --session "$session" --build "$workspace" 2>"$workspace/second" &&
  fail "a second launch on the session was not refused"
grep -q 'another launch.sh' "$workspace/second" || fail "unclear refusal: $(cat "$workspace/second")"

old=$(pid_of merger)
kill -9 "$old"
wait_until 10 "the merger is started again" is_restarted merger "$old"
wait_until 10 "the new merger knows of the signal" grep -q 'died of 9' "$session/log/merger.log"

kill -9 "$launch_pid"
wait "$launch_pid" 2>/dev/null || true
wait_until 10 "the services die with their launcher" none_runs
start_services "$session" udpm://239.255.76.67:7667?ttl=0
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
