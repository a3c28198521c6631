#!/usr/bin/env bash
# `cmake --install` to a folder with a blank in its name: everything is found beside the programs while the checkout and the
# build are hidden. `skein launch`, `reconstruct` and `demo` are the scripts: exit codes and signals are theirs. A service
# manager hears when launch.sh is ready.
source "$(dirname "$0")/../harness.sh"
enter_network_namespace "$@"
[[ -e $SKEIN_BUILD/web/index.html ]] || skip "the page is not built (scripts/setup.sh gets node and the packages)"
[[ -n $IN_NAMESPACE ]] || skip "the checkout cannot be hidden here"
new_workspace
prefix="$workspace/a prefix"
export HOME=$workspace/home XDG_CACHE_HOME=$workspace/cache
mkdir -p "$HOME" "$workspace/fakes"

"$SKEIN_BUILD/bin/skein" launch --help | grep -F 'skein launch --session DIR [options]' >/dev/null ||
  fail "skein launch --help in the build tree"
"$SKEIN_BUILD/bin/skein" demo --help | grep -F "build/demo/session" >/dev/null || fail "skein demo --help in the build tree"
cmake --install "$SKEIN_BUILD" --prefix "$prefix" >"$workspace/install.log" || fail "cmake --install: $(tail -n 3 "$workspace/install.log")"
[[ $("$prefix/bin/skein" --version) == $("$SKEIN_BUILD/bin/skein" --version) ]] || fail "another version was installed"

cd "$workspace"
mount -t tmpfs none "$SKEIN_BUILD"
mount -t tmpfs none "$SKEIN_ROOT"
[[ ! -e $SKEIN_ROOT/scripts ]] || fail "the checkout is not hidden"
unset SKEIN_BUILD SKEIN_ROOT
skein=$prefix/bin/skein

# exits CODE COMMAND...
exits() {
  local status=0 wanted=$1
  shift
  "$@" >"$workspace/said" 2>&1 || status=$?
  ((status == wanted)) || fail "$*: exit code $status, not $wanted: $(<"$workspace/said")"
}
exits 2 "$skein" launch --nonsense
grep -qFx 'skein launch: unknown option --nonsense; see skein launch --help' "$workspace/said" || fail "$(<"$workspace/said")"
exits 2 "$skein" reconstruct --session "$workspace/none"
exits 2 "$skein" demo --photos few

"$skein" demo --photos 6 >"$workspace/demo.log" 2>&1 || fail "skein demo: $(tail -n 20 "$workspace/demo.log")"
grep -q '^photos: 18 received' "$workspace/demo.log" || fail "$(grep ^photos "$workspace/demo.log")"
session=$workspace/cache/skein/demo/session
[[ -s $session/model.png ]] || fail "no picture of the model"
grep -qF "== in a browser: ${prefix/ /\\ }/lib/skein/bin/skein view" "$workspace/demo.log" || fail "$(grep browser "$workspace/demo.log")"

# Found on the path it is `skein`; its signals are the script's; --ready comes after the services are.
cat >"$workspace/fakes/systemd-notify" <<'FAKE'
#!/bin/sh
echo "$NOTIFY_SOCKET $*" >>"$HOME/notified"
FAKE
chmod +x "$workspace/fakes/systemd-notify"
export PATH=$workspace/fakes:$prefix/bin:$PATH
NOTIFY_SOCKET=/run/fake WATCHDOG_USEC=2000000 skein launch --session "$session" --web 8470 >"$workspace/launch.log" 2>&1 &
launch=$!
told() { grep -q -- "$1" "$HOME/notified" 2>/dev/null; }
wait_until 60 "the service manager hears that all are ready" told '^/run/fake --ready'
[[ -e $session/run/merger.alive ]] || fail "ready before the services are"
grep -q '^== watch:  skein status' "$workspace/launch.log" || fail "$(<"$workspace/launch.log")"
curl -fsS --max-time 5 http://127.0.0.1:8470/ | grep -i '<html' >/dev/null || fail "the page is not found"
! tr '\0' '\n' <"/proc/$(<"$session/run/web.pid")/environ" | grep '^NOTIFY_SOCKET' || fail "a service may speak for launch.sh"
wait_until 10 "the watchdog hears launch.sh" told WATCHDOG=1
kill -TERM "$launch"
wait "$launch" || fail "skein launch ended by SIGTERM: exit code $?"
[[ -z $(find "$session/run" -name '*.pid') ]] || fail "processes are left: $(ls "$session/run")"
told STOPPING=1 || fail "the service manager does not hear of the end"
