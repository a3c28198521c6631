#!/usr/bin/env bash
# Installs what Skein is built from. Debian 12 or 13, as root or with sudo, safe to run again.
#
#   scripts/setup.sh [--tests]
#
#   --tests   also what only the tests use (clang-format, clang-tidy, colmap's command, Xvfb, Chromium, Prometheus, Slurm)
#
# Packages that are there already are left alone. The part of COLMAP that Skein links is built into .deps/
# from the release's source (3.8 on Debian 12, 3.10 on 13), once. The packages that the live view's page is
# made of come from npm's registry into .deps/web/; where it cannot be reached, Skein is built without the page.
#
# Environment:
#   SKEIN_DEPS           where to put it instead of .deps/
#   SKEIN_COLMAP_DIR     an installed COLMAP part: nothing is fetched or built
#   SKEIN_COLMAP_SOURCE  COLMAP's unpacked source, 3.8 or 3.10: nothing is fetched
#   SKEIN_WEB_MODULES    a node_modules folder with what web/package.json names: nothing is fetched
source "$(dirname "$0")/lib.sh"

build_packages=(
  g++ cmake ninja-build ccache dpkg-dev python3
  liblcm-dev liblcm-bin liblcm-java libjchart2d-java libeigen3-dev libgeotiff-dev libtiff-dev libceres-dev libopencv-dev
  libhnswlib-dev libsqlite3-dev libssl-dev libexif-dev libexpat1-dev libgoogle-glog-dev
  libboost-filesystem-dev libboost-system-dev libarchive-dev libcli11-dev libspdlog-dev nlohmann-json3-dev libsodium-dev libseccomp-dev
  libqrencode-dev libgtest-dev libbenchmark-dev iproute2 util-linux jq)
test_packages=(curl unzip zbar-tools clang clang-format clang-tidy colmap gnuplot-nox sqlite3 xvfb xauth python3-nacl python3-yaml)

# What a release has or calls otherwise: its name, COLMAP's version, packages.
release=$(. /etc/os-release && echo "$ID${VERSION_ID:-}")
case $release in
  debian12) codename=bookworm colmap=3.8 test_packages+=(libclang-rt-14-dev openjdk-17-jre) ;;
  debian13) codename=trixie colmap=3.10 build_packages+=(libonnxruntime-dev) test_packages+=(libclang-rt-19-dev openjdk-21-jre) ;;
  *) codename='' colmap='' ;;
esac

as_root() {
  if ((EUID == 0)); then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    die "root or sudo is needed to install: ${missing[*]}"
  fi
}

is_installed() { [[ $(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]; }

find_missing() {
  missing=()
  local package
  for package in "$@"; do
    is_installed "$package" || missing+=("$package")
  done
  command -v javac >/dev/null && command -v jar >/dev/null || missing+=(default-jdk-headless)
  command -v node >/dev/null || missing+=(nodejs)
  command -v npm >/dev/null || missing+=(npm)
  ((!tests)) || command -v chromium >/dev/null || missing+=(chromium)
  ((!tests)) || is_installed libfaketime || missing+=(libfaketime)
}

# Names every package that the configured sources don't have.
require_candidates() {
  local package absent=()
  for package in "${missing[@]}"; do
    apt-cache show "$package" >/dev/null 2>&1 || absent+=("$package")
  done
  ((${#absent[@]} == 0)) ||
    die "these Debian packages cannot be had from the configured apt sources: ${absent[*]}"
}

install_packages() {
  find_missing "$@"
  if ((${#missing[@]} == 0)); then
    say "all ${#} packages are there"
    return
  fi
  say "installing: ${missing[*]}"
  as_root apt-get update -q -o Acquire::Retries=3 -o DPkg::Lock::Timeout=600 ||
    warn "apt-get update failed; trying with the package lists that are there"
  require_candidates
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends \
    -o Acquire::Retries=3 -o DPkg::Lock::Timeout=600 "${missing[@]}" ||
    die "apt-get could not install: ${missing[*]} (its message stands above)"
}

# Debian's own stanzas of the configured sources, asking for source packages instead of binaries.
write_source_entries() {
  local out=$1 file
  local suites="(^|[ \t])($codename|stable)(-updates|-security|\/updates)?([ \t]|\$)"
  for file in /etc/apt/sources.list.d/*.sources; do
    [[ -e $file ]] && awk -v suites="$suites" 'BEGIN { RS = ""; ORS = "\n\n" }
      match($0, /(^|\n)Suites:[^\n]*/) && substr($0, RSTART, RLENGTH) ~ suites &&
      $0 ~ /\nComponents:[^\n]*[ \t]main/ { print }' "$file" |
      sed 's/^Types:.*/Types: deb-src/' >"$out/$(basename "$file")"
  done
  for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [[ -e $file ]] && { grep -E '^deb[ \t]' "$file" || true; } | { grep -E "$suites.*main" || true; } |
      sed 's/^deb[ \t]/deb-src /' >"$out/$(basename "$file" .list)-list.list"
  done
  find "$out" -type f -empty -delete
  [[ -n $(ls "$out") ]] || die "no source of $codename with component main is configured in /etc/apt"
}

# COLMAP's own archive alone: cmake/colmap needs none of Debian's changes, and a mirror can lack the .dsc.
# Uses an apt configuration of its own: nothing of the system's is changed.
fetch_colmap_source() {
  local work=$SKEIN_DEPS/apt uri checksum
  rm -rf "$work"
  mkdir -p "$work/parts" "$work/lists/partial" "$work/cache/archives/partial"
  write_source_entries "$work/parts"
  local options=(-o Dir::Etc::sourcelist=/dev/null -o "Dir::Etc::sourceparts=$work/parts"
    -o "Dir::State::lists=$work/lists" -o "Dir::Cache=$work/cache" -o APT::Sandbox::User=root
    -o Acquire::Retries=3 -o Acquire::Languages=none)
  say "getting COLMAP $colmap's source"
  apt-get -q "${options[@]}" update >"$work/log" 2>&1 || warn "apt-get update for source packages had errors; going on"
  # Lines of 'URI' NAME SIZE CHECKSUM
  read -r uri checksum < <(apt-get -q "${options[@]}" source --print-uris colmap 2>>"$work/log" |
    awk -v name="colmap_$colmap.orig.tar.gz" '$2 == name { gsub("\047", "", $1); print $1, $4 }') &&
    /usr/lib/apt/apt-helper "${options[@]}" download-file "$uri" "$work/colmap.tar.gz" "$checksum" >>"$work/log" 2>&1 ||
    { tail -n 5 "$work/log" >&2; die "COLMAP $colmap's source cannot be had from the configured apt sources"; }
  mkdir -p "$SKEIN_DEPS/src"
  tar -xzf "$work/colmap.tar.gz" -C "$SKEIN_DEPS/src"
  rm -rf "$work"
}

colmap_stamp() {
  (cd "$SKEIN_ROOT/cmake/colmap" && find . -type f -print0 | sort -z | xargs -0 sha256sum) |
    cat - <(echo "COLMAP $colmap $(g++ -dumpfullversion)") | sha256sum | cut -d' ' -f1
}

build_colmap() {
  local source=$1 prefix=$SKEIN_DEPS/colmap
  say "building COLMAP's part with $(build_jobs) jobs"
  export_build_environment
  cmake -G Ninja -S "$SKEIN_ROOT/cmake/colmap" -B "$SKEIN_DEPS/build" -DCOLMAP_SOURCE="$source" \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$prefix" >"$SKEIN_DEPS/colmap.log" 2>&1 ||
    { cat "$SKEIN_DEPS/colmap.log" >&2; die "configuring COLMAP's part failed"; }
  ninja -C "$SKEIN_DEPS/build" -j "$(build_jobs)" || die "building COLMAP's part failed"
  rm -rf "$prefix"
  cmake --install "$SKEIN_DEPS/build" >>"$SKEIN_DEPS/colmap.log"
  colmap_stamp >"$prefix/stamp"
}

provide_colmap() {
  if [[ -n ${SKEIN_COLMAP_DIR:-} && -e $SKEIN_COLMAP_DIR/lib/libskein_colmap.a ]]; then
    say "using COLMAP's part in $SKEIN_COLMAP_DIR"
  elif [[ $(cat "$SKEIN_DEPS/colmap/stamp" 2>/dev/null) == "$(colmap_stamp)" ]]; then
    say "COLMAP's part is built"
  elif [[ -n ${SKEIN_COLMAP_SOURCE:-} ]]; then
    build_colmap "$SKEIN_COLMAP_SOURCE"
  else
    [[ -e $SKEIN_DEPS/src/colmap-$colmap/COPYING.txt ]] || fetch_colmap_source
    build_colmap "$SKEIN_DEPS/src/colmap-$colmap"
  fi
}

web_stamp() { cat "$SKEIN_ROOT/web/package-lock.json" <(echo "$tests") | sha256sum | cut -d' ' -f1; }

# three.js, esbuild and, for the tests, playwright-core, as web/package-lock.json names them.
provide_web_modules() {
  local web=$SKEIN_DEPS/web omit=(--omit=dev)
  ((!tests)) || omit=()
  if [[ -n $given_modules ]]; then
    [[ -e $given_modules/three/package.json ]] || die "SKEIN_WEB_MODULES: no three in $given_modules"
    say "using the page's packages in $given_modules"
    return
  fi
  if [[ $(cat "$web/stamp" 2>/dev/null) == "$(web_stamp)" ]]; then
    say "the page's packages are there"
    return
  fi
  if ! command -v npm >/dev/null || (($(node --version | tr -dc '0-9.' | cut -d. -f1) < 18)); then
    warn "the live view's page needs npm and node 18 or newer: Skein is built without it"
    return
  fi
  say "getting the page's packages"
  rm -rf "$web"
  mkdir -p "$web"
  cp "$SKEIN_ROOT"/web/package.json "$SKEIN_ROOT"/web/package-lock.json "$SKEIN_ROOT"/web/.npmrc "$web/"
  if (cd "$web" && npm ci "${omit[@]}" --ignore-scripts --no-audit --no-fund) >"$SKEIN_DEPS/npm.log" 2>&1; then
    web_stamp >"$web/stamp"
  else
    grep -E -m 4 'npm (error|ERR!)' "$SKEIN_DEPS/npm.log" >&2 || tail -n 3 "$SKEIN_DEPS/npm.log" >&2
    warn "npm's registry cannot be reached ($SKEIN_DEPS/npm.log): Skein is built without the live view's page"
    rm -rf "$web"
  fi
}

# For process.metrics, 19 MB. Unpacked alone: installed, the package would start a server on port 9090.
provide_prometheus() {
  local prometheus=$SKEIN_DEPS/prometheus packages=(prometheus) package
  if command -v prometheus >/dev/null || [[ -x $prometheus/usr/bin/prometheus ]]; then return; fi
  rm -rf "$prometheus"
  mkdir -p "$prometheus"
  say "getting prometheus"
  apt-cache show promtool >/dev/null 2>&1 && packages+=(promtool) # a package of its own on Debian 13
  (cd "$prometheus" && apt-get download -q "${packages[@]}" && for package in *.deb; do dpkg-deb -x "$package" . || exit; done && rm -- *.deb) \
    >"$SKEIN_DEPS/prometheus.log" 2>&1 && return
  warn "prometheus cannot be had ($SKEIN_DEPS/prometheus.log): process.metrics goes without it"
  rm -rf "$prometheus"
}

require_elsewhere() {
  warn "this is neither Debian 12 nor 13: install yourself what corresponds to ${build_packages[*]}"
  [[ -n ${SKEIN_COLMAP_SOURCE:-} || -e ${SKEIN_COLMAP_DIR:-$SKEIN_DEPS/colmap}/lib/libskein_colmap.a ]] ||
    die "and set SKEIN_COLMAP_SOURCE to COLMAP's unpacked source, 3.8 or 3.10 (its releases of these tags)"
}

packages=("${build_packages[@]}") tests=0 given_modules=${SKEIN_WEB_MODULES:-}
for argument in "$@"; do
  case $argument in
    --tests) packages+=("${test_packages[@]}") tests=1 ;;
    -h | --help) print_help; exit 0 ;;
    *) usage_error "unknown option $argument" ;;
  esac
done

mkdir -p "$SKEIN_DEPS"
exec 8>"$SKEIN_DEPS/lock"
flock 8
if [[ -n $codename ]]; then install_packages "${packages[@]}"; else require_elsewhere; fi
provide_colmap
provide_web_modules
if ((tests)) && [[ -n $codename ]]; then provide_prometheus; fi
say "set-up is complete"
