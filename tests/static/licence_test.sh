#!/usr/bin/env bash
# No binary links PBA (GPL-3), LSD (AGPL-3) or exiv2 (GPL-2).
source "$(dirname "$0")/../harness.sh"
binaries=$(find "$SKEIN_BUILD/bin" -maxdepth 1 -type f -executable -name 'skein*')
[[ -n $binaries ]] || fail "no binary in $SKEIN_BUILD/bin"
for binary in $binaries $SKEIN_COLMAP_DIR/lib/libskein_colmap.a; do
  symbols=$(nm -C "$binary" 2>/dev/null | grep -E ' [TtWVu] (pba::|ParallelBA|SparseBundleCPU|LineSegmentDetection|lsd_scale|colmap::DetectLineSegments|Exiv2::)' || true)
  [[ -z $symbols ]] || fail "$binary holds: $(head -n 3 <<<"$symbols")"
done
for binary in $binaries; do
  needed=$(readelf -d "$binary" | grep -E 'NEEDED.*(exiv2|pba|lsd)' || true)
  [[ -z $needed ]] || fail "$binary links $needed"
done
