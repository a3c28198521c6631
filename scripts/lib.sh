# Shared by the scripts of this folder: source it, don't run it.
set -euo pipefail

SKEIN_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
SKEIN_DEPS=${SKEIN_DEPS:-$SKEIN_ROOT/.deps}
# Installed, scripts/ lies beside the programs' folder; a checkout has neither bin/ nor an installed skein.
if [[ -x $SKEIN_ROOT/bin/skein ]]; then
  SKEIN_INSTALLED=1 SKEIN_BUILD=${SKEIN_BUILD:-$SKEIN_ROOT}
else
  SKEIN_INSTALLED='' SKEIN_BUILD=${SKEIN_BUILD:-$SKEIN_ROOT/build/release}
fi

# The script as its user called it: "launch.sh", or "skein launch" (clients/script.cc).
called=${0##*/}
[[ -z ${SKEIN_SUBCOMMANDS:-} ]] || called="skein ${called%.sh}"

say() { printf '== %s\n' "$*"; }
warn() { printf '%s: %s\n' "$called" "$*" >&2; }
die() {
  warn "$*"
  exit 1
}
usage_error() {
  warn "$*; see $called --help"
  exit 2
}

# Prints the comment block at the head of the calling script: that is its --help.
print_help() {
  local names=()
  [[ -z ${SKEIN_SUBCOMMANDS:-} ]] || names=(-e 's/\(scripts\/\)\?\b\(launch\|reconstruct\|demo\)\.sh\b/skein \2/g')
  awk 'NR > 1 && /^#/ { sub(/^# ?/, ""); print; next } NR > 1 { exit }' "$0" | sed "${names[@]}" -e ''
}

# The command of this build as a user types it: "skein" where the shell finds it so, else its path.
skein_command() {
  local program=$SKEIN_BUILD/bin/skein
  if [[ $program -ef $(type -P skein) ]]; then echo skein; else printf '%q\n' "$program"; fi
}

# The commit that this build was made from, which need not be the checkout's; without one its version.
build_commit() { "$SKEIN_BUILD/bin/skein" --version | sed -E 's/^skein //; s/.*\((.*)\)$/\1/'; }

# take_options "NAME..." ARGUMENT...: `--NAME VALUE` sets the variable NAME of the calling script.
take_options() {
  local names=" $1 " name
  shift
  while (($#)); do
    [[ $1 != -h && $1 != --help ]] || { print_help; exit 0; }
    name=${1#--}
    [[ $1 == --* && $names == *" $name "* ]] || usage_error "unknown option $1"
    [[ -n ${2:-} ]] || usage_error "$1 wants a value"
    printf -v "$name" %s "$2"
    shift 2
  done
}

# As many jobs as there are cores, but no more than the memory carries (1.3 GB a compiler).
build_jobs() {
  local cores memory_kb
  cores=$(nproc)
  memory_kb=$(awk '/^MemAvailable/ { print $2 }' /proc/meminfo)
  local by_memory=$((memory_kb / 1300000))
  ((by_memory > 0)) || by_memory=1
  echo $((cores < by_memory ? cores : by_memory))
}

# The mirror of this host's Debian release, of apt's sources.
debian_mirror() {
  local codename mirror
  codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  mirror=$(apt-get indextargets --format '$(SITE)|$(RELEASE)|$(COMPONENT)' 'Created-By: Packages' |
    sed -n "s/|$codename|main$//p" | head -n 1)
  [[ -n $mirror ]] || die "apt's sources hold no $codename main"
  echo "$mirror"
}

# The COLMAP part to link and what lets ccache serve a second clone from the first one's work.
export_build_environment() {
  export SKEIN_COLMAP_DIR=${SKEIN_COLMAP_DIR:-$SKEIN_DEPS/colmap}
  export SKEIN_WEB_MODULES=${SKEIN_WEB_MODULES:-$SKEIN_DEPS/web/node_modules}
  export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$SKEIN_ROOT} CCACHE_NOHASHDIR=1
  # For precompiled headers.
  export CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
}

# build_skein PRESET [TARGET...]
build_skein() {
  local preset=$1
  shift
  export_build_environment
  say "configuring ($preset)"
  (cd "$SKEIN_ROOT" && cmake --preset "$preset" >"$SKEIN_DEPS/configure.log" 2>&1) ||
    { cat "$SKEIN_DEPS/configure.log" >&2; die "cmake failed"; }
  say "building with $(build_jobs) jobs"
  ninja -C "$SKEIN_ROOT/build/$preset" -j "$(build_jobs)" "$@"
}

# LCM's own jar: the relay and lcm-spy.
lcm_jar() {
  local jar=/usr/share/java/lcm.jar
  [[ -e $jar ]] || jar=/usr/local/share/java/lcm.jar
  [[ -e $jar ]] || die "no lcm.jar in /usr/share/java: scripts/setup.sh installs it (liblcm-java)"
  echo "$jar"
}

# private_lcm_url SESSION: a URL that no other session of this host uses. udpm where multicast
# works, else tcpq (launch.sh then starts the relays).
private_lcm_url() {
  local key port
  key=$(realpath -m "$1" | cksum | cut -d' ' -f1)
  port=$((10000 + 2 * (key % 10000)))
  if "$SKEIN_BUILD/bin/skein" probe --timeout 2 --lcm-url "udpm://239.255.76.67:$port?ttl=0" >/dev/null 2>&1; then
    echo "udpm://239.255.76.67:$port?ttl=0"
  else
    warn "no multicast on this host (\`ip route get 239.255.76.67\` tells why): using TCP on 127.0.0.1"
    echo "tcpq://127.0.0.1:$port"
  fi
}

launch_pid=''
# start_services SESSION URL [launch.sh's options...]: returns when all are ready. Sets launch_pid.
start_services() {
  local session=$1 url=$2 ready
  shift 2
  ready=$(mktemp) # nothing is written to the session before launch.sh has looked at it
  "$SKEIN_ROOT/scripts/launch.sh" --session "$session" --lcm-url "$url" --build "$SKEIN_BUILD" \
    --ready-file "$ready" "$@" &
  launch_pid=$!
  until [[ -s $ready ]]; do # launch.sh has its own deadline for this
    kill -0 "$launch_pid" 2>/dev/null || { rm -f "$ready"; die "the services did not start"; }
    sleep 0.1
  done
  rm -f "$ready"
}

stop_services() {
  [[ -n $launch_pid ]] || return 0
  kill -TERM "$launch_pid" 2>/dev/null || true
  wait "$launch_pid" 2>/dev/null || true
  launch_pid=''
}

# The class path of lcm-spy with our types, then of more jars or folders.
lcm_spy_class_path() {
  local types=$SKEIN_BUILD/skein_lcmtypes.jar charts=/usr/share/java/jchart2d.jar
  [[ -e $types ]] || die "no $types: build first"
  [[ -e $charts ]] || warn "no $charts (libjchart2d-java): lcm-spy can't open its channel windows"
  local IFS=:
  echo "$(lcm_jar):$charts:$types${*:+:$*}"
}

# Debian's lcm-spy starter passes -Xincgc, which Java 9 and later refuse: so not through it.
exec_lcm_spy() {
  exec java -Djava.net.preferIPv4Stack=true -Xmx256m -cp "$(lcm_spy_class_path)" lcm.spy.Spy "--lcm-url=$1"
}

# render_place DIR AGENTS PHOTOS [skein sim's options...]: DIR/images/AGENT/*.jpg and, as a COLMAP
# model, DIR/truth. PHOTOS: of each agent. A place that is complete is taken as it is.
render_place() {
  local place=$1 agents=$2 photos=$3
  shift 3
  [[ ! -e $place/complete ]] || return 0
  rm -rf "$place"
  mkdir -p "$place"
  "$SKEIN_BUILD/bin/skein" sim --output "$place" --agents "$agents" --photos "$photos" "$@"
  touch "$place/complete"
}

# num_images MODEL: of a model in COLMAP's binary format
num_images() { od -An -t u8 -N 8 "$1/images.bin" | tr -d ' '; }

# largest_model FOLDER: of COLMAP's models there
largest_model() {
  local model best='' most=-1 count
  for model in "$1"/[0-9]*; do
    [[ -e $model/images.bin ]] || continue
    count=$(num_images "$model")
    ((count <= most)) || { most=$count best=$model; }
  done
  [[ -n $best ]] || die "no model in $1"
  echo "$best"
}

# is_accounted_for REPORT: every photo received is registered, deferred or failed with a reason
is_accounted_for() {
  jq -e '.images | .received == .registered + .deferred + .failed' "$1" >/dev/null
}
