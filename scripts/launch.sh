#!/usr/bin/env bash
# Starts Skein's services on a session folder, restarts what dies or hangs, and stops all on Ctrl-C.
#
#   scripts/launch.sh --session DIR [options]
#   scripts/launch.sh --join LINK --session DIR [options]
#
#   --session DIR   session folder; one that exists goes on where it stopped
#   --adopt         take a session whose keys were made by somebody else or on another host: new keys
#                   are made, and all invitations end (docs/exchange.md)
#   --join LINK     only workers (features, matching, mappers) for a session on another host, where
#                   `skein invite --session DIR --role worker` prints the link, or @FILE with it; DIR then holds nothing
#                   but their logs. Without signatures the session's id, with --auth off and --lcm-url
#   --lcm-url URL   default: $LCM_DEFAULT_URL, else udpm://239.255.76.67:7667?ttl=0. For a tcpq:// or
#                   tcpqs:// (encrypted) URL on this host the two relays (port and port + 1) are started
#                   too; with tcpqs://, port + 2 is open on this host alone, for lcm-spy and lcm-logger
#   --auth MODE     messages without a signature: off (nothing is signed), warn (may offer photos and
#                   read) or require (refused); default: require where the URL leaves this host, else warn
#   --config FILE   options of the services, a section each; `skein config` prints such a file with
#                   the defaults. What is given here as an option goes first
#   --features N    feature extractors (default: a quarter of the cores, at least 1)
#   --matching N    matchers (default: half of the cores, at least 1)
#   --mappers MIN:MAX  mappers: MIN always, one more whenever a submap waits and none is idle, up to
#                   MAX; those leave again when they have been idle for 10 s. At MAX, submaps share a
#                   mapper in turn. N: always N. Default 1:16. Every host may have such a pool
#   --top-n N       candidates of a photo (default 200: 30 to be matched, further ones for photos with few overlaps)
#   --no-second-look  match with all candidates in retrieval's order, for comparison
#   --no-merge      leave the submaps apart, for comparison
#   --no-background-ba  mappers refine the whole map in turn with registration, for comparison
#   --threads N     threads of each service (default: half of the cores, at least 2 where there are 2)
#   --max-size PX   longest side at which features are found (default 1600)
#   --dense on|off  makes depth maps and dense points while photos are placed (default on)
#   --guide on|off  tells how complete each place is and what to photograph next (default on)
#   --target-gsd MM  millimetres of the surface that a pixel may cover, for what is told of completeness
#                   where GPS gives the scale (default: twice that of the median point)
#   --web PORT      the live view, in a browser of this host (default 8470; the next free one where it is
#                   taken; 0: none)
#   --web-public HOST  the live view and the phone's page for others, too, over TLS: HOST is this host's
#                   address or name, as they reach it. Who comes needs an invitation (skein invite)
#   --web-public-port PORT  of these (default 8471; the next free one where it is taken)
#   --web-plain PORT  for them also without encryption, on a network that is yours alone: phones then
#                   need no certificate, but have no camera view. Everyone who hears the network can
#                   take over their invitations
#   --hang-after S  kill and restart a process whose event loop shows no sign of life for S seconds
#                   (default 10; 0: never, for a debugger)
#   --build DIR     build folder (default: build/release)
#   --ready-file F  emptied at the start, written when every service is ready
#   --verbose       services log more
#
# Logs are in DIR/log/INSTANCE.log, what bash itself says in DIR/log/launch.log, process ids in DIR/run/INSTANCE.pid. A process touches
# DIR/run/INSTANCE.alive twice a second.
# Under systemd (Type=notify) it tells when all are ready, and each half of WatchdogSec that it still watches.
# Exit codes: 0 stopped by a signal, 1 a service cannot run, 2 bad usage.
source "$(dirname "$0")/lib.sh"

readonly ready_deadline_s=60 stop_deadline_s=15 healthy_s=60
readonly first_backoff_ms=200 longest_backoff_ms=10000
readonly start_limit_s=120 longest_round_ms=2000

cores=$(nproc)
half=$((cores / 2 > 0 ? cores / 2 : 1)) quarter=$((cores / 4 > 0 ? cores / 4 : 1))
session='' join='' url='' watch_url='' ready_file='' service_options=() config_options=() auth_options=() hang_after_s=10
adopt=()
features=$quarter matching=$half min_mappers=1 max_mappers=16 threads=$((half > 1 || cores == 1 ? half : 2)) features_options=() merger_options=() mapper_options=()
retrieval_options=() matching_options=() guide_options=() web_port=8470 web_host='' web_public_port=8471 web_plain_port=0 guide=on dense=on

need_count() { [[ $2 =~ ^[0-9]+$ ]] || usage_error "$1 needs a number, not '$2'"; }
need_port() { need_count "$1" "$2"; ((10#$2 > 0 && 10#$2 < 65536)) || usage_error "$1 $2: a port is 1 to 65535"; }
# need_range OPTION MIN:MAX|N: sets min_mappers and max_mappers
need_range() {
  [[ $2 =~ ^([0-9]+)(:([0-9]+))?$ ]] || usage_error "$1 needs MIN:MAX or a number, not '$2'"
  min_mappers=$((10#${BASH_REMATCH[1]})) max_mappers=$((10#${BASH_REMATCH[3]:-${BASH_REMATCH[1]}}))
  ((min_mappers <= max_mappers)) || usage_error "$1 $2: MAX is below MIN"
}
while (($#)); do
  case $1 in
    --session | --join | --lcm-url | --auth | --config | --features | --matching | --mappers | --threads | --max-size | --top-n | --build | --ready-file | --hang-after | --dense | --guide | --target-gsd | --web | --web-public | --web-public-port | --web-plain)
      (($# > 1)) || usage_error "$1 needs a value" ;;&
    --session) session=$2; shift ;;
    --adopt) adopt=(--adopt) ;;
    --join) join=$2; [[ $join != @* ]] || join=$(cat -- "${join#@}") || die "--join $2: no such file"; join=${join%%[[:space:]]*}; shift ;;
    --lcm-url) url=$2; shift ;;
    --auth) auth_options=(--auth "$2"); shift ;;
    --config) [[ -f $2 && -r $2 ]] || usage_error "--config: '$2' is no file that can be read"; config_options=(--config "$(realpath "$2")"); shift ;;
    --features) need_count "$1" "$2"; features=$2; shift ;;
    --matching) need_count "$1" "$2"; matching=$2; shift ;;
    --mappers) need_range "$1" "$2"; shift ;;
    --threads) need_count "$1" "$2"; threads=$2; shift ;;
    --max-size) need_count "$1" "$2"; features_options+=(--max-size "$2"); shift ;;
    --hang-after) need_count "$1" "$2"; hang_after_s=$((10#$2)); shift ;;
    --build) SKEIN_BUILD=$2; shift ;;
    --ready-file) ready_file=$2; shift ;;
    --dense) dense=$2; [[ $dense == on || $dense == off ]] || usage_error "--dense needs on or off, not '$dense'"; shift ;;
    --guide) guide=$2; [[ $guide == on || $guide == off ]] || usage_error "--guide needs on or off, not '$guide'"; shift ;;
    --target-gsd) [[ $2 =~ ^[0-9]+(\.[0-9]+)?$ ]] || usage_error "$1 needs millimetres, not '$2'"; mapper_options+=(--target-gsd "$2"); guide_options+=(--target-gsd "$2"); shift ;;
    --web) need_count "$1" "$2"; web_port=$((10#$2)); ((web_port < 65536)) || usage_error "--web $2: a port is at most 65535"; shift ;;
    --web-public) web_host=$2; [[ $web_host =~ ^[A-Za-z0-9.:-]+$ ]] || usage_error "--web-public: give this host's address or name, not '$2'"; shift ;;
    --web-public-port) need_port "$1" "$2"; web_public_port=$((10#$2)); shift ;;
    --web-plain) need_port "$1" "$2"; web_plain_port=$((10#$2)); shift ;;
    --top-n) need_count "$1" "$2"; retrieval_options+=(--top-n "$2"); shift ;;
    --no-second-look) matching_options+=(--no-second-look) ;;
    --no-merge) merger_options+=(--no-merge) ;;
    --no-background-ba) mapper_options+=(--no-background-ba) ;;
    --verbose) service_options+=(--verbose) ;;
    -h | --help) print_help; exit 0 ;;
    *) usage_error "unknown option $1" ;;
  esac
  shift
done
[[ -n $session ]] || usage_error "--session is needed"
if [[ -n $web_host ]]; then
  [[ -z $join ]] || usage_error "--web-public is for the session's host, not for one that joins it"
  ((web_port)) || usage_error "--web-public and --web 0 exclude each other"
  [[ ${auth_options[1]:-} != off ]] || usage_error "--web-public lets in who has an invitation, and with --auth off there are none"
elif ((web_plain_port)); then
  usage_error "--web-plain is for others: give --web-public HOST, too"
fi
bin=$SKEIN_BUILD/bin
[[ -x $bin/skein-ingest ]] || die "no services in $bin: build first (scripts/test.sh or scripts/demo.sh does)"
# Before the first redirection into the folder, which somebody may have sent.
why=$("$bin/skein" admit "$session" "${adopt[@]}" 2>&1) || die "${why#skein admit: }"
[[ -z $why ]] || say "$why"
why=$({ mkdir -p "$session/log" "$session/run" && : >>"$session/run/launch.lock"; } 2>&1) ||
  die "cannot write to $session: ${why##*: }"
session=$(cd "$session" && pwd)

# Not for the services: NotifyAccess=all hears each process of the unit.
notify_socket=${NOTIFY_SOCKET:-} watchdog_period_ms=$((${WATCHDOG_USEC:-0} / 2000)) watchdog_told_ms=0
unset NOTIFY_SOCKET WATCHDOG_USEC WATCHDOG_PID
tell_systemd() { [[ -z $notify_socket ]] || NOTIFY_SOCKET=$notify_socket systemd-notify "$@" || true; }
tell_watchdog() {
  ((watchdog_period_ms > 0)) || return 0
  read_clock
  ((clock_ms - watchdog_told_ms >= watchdog_period_ms)) || return 0
  watchdog_told_ms=$clock_ms
  tell_systemd WATCHDOG=1
}

# What runs, by instance. A command is its words, one a line; due_ms is when to start it (again).
instances=()
declare -A command_of pid_of started_ms backoff_ms due_ms log_offset exit_signal hung_s first_sign last_sign quiet_ms
watched_ms=0 clock_ms=0
# Sets clock_ms, by a clock that nobody sets: what is due in a second would wait an hour after the time is put
# back by one. Without a subshell, which a signal to the process group ends before it has told the time.
read_clock() {
  local up
  read -r up _ </proc/uptime
  clock_ms=$((10#${up/./} * 10))
}

add_instance() {
  local instance=$1
  shift
  instances+=("$instance")
  printf -v "command_of[$instance]" '%s\n' "$@"
  backoff_ms[$instance]=$first_backoff_ms
  due_ms[$instance]=0
}

# Drops an instance that is not to run again.
remove_instance() {
  local instance kept=()
  for instance in "${instances[@]}"; do [[ $instance == "$1" ]] || kept+=("$instance"); done
  instances=("${kept[@]}")
  unset "command_of[$1]"
}

# On a joining host the names of workers have the invitation's or the host's in front, and a number by chance: containers
# share an invitation, each has a process 1, and some have their host's name. The link goes by a file: who lists processes does
# not see it.
# The shell works out what stands in the index of an array, and instances are indices: a name is checked here.
prefix='' where=(--session "$session")
printf -v number %08x "$SRANDOM"
if [[ $join =~ ^skein://([]A-Za-z0-9.:%_[-]+)/(tcpqs?|udpm)(-([0-9]{1,3}))?/[0-9a-f]+/[a-z]+/([A-Za-z0-9_-]+)/[A-Za-z0-9_-]+$ ]]; then
  prefix=${BASH_REMATCH[5]}.$number- where=(--invite "@$session/run/invitation")
  url=${url:-${BASH_REMATCH[2]}://${BASH_REMATCH[1]}${BASH_REMATCH[4]:+?ttl=${BASH_REMATCH[4]}}}
elif [[ $join == skein://* ]]; then
  usage_error "--join: the invitation is cut or damaged; give the whole link"
elif [[ -n $join ]]; then
  prefix=$(hostname | tr -c 'A-Za-z0-9\n' '-')-$number- where=(--session-id "$join")
fi
[[ -z $join ]] || web_port=0
url=${url:-${LCM_DEFAULT_URL:-udpm://239.255.76.67:7667?ttl=0}}
where+=("${auth_options[@]}")

# Features and matching keep all cores busy: photos are placed and maps merged before them. Nor does
# who looks hold them up. The guide bounds its work itself (--work-share), and depth maps are made at the lowest priority.
readonly bulk_niceness=5

add_service() {
  local instance=$1 service=$2 priority=()
  shift 2
  [[ $service != features && $service != matching && $service != web ]] || priority=(nice -n "$bulk_niceness")
  add_instance "$instance" "${priority[@]}" "$bin/skein-$service" "${where[@]}" --lcm-url "$url" \
    --instance "$instance" --threads "$threads" "${config_options[@]}" "${service_options[@]}" "$@"
}

# add_workers SERVICE COUNT [OPTION...]: SERVICE-1, SERVICE-2, ...
add_workers() {
  local i service=$1 count=$2
  shift 2
  for ((i = 1; i <= count; i++)); do add_service "$prefix$service-$i" "$service" "$@"; done
}

source "$SKEIN_ROOT/scripts/mapper_pool.sh"

# is_local_host HOST: an address of this host, or a name that leads to one
is_local_host() {
  local address own
  own=$(ip -o addr show 2>/dev/null) || true
  for address in "$1" $(getent ahosts "$1" | cut -d' ' -f1); do
    [[ ! $address =~ ^(127\..*|localhost|0\.0\.0\.0|)$ && $own != *" $address/"* ]] || return 0
  done
  return 1
}
port_is_open() { timeout 2 bash -c 'exec 3<>"/dev/tcp/$1/$2"' - "$1" "$2" 2>/dev/null; }

# await_relay HOST PORT: one that another launch.sh runs
await_relay() {
  local deadline
  read_clock
  deadline=$((clock_ms + ready_deadline_s * 1000))
  port_is_open "$1" "$2" || say "waiting for the relay on $1:$2"
  until port_is_open "$1" "$2"; do
    ((!interrupted)) || exit 0
    read_clock
    ((clock_ms < deadline)) ||
      die "no relay answers on $1:$2: does skein launch run there with this URL, and does its firewall let the port through?"
    pause 0.2
  done
}

# The relays of a tcpq or tcpqs URL: on this host they are part of the set, unless the set joins another.
add_relays() {
  [[ $url =~ ^tcpq(s?)://([^:/?]*)(:([0-9]+))? ]] || return 0
  local tls=${BASH_REMATCH[1]} host=${BASH_REMATCH[2]:-127.0.0.1} port=${BASH_REMATCH[4]:-7700} relay_port options
  local of_session=(--session "$session" --lcm-url "$url" "${auth_options[@]}")
  [[ ! $host =~ ^(127\..*|localhost)$ ]] || of_session+=(--loopback)
  for relay_port in "$port" $((port + 1)); do
    if [[ -n $join ]] || ! is_local_host "$host"; then
      await_relay "$host" "$relay_port"
      continue
    fi
    if port_is_open "$host" "$relay_port"; then
      say "a relay listens on $host:$relay_port already; where it serves another session, give this one another port"
    elif [[ -x $bin/skein-relay ]]; then
      options=("${of_session[@]}" --instance "relay-$relay_port")
      [[ -z $tls || $relay_port != "$port" ]] || { options+=(--watch-port $((port + 2))); watch_url=tcpq://127.0.0.1:$((port + 2)); }
      add_instance "relay-$relay_port" "$bin/skein-relay" --port "$relay_port" "${options[@]}" "${config_options[@]}"
    elif [[ -n $tls ]]; then
      die "no $bin/skein-relay: LCM's own relay has no TLS; build first, or take a tcpq:// URL"
    else
      add_instance "relay-$relay_port" java -Xmx64m -cp "$(lcm_jar)" lcm.lcm.TCPService "$relay_port"
    fi
  done
}

# note_launched OPTION...: where the session runs, for `skein`, which is given the folder
note_launched() {
  local why
  why=$("$bin/skein" launched "$session" "$@" 2>&1) || warn "${why#skein launched: }"
}

# The live view on the port that was asked for, or the next free one.
add_web() {
  local wanted=$web_port
  ((web_port)) || return 0
  while port_is_open 127.0.0.1 "$web_port"; do
    ((++web_port < 65536)) || die "--web $wanted: no port from there on is free"
  done
  ((web_port == wanted)) || say "port $wanted is taken: the live view is on $web_port"
  [[ -n $web_host ]] || { add_service web web --port "$web_port"; return; }
  # By a name skein-web listens on every address; the name may lead to a balancer that takes connections itself.
  local listens=127.0.0.1
  [[ ! $web_host =~ ^[0-9.]+$|: ]] || listens=$web_host
  wanted=$web_public_port
  while ((web_public_port == web_port || web_public_port == web_plain_port)) || port_is_open "$listens" "$web_public_port"; do
    ((++web_public_port < 65536)) || die "--web-public-port $wanted: no port from there on is free"
  done
  local shown=$web_host
  [[ $web_host != *:* ]] || shown="[$web_host]"
  local addresses=(--browser-address "https://$shown:$web_public_port")
  ((!web_plain_port)) || addresses+=(--browser-address "http://$shown:$web_plain_port")
  note_launched "${addresses[@]}"
  add_service web web --port "$web_port" --public-host "$web_host" --public-port "$web_public_port" --plain-port "$web_plain_port"
}

start_instance() {
  local instance=$1 log=$session/log/$1.log words
  mapfile -t words <<<"${command_of[$instance]%$'\n'}"
  touch "$log"
  touch "$session/run/$instance.alive" 2>/dev/null || true
  first_sign[$instance]=$(stat -c %.9Y "$session/run/$instance.alive" 2>/dev/null) || true
  last_sign[$instance]='' quiet_ms[$instance]=0
  log_offset[$instance]=$(stat -c %s "$log") || log_offset[$instance]=0
  # The child dies with this script, however that ends.
  OMP_NUM_THREADS=$threads OPENBLAS_NUM_THREADS=1 SKEIN_PREVIOUS_EXIT_SIGNAL=${2:-} SKEIN_RUN_FOLDER=$session/run \
    SKEIN_ALIVE_FILE=$session/run/$instance.alive SKEIN_STEP_FILE=$session/run/$instance.step \
    setpriv --pdeathsig TERM -- "${words[@]}" >>"$log" 2>&1 9>&- {terminal}>&- &
  pid_of[$instance]=$!
  read_clock
  started_ms[$instance]=$clock_ms
  due_ms[$instance]=0
  note_pid "$instance"
}

# Where the disk is full, supervise does so once there is room.
note_pid() {
  local noted=''
  { read -r noted <"$session/run/$1.pid"; } 2>/dev/null || true
  [[ $noted == "${pid_of[$1]}" ]] || { echo "${pid_of[$1]}" >"$session/run/$1.pid"; } 2>/dev/null || true
}

is_ready() {
  local instance=$1
  case $instance in
    relay-*) port_is_open 127.0.0.1 "${instance#relay-}" ;;
    *) tail -c "+$((${log_offset[$instance]} + 1))" "$session/log/$instance.log" | grep -x "ready $instance" >/dev/null ;;
  esac
}

# last_words INSTANCE [LINES]: what it logged last since it was started. Options of skein-web have launch.sh's names.
last_words() {
  local names=()
  [[ $1 != web ]] || names=(-e 's/--public-host\b/--web-public/g' -e 's/--public-port\b/--web-public-port/g'
    -e 's/--plain-port\b/--web-plain/g' -e 's/--port\b/--web/g')
  tail -c "+$((${log_offset[$1]} + 1))" "$session/log/$1.log" | tail -n "${2:-1}" | sed "${names[@]}" -e ''
}

# how_it_ended INSTANCE STATUS: for a person, on one line
how_it_ended() {
  local status=$2 signal=$((${2} - 128)) words
  if ((status <= 128)); then
    words=$(last_words "$1") || true
    echo "exit code $status${words:+: $words}"
  elif [[ -n ${hung_s[$1]:-} ]]; then
    echo "killed, as it showed no sign of life for ${hung_s[$1]} s"
  else
    case $signal in
      4 | 6 | 7 | 8 | 11) echo "crashed: signal $signal" ;;
      9) echo "killed from outside: signal 9, as the system does where memory is short" ;;
      *) echo "signal $signal" ;;
    esac
  fi
}

# A child that died: note how, and when to start it again.
note_death() {
  local instance=$1 status=0 uptime_ms wait_ms
  wait "${pid_of[$instance]}" || status=$?
  read_clock
  uptime_ms=$((clock_ms - ${started_ms[$instance]}))
  unset "pid_of[$instance]"
  rm -f "$session/run/$instance.pid" || true
  ((!stopping && !interrupted)) || return 0
  if ((status == 0)) && is_elastic "$instance"; then
    say "$instance leaves: no map needs it"
    remove_instance "$instance"
    return 0
  fi
  ((status != 2)) || fatal "$instance refused its options: $(last_words "$instance")"
  ((uptime_ms < healthy_s * 1000)) || backoff_ms[$instance]=$first_backoff_ms
  # Told once, not by each service: no network lets any of them in.
  ((is_started || status != 1)) || [[ $(last_words "$instance") != *"cannot reach udpm:"* ]] || fatal "$(last_words "$instance")"
  ((status <= 128)) || exit_signal[$instance]=$((status - 128))
  # Another session took the port after this one had found it free.
  [[ $instance != web || $(last_words web) != *" is taken: "* ]] || { remove_instance web; add_web; }
  wait_ms=${backoff_ms[$instance]}
  warn "$instance ended ($(how_it_ended "$instance" "$status")); it is started again in $((wait_ms / 1000)).$((wait_ms % 1000 / 100)) s (log: $session/log/$instance.log)"
  unset "hung_s[$instance]"
  due_ms[$instance]=$((clock_ms + wait_ms))
  backoff_ms[$instance]=$((wait_ms * 2))
  ((${backoff_ms[$instance]} <= longest_backoff_ms)) || backoff_ms[$instance]=$longest_backoff_ms
}

start_due() {
  local instance
  read_clock
  for instance in "${instances[@]}"; do
    [[ -n ${pid_of[$instance]:-} ]] || ((${due_ms[$instance]} > clock_ms)) ||
      { start_instance "$instance" "${exit_signal[$instance]:-}"; unset "exit_signal[$instance]"; }
  done
}

reap_dead() {
  local instance
  for instance in "${instances[@]}"; do
    [[ -z ${pid_of[$instance]:-} ]] || kill -0 "${pid_of[$instance]}" 2>/dev/null || note_death "$instance"
  done
}

# LCM's own relay shows none.
shows_signs() { [[ $1 != relay-* || -x $bin/skein-relay ]]; }

# Kills what hangs, in whatever it hangs; reap_dead finds it then. A process has start_limit_s until
# its loop comes round for the first time. Without its file, as on a full disk, it is let be. Time is
# counted in rounds of this script. A round in which this script itself was held up counts nothing: a
# pause of the machine kills nobody.
kill_hung() {
  local instance round_ms name sign limit_s
  local -A signs=()
  read_clock
  round_ms=$((clock_ms - watched_ms)) watched_ms=$clock_ms
  ((hang_after_s > 0 && round_ms <= longest_round_ms)) || return 0
  while read -r name sign; do
    [[ -z $name ]] || signs[$name]=$sign
  done <<<"$(cd "$session/run" && stat -c '%n %.9Y' -- *.alive 2>/dev/null)"
  for instance in "${!pid_of[@]}"; do
    sign=${signs[$instance.alive]:-}
    if [[ -z $sign || $sign != "${last_sign[$instance]}" ]] || ! shows_signs "$instance"; then
      last_sign[$instance]=$sign quiet_ms[$instance]=0
      continue
    fi
    quiet_ms[$instance]=$((${quiet_ms[$instance]} + round_ms))
    limit_s=$hang_after_s
    [[ $sign != "${first_sign[$instance]}" ]] || limit_s=$start_limit_s
    ((${quiet_ms[$instance]} >= limit_s * 1000)) || continue
    hung_s[$instance]=$limit_s
    kill -KILL "${pid_of[$instance]}" 2>/dev/null || true
    quiet_ms[$instance]=0
  done
}

# For $1 seconds. Nothing here waits for a child that runs: when a trapped signal comes just as bash
# (5.2) reaps a child in `wait`, it forgets that child's end, and the next wait for it never returns.
pause() { read -r -t "$1" -u "$never" || true; }

is_any_alive() { ((${#pid_of[@]} > 0)); }
signal_all() {
  local instance
  for instance in "${!pid_of[@]}"; do kill "-$1" "${pid_of[$instance]}" 2>/dev/null || true; done
}

stop_all() {
  local deadline killed=0
  stopping=1
  read_clock
  deadline=$((clock_ms + stop_deadline_s * 1000))
  signal_all TERM
  while is_any_alive; do
    read_clock
    if ((!killed && clock_ms >= deadline)); then
      warn "killing what did not stop within $stop_deadline_s s: ${!pid_of[*]}"
      signal_all KILL
      killed=1
    fi
    pause 0.1
    reap_dead
  done
  rm -f "$session"/run/*.{pid,alive,step}
}

fatal() {
  is_explained=1
  warn "$*"
  stop_all
  exit 1
}

# Until a signal comes. What cannot be written, on a full disk, ends nobody: `set +e`.
supervise() {
  local instance
  set +e
  while ((!interrupted)); do
    tell_watchdog
    kill_hung
    reap_dead
    grow_pool
    start_due
    for instance in "${!pid_of[@]}"; do note_pid "$instance"; done
    pause 0.5
  done
}

# Processes of an earlier launch on this session that outlived it. Each knows the folder it was started
# for: in a copy of a folder, the process ids are those of the original's processes.
stop_leftovers() {
  local file pid leftovers=()
  for file in "$session"/run/*.pid; do
    [[ -e $file ]] || continue
    pid=$(head -c 20 -- "$file" | tr -d '\0') # a file that was sent may tell terabytes
    if [[ $pid =~ ^[0-9]+$ ]] && tr '\0' '\n' 2>/dev/null <"/proc/$pid/environ" | grep -Fx "SKEIN_RUN_FOLDER=$session/run" >/dev/null; then
      leftovers+=("$pid")
    fi
    rm -f "$file"
  done
  ((${#leftovers[@]})) || return 0
  warn "stopping what an earlier launch left: ${leftovers[*]}"
  kill -TERM "${leftovers[@]}" 2>/dev/null || true
  local deadline pid
  read_clock
  deadline=$((clock_ms + stop_deadline_s * 1000))
  for pid in "${leftovers[@]}"; do
    while kill -0 "$pid" 2>/dev/null; do
      read_clock
      ((clock_ms < deadline && !interrupted)) || { kill -KILL "$pid" 2>/dev/null || true; break; }
      sleep 0.1
    done
  done
}

await_ready() {
  local deadline instance waiting=("$@") still
  read_clock
  deadline=$((clock_ms + ready_deadline_s * 1000))
  while ((${#waiting[@]})); do
    ((!interrupted)) || { stop_all; exit 0; }
    reap_dead
    start_due
    still=()
    for instance in "${waiting[@]}"; do
      [[ -n ${pid_of[$instance]:-} ]] && is_ready "$instance" || still+=("$instance")
    done
    waiting=("${still[@]}")
    ((${#waiting[@]})) || break
    read_clock
    ((clock_ms < deadline)) ||
      fatal "not ready within $ready_deadline_s s: ${waiting[*]}; last words of ${waiting[0]}:
$(last_words "${waiting[0]}" 5)"
    pause 0.1
  done
}

# An operator's link for a browser of this host. The pass in it is for a terminal alone: a log would keep it.
say_operator() {
  ((web_port)) && [[ ${auth_options[1]:-} != off ]] || return 0
  local link='' ask=(--role operator --view "http://127.0.0.1:$web_port")
  [[ ! -t 1 ]] || link=$("$bin/skein" invite --session "$session" "${ask[@]}" --expires 30d) || link=''
  say "operator: ${link:-$skein invite --session ${session@Q} ${ask[*]}}   (may finish: keep it to yourself)"
}

exec 9>"$session/run/launch.lock"
flock -n 9 || die "another skein launch runs on $session"
# Bash tells, in its own words, of every child that a signal ended: into a log. An error of this script is told at its end.
exec {terminal}>&2
warn() { printf '%s: %s\n' "$called" "$*" >&"$terminal" || true; }
is_explained=0
die() { is_explained=1; warn "$*"; exit 1; }
tell_own_error() {
  local status=$?
  ((status == 0 || is_explained)) || warn "ended by an error of its own: $(tail -n 1 "$session/log/launch.log")"
}
trap tell_own_error EXIT
exec 2>>"$session/log/launch.log"
[[ -z $ready_file ]] || : >"$ready_file"
rm -f "$session/run/web_public" # of an earlier launch, or of who sent the folder
[[ -n $join ]] || note_launched --lcm-url "$url" # the folder of workers is no session
# A file that is there would keep its mode, and with it those who read it.
[[ $join != skein://* ]] || (rm -f "$session/run/invitation" && umask 077 && echo "$join" >"$session/run/invitation")
exec {never}<> <(:) # a pipe into which nobody writes
stopping=0 interrupted=0 is_started=0
trap 'interrupted=1' INT TERM HUP
stop_leftovers

add_relays
await_ready "${instances[@]}"
if [[ -z $join ]]; then
  add_service ingest ingest
  add_service retrieval retrieval "${retrieval_options[@]}"
  add_service merger merger "${merger_options[@]}"
  [[ $guide == off ]] || add_service guide guide "${guide_options[@]}"
  [[ $dense == off ]] || add_service dense dense
  add_web
fi
add_workers features "$features" "${features_options[@]}"
add_workers matching "$matching" "${matching_options[@]}"
await_ready "${instances[@]}"
start_pool
await_ready "${instances[@]}"
is_started=1

say "${#instances[@]} processes are ready on $url"
[[ -n $join ]] || say "session $(jq -r .session_id "$session/session.json" 2>/dev/null || echo "$session")"
((!web_port)) || say "view: http://127.0.0.1:$web_port/"
skein=$(skein_command)
say_operator
[[ -z $web_host ]] || say "for phones and others: $skein invite --session ${session@Q} --role agent --browser --qr   (or viewer, operator)"
[[ -n $join || $url =~ ttl=0|//(127\.|localhost) ]] || say "invite: $skein invite --session ${session@Q} --role agent   (or worker, operator, viewer)"
watched="--session ${session@Q} --lcm-url ${url@Q}"
[[ $join != skein://* ]] || watched="--invite @${session@Q}/run/invitation"
spied_url=${watch_url:-$url}
spied="   or   scripts/spy.sh --lcm-url ${spied_url@Q}"
[[ $url != tcpqs:* || -n $watch_url ]] || spied='' # the relay's host has a port for it
[[ -x $SKEIN_ROOT/scripts/spy.sh ]] || spied=''
say "watch:  $skein status $watched$spied"
[[ -z $ready_file ]] || echo "$url" >"$ready_file"
tell_systemd --ready --status="${#instances[@]} processes on $url"

supervise
say "stopping"
tell_systemd STOPPING=1
stop_all
