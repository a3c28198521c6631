# What every test script shares: source it first.
source "$(dirname "${BASH_SOURCE[0]}")/../scripts/lib.sh"
export_build_environment

fail() {
  echo "FAILED: $*" >&2
  exit 1
}
# ctest counts exit code 77 as skipped.
skip() {
  echo "SKIPPED: $*"
  exit 77
}

# tracked_files PATTERN...: NUL-separated; in a tree without git, every such file outside build folders
tracked_files() {
  if git -C "$SKEIN_ROOT" rev-parse --git-dir >/dev/null 2>&1; then
    git -C "$SKEIN_ROOT" ls-files -z -- "$@"
    return
  fi
  local pattern
  for pattern in "$@"; do
    find . \( -path ./build -o -path ./.deps \) -prune -o -type f -path "*${pattern#\*}" -print0
  done
}
