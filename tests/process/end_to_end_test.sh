#!/usr/bin/env bash
# Two agents' photos of a synthetic place through reconstruct.sh; Debian's colmap opens the model.
#
#   end_to_end_test.sh udpm|tcpq
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
[[ $1 == tcpq ]] || enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place

images=()
for folder in "$place"/images/*/; do images+=(--images "$folder"); done
"$SKEIN_ROOT/scripts/reconstruct.sh" --session "$workspace/a session" --build "$SKEIN_BUILD" \
  --lcm-url "$url" "${images[@]}" --ground-truth "$place/truth" || fail "reconstruct.sh"
expect_model "$workspace/a session" 1

# The surface: at least a point for twenty pixels of the photos, and a depth map of each.
"$SKEIN_BUILD/bin/skein" export --session "$workspace/a session" --output "$workspace/surface" --format dense,depth \
  >"$workspace/surface.log" 2>&1 || fail "no surface: $(<"$workspace/surface.log")"
num_points=$(grep -ao -m1 'element vertex [0-9]*' "$workspace/surface/0/dense.ply" | grep -o '[0-9]*')
echo "$num_points dense points"
num_pixels=$(jq '[.photos[] | .width * .height] | add' "$workspace/surface/0/depth/cameras.json")
((20 * num_points > num_pixels && num_points < num_pixels)) || fail "$num_points points of $num_pixels pixels"
num_maps=$(find "$workspace/surface/0/depth" -name '*.error.pfm' | wc -l)
((num_maps == $(jq '.photos | length' "$workspace/surface/0/depth/cameras.json"))) || fail "$num_maps depth maps"
num_masks=$(find "$workspace/surface/0/depth/masks" -name '*.png' | wc -l)
((num_masks == num_maps)) || fail "$num_masks masks of $num_maps photos"
jq -e '.agreed > 0 and .expected_error_p50 > 0 and .ground_sampling_distance > 0' "$workspace/surface/0/surface.json" ||
  fail "no quality: $(<"$workspace/surface/0/surface.json")"

command -v colmap >/dev/null || { echo "no colmap command: its reading of the model is not tested"; exit 0; }
analysis=$(QT_QPA_PLATFORM=offscreen colmap model_analyzer --path "$workspace/a session/sparse/0" 2>&1) ||
  fail "colmap cannot open the model: $analysis"
grep -E 'Registered images|Points|Mean reprojection' <<<"$analysis"
grep -qE "Registered images: $(jq '.submaps[0].images' "$workspace/a session/report.json")\b" <<<"$analysis" ||
  fail "colmap counts other images: $analysis"
