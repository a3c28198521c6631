# `skein scale` in tests: source it after session.sh. Wants `workspace`, `session` and `url`.

# start_scale [OPTION...]: in the background, its words in $workspace/scale.log; sets scale_pid
start_scale() {
  "$SKEIN_BUILD/bin/skein" scale --session "$session" --lcm-url "$url" "$@" >"$workspace/scale.log" 2>&1 &
  scale_pid=$!
}

stop_scale() {
  kill -TERM "$scale_pid"
  wait "$scale_pid" || fail "skein scale ended by SIGTERM: exit code $?: $(<"$workspace/scale.log")"
}

status_of_scale() {
  "$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url" 2>/dev/null |
    jq -r '.instances[] | select(.service == "scale" and .silent_s < 5) | .state'
}
# scale_tells REGEX: in `skein status`
scale_tells() { status_of_scale | grep -E -- "$1" >/dev/null; }
# hears_workers NUMBER: with features, not counting what has been silent for 3 s
hears_workers() {
  (($("$SKEIN_BUILD/bin/skein" status --once --json --session "$session" --lcm-url "$url" 2>/dev/null |
    jq '[.instances[] | select((.instance | test("^w[0-9a-f]+-[0-9]+[.]")) and .service == "features" and .silent_s < 3)] | length') == $1))
}
scale_says() { grep -qE -- "$1" "$workspace/scale.log"; }
