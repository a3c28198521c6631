#!/usr/bin/env bash
# run_limited.sh LIMIT_S SCRIPT [ARGUMENT...]: runs a test script that is told to end (SIGTERM) when it
# runs out of time, while ctest would kill it: so it stops its services and shows their logs.
# Exit code: the script's; 1 when it ran out of time.
source "$(dirname "$0")/harness.sh"
limit=$1
shift
timeout --kill-after=20 "$limit" bash "$@" &
trap 'kill "$!"' INT TERM HUP
while kill -0 "$!" 2>/dev/null; do # a signal ends a wait
  status=0
  wait "$!" || status=$?
done
((status != 124 && status != 137)) || fail "${1##*/} ran out of time: not done within $limit s"
exit "$status"
