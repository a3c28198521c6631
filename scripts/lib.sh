# Shared by the scripts of this folder: source it, don't run it.
set -euo pipefail

SKEIN_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
SKEIN_DEPS=${SKEIN_DEPS:-$SKEIN_ROOT/.deps}
SKEIN_BUILD=${SKEIN_BUILD:-$SKEIN_ROOT/build/release}

say() { printf '== %s\n' "$*"; }
warn() { printf '%s: %s\n' "${0##*/}" "$*" >&2; }
die() {
  warn "$*"
  exit 1
}
usage_error() {
  warn "$*; see ${0##*/} --help"
  exit 2
}

# Prints the comment block at the head of the calling script: that is its --help.
print_help() { awk 'NR > 1 && /^#/ { sub(/^# ?/, ""); print; next } NR > 1 { exit }' "$0"; }

# As many jobs as there are cores, but no more than the memory carries (1.3 GB a compiler).
build_jobs() {
  local cores memory_kb
  cores=$(nproc)
  memory_kb=$(awk '/^MemAvailable/ { print $2 }' /proc/meminfo)
  local by_memory=$((memory_kb / 1300000))
  ((by_memory > 0)) || by_memory=1
  echo $((cores < by_memory ? cores : by_memory))
}

# The COLMAP part to link and what lets ccache serve a second clone from the first one's work.
export_build_environment() {
  export SKEIN_COLMAP_DIR=${SKEIN_COLMAP_DIR:-$SKEIN_DEPS/colmap}
  export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$SKEIN_ROOT} CCACHE_NOHASHDIR=1
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
