#!/usr/bin/env bash
# Engine of `skein scale`: workers as an array of Slurm jobs, named skein-SESSION-BATCH. A job's output is
# /tmp/skein-SESSION-BATCH-NUMBER.log on its node, unless --job-option --output=FILE says otherwise.
# clients/scale/engine.h tells what an engine does.
source "$(dirname "$0")/../lib.sh"

for command in sbatch squeue scancel; do
  command -v "$command" >/dev/null ||
    { warn "no command $command: install Slurm's commands on this host (slurm-client), or take --engine local"; exit 2; }
done
jobs=skein-$SKEIN_SESSION_ID-

# Lines "JOB_TASK WORKER STATE REASON" of this session's jobs.
queue() { squeue --me -h -r -o '%F_%K %j-%K %T %r' | sed -n "s/^\([^ ]*\) $jobs/\1 /p"; }

case $1 in
  list)
    queue | while read -r _ worker state reason; do
      case $state in
        PENDING | CONFIGURING | SUSPENDED | REQUEUED) echo "$worker waiting $reason" ;;
        RUNNING) echo "$worker running" ;;
      esac
    done
    ;;
  submit)
    batch=$2 options=() links=$(cat)
    shift 2
    while [[ $1 != -- ]]; do options+=("$1"); shift; done
    shift
    printf -v launch ' %q' "$@"
    sbatch --parsable --job-name="$jobs$batch" --array="1-$(wc -l <<<"$links")" --ntasks=1 --cpus-per-task="$SKEIN_WORKER_CORES" \
      --no-requeue --chdir=/ --output=/tmp/%x-%a.log "${options[@]}" >/dev/null <<JOB
#!/bin/bash
exec $(printf %q "$SKEIN_ROOT/scripts/worker_job.sh") $batch-\$SLURM_ARRAY_TASK_ID \$SLURM_ARRAY_TASK_ID$launch <<'LINKS'
$links
LINKS
JOB
    ;;
  cancel)
    shift
    listed=$(queue)
    mapfile -t ids < <(awk 'NR == FNR { wanted[$1]; next } $2 in wanted { print $1 }' <(printf '%s\n' "$@") - <<<"$listed")
    ((!${#ids[@]})) || scancel "${ids[@]}"
    ;;
  *) usage_error "list, submit or cancel" ;;
esac
