#!/usr/bin/env bash
# Trains the codebook of the embedded global descriptor from folders of photos.
# Usage: scripts/train_codebook.sh --images DIR [--images DIR]... --id NAME --output FILE [options]
# More options: build/release/bin/skein-train-codebook --help. Builds Skein's tool if needed.
set -euo pipefail
cd "$(dirname "$0")/.."
[ -f build/release/build.ninja ] || cmake --preset release
ninja -C build/release skein-train-codebook >&2
exec build/release/bin/skein-train-codebook "$@"
