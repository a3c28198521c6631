#!/usr/bin/env bash
# The job of one worker of `skein scale`: launch.sh --join in a folder of its own, which goes with it.
#
#   scripts/worker_job.sh WORKER LINE [launch.sh's options...]
#
# WORKER is its name. Its invitation is line LINE of the input: no list of processes shows it.
# Exit codes: those of launch.sh.
source "$(dirname "$0")/lib.sh"

(($# >= 2)) || { [[ ${1:-} =~ ^(-h|--help)$ ]] && { print_help; exit 0; }; usage_error "give WORKER and LINE"; }
worker=$1 line=$2
shift 2
[[ -d ${TMPDIR:-} ]] || TMPDIR=/tmp
work=$(mktemp -d "$TMPDIR/skein-$worker.XXXXXX")
trap 'rm -rf "$work"' EXIT
(umask 077 && sed -n "${line}p" >"$work/invitation")

exec {never}<> <(:) # a pipe into which nobody writes
"$SKEIN_ROOT/scripts/launch.sh" --join "@$work/invitation" --session "$work/session" "$@" </dev/null &
launch=$!
trap 'kill -TERM "$launch" 2>/dev/null || true' INT TERM
# Looks instead of waiting: launch.sh, pause, tells why.
while kill -0 "$launch" 2>/dev/null; do read -r -t 0.1 -u "$never" || true; done
status=0
wait "$launch" || status=$?
((status == 0)) || tail -n 3 "$work"/session/log/*.log 2>/dev/null || true
exit "$status"
