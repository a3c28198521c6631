#!/usr/bin/env bash
# Engine of `skein scale`: workers on this host. A job is a process, noted in $SKEIN_SCALE_FOLDER/WORKER.pid.
# clients/scale/engine.h tells what an engine does.
source "$(dirname "$0")/../lib.sh"

# pid_of WORKER: of its running job
pid_of() {
  local pid
  pid=$(head -c 20 -- "$SKEIN_SCALE_FOLDER/$1.pid" 2>/dev/null | tr -d '\0') && [[ $pid =~ ^[0-9]+$ ]] || return 1
  tr '\0' '\n' 2>/dev/null <"/proc/$pid/cmdline" | grep -Fx -- "$1" >/dev/null && echo "$pid"
}

case $1 in
  list)
    for file in "$SKEIN_SCALE_FOLDER"/*.pid; do
      worker=$(basename "$file" .pid)
      if pid_of "$worker" >/dev/null; then echo "$worker running"; else rm -f "$file"; fi
    done
    ;;
  submit)
    batch=$2 links=$(cat) line=0
    shift 2
    [[ ${1:-} == -- ]] || { [[ -z ${1:-} ]] || die "--job-option $1: this engine has none"; }
    shift
    while ((++line <= $(wc -l <<<"$links"))); do
      worker=$batch-$line
      setsid "$SKEIN_ROOT/scripts/worker_job.sh" "$worker" "$line" "$@" <<<"$links" >"$SKEIN_SCALE_FOLDER/$worker.log" 2>&1 &
      echo $! >"$SKEIN_SCALE_FOLDER/$worker.pid"
    done
    ;;
  cancel)
    shift
    for worker in "$@"; do
      pid=$(pid_of "$worker") && kill -TERM "$pid" 2>/dev/null || true
    done
    ;;
  *) usage_error "list, submit or cancel" ;;
esac
