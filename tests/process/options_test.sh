#!/usr/bin/env bash
# What a newcomer gives wrongly is told in one line that says what to do: by `skein`, by reconstruct.sh before it starts
# a service, and by demo.sh and test.sh before they set up and build.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
new_workspace
skein=$SKEIN_BUILD/bin/skein
mkdir -p "$workspace/empty" "$workspace/phone/film" "$workspace/photos"
printf '\0\0\0\024ftypheic\0\0\0\0mif1' | tee "$workspace/phone/1.HEIC" >"$workspace/phone/2.HEIC"
touch "$workspace/phone/film/walk.mp4" "$workspace/photos/1.JPG"

# refuses STATUS TEXT COMMAND...: with one line that holds TEXT
refuses() {
  local expected=$1 text=$2 status=0
  shift 2
  timeout 30 "$@" >"$workspace/said" 2>&1 || status=$?
  ((status == expected)) || fail "$*: exit code $status, not $expected: $(<"$workspace/said")"
  grep -qF -- "$text" "$workspace/said" && (($(wc -l <"$workspace/said") == 1)) || fail "$*: $(<"$workspace/said")"
}

for script in demo.sh "reconstruct.sh --session $workspace/none"; do
  read -ra words <<<"$SKEIN_ROOT/scripts/$script"
  refuses 2 'unknown option --imges' "${words[@]}" --imges x
  refuses 2 '--rate needs a value' "${words[@]}" --rate
  refuses 2 "no JPEG, PNG or TIFF in '$workspace/phone'" "${words[@]}" --images "$workspace/photos" --images "$workspace/phone"
done
refuses 2 '--preset needs a value' "$SKEIN_ROOT/scripts/test.sh" --preset
refuses 2 '--lcm-url needs a value' "$SKEIN_ROOT/scripts/spy.sh" --lcm-url
for option in colmap/versus_colmap/--truth colmap/versus_colmap/--seeds guidance/guidance/--keep \
  guidance/guidance/--max-photos captures/captures/--kinds; do
  refuses 2 "${option##*/} needs a value" "$SKEIN_ROOT/benchmark/${option%/*}.sh" "${option##*/}"
done
refuses 2 "--photos needs a number above 1, not 'few'" "$SKEIN_ROOT/scripts/demo.sh" --photos few
[[ ! -e $workspace/none ]] || fail "reconstruct.sh made a session for wrong options"

refuses 2 'skein agent: there is no option --imges; do you mean --images?' "$skein" agent --name alice --imges "$workspace/photos"
refuses 2 "--rate: give 0 or more, not '-1'" "$skein" agent --name alice --images "$workspace/photos" --rate -1
refuses 2 '--name is required' "$skein" agent --images "$workspace/photos"
refuses 2 'skein probe: LCM URL "foo://"' "$skein" probe --lcm-url foo://

# Without a session; then with one that is empty.
for command in "status --once" "agent --name alice --images $workspace/photos" finish "export --output $workspace/out"; do
  read -ra words <<<"$command"
  refuses 1 "$workspace/empty holds no session" "$skein" "${words[@]}" --session "$workspace/empty"
done
printf '{"identifier": "skein-session", "version": 1, "session_id": "0123456789abcdef"}' >"$workspace/empty/session.json"
agent=("$skein" agent --session "$workspace/empty" --auth off --lcm-url memq:// --name alice)
refuses 1 'JPEG, PNG and TIFF are taken, not 2 .heic, 1 .mp4; for a video give --video FILE. HEIC: iPhone: Settings > Camera > Formats > Most Compatible' "${agent[@]}" --images "$workspace/phone"
cp "$workspace/photos/1.JPG" "$workspace/phone/"
"${agent[@]}" --images "$workspace/phone" >"$workspace/said" 2>&1 &
wait_until 30 "the files that are not taken" \
  grep -qF "not taken in $workspace/phone: 2 .heic, 1 .mp4 (JPEG, PNG and TIFF are). HEIC: iPhone: Settings" "$workspace/said"
kill -INT $!
wait $! || true

# Three models, of which one has nothing in common with the truth.
use_small_place
mkdir -p "$workspace/models"
for i in 0 1 2; do cp -r "$place/truth" "$workspace/models/$i"; done
sed -i 's|agent-./|elsewhere/other-|' "$workspace/models/1/images.txt"
"$skein" evaluate "$workspace/models" "$place/truth" --json >"$workspace/figures" 2>"$workspace/said" ||
  fail "evaluate: $(<"$workspace/said")"
grep -qF "not compared: $workspace/models/1: 0 photos in common" "$workspace/said" || fail "evaluate: $(<"$workspace/said")"
jq -e '(.models | length) == 2 and .models[1].registered == 16 and (.not_compared | length) == 1' "$workspace/figures" >/dev/null ||
  fail "figures of the models that can be compared: $(<"$workspace/figures")"
refuses 1 '0 photos in common' "$skein" evaluate "$workspace/models/1" "$place/truth"
