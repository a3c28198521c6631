#!/usr/bin/env bash
# `skein agent --watch` on a folder as people have them: copies that pause or preallocate, files that are overwritten, thumbnails,
# trash, a link to the folder above, a disk that is unplugged.
source "$(dirname "$0")/../harness.sh"
source "$(dirname "$0")/../session.sh"
enter_network_namespace "$@"
new_workspace
url=$(test_lcm_url)
use_small_place
session=$workspace/session
stored=$session/images/alice
disk=$workspace/disk
dcim=$disk/DCIM
log=$workspace/alice.log
photos=("$place"/images/agent-1/*)
"$SKEIN_BUILD/bin/bad_photos" "$place/images/agent-1" "$workspace/odd" >/dev/null || fail "bad_photos"

mkdir -p "$dcim/.thumbnails" "$dcim/@eaDir/a.jpg" "$disk/.Trash-1000/files" "$dcim/.Trash-1000/files"
cp "${photos[0]}" "$dcim/a.jpg"
cp "${photos[6]}" "$dcim/.thumbnails/a.jpg"
cp "${photos[6]}" "$dcim/@eaDir/a.jpg/SYNOPHOTO_THUMB_XL.jpg"
cp "${photos[6]}" "$dcim/.Trash-1000/files/old.jpg"
cp "${photos[6]}" "$disk/beside.jpg"
head -c 4096 /dev/zero >"$dcim/._a.jpg"
ln -s .. "$dcim/up"

start_reconstruction "$session" "$url" --features 0 --matching 0 --mappers 0
"$SKEIN_BUILD/bin/skein" agent --session "$session" --lcm-url "$url" --name alice --images "$dcim" --watch >"$log" 2>&1 &
agent=$!

is_stored() { cmp -s "$1" "$stored/$2"; }
is_told() { grep -qF -- "$1" "$log"; }
wait_until 30 "the first photo is stored" is_stored "${photos[0]}" a.jpg
wait_until 60 "a missing worker is told" is_told 'skein agent: 1 photo waits for its features, and no skein-features is running. Start `skein launch`'
"$SKEIN_BUILD/bin/skein" status --once --session "$session" --lcm-url "$url" >"$workspace/status.out" || fail "status"
grep -qxF '! 1 photo waits for its features, and no skein-features is running.' "$workspace/status.out" ||
  fail "status does not tell the missing worker: $(<"$workspace/status.out")"
is_told 'not taken in '"$dcim"': 1 ._*, 1 in .Trash-1000, 1 in .thumbnails, 1 in @eaDir (hidden photos, thumbnails and trash)' ||
  fail "what is skipped is not told"
is_told 'not taken in '"$dcim"': up (links to folders that are read anyway)' || fail "the link is not told"

echo x >"$dcim/late.heic"
wait_until 30 "a HEIC that comes later is told" is_told 'not taken in '"$dcim"': 1 .heic (JPEG, PNG and TIFF are)'
rm "$dcim/late.heic"

# A copy that pauses, and one that allocates all of its size first.
half=$(($(stat -c %s "${photos[1]}") / 2))
head -c "$half" "${photos[1]}" >"$dcim/pauses.jpg"
truncate -s "$(stat -c %s "${photos[2]}")" "$dcim/preallocated.jpg"
wait_until 30 "a pausing copy is waited for" is_told 'not taken yet: pauses.jpg: damaged JPEG'
wait_until 30 "a preallocated copy is waited for" is_told 'not taken yet: preallocated.jpg: '
tail -c +$((half + 1)) "${photos[1]}" >>"$dcim/pauses.jpg"
dd if="${photos[2]}" of="$dcim/preallocated.jpg" conv=notrunc status=none
wait_until 30 "the pausing copy is stored" is_stored "${photos[1]}" pauses.jpg
wait_until 30 "the preallocated copy is stored" is_stored "${photos[2]}" preallocated.jpg

# Another photo under a name that is taken; one in place of what was refused.
cp "${photos[3]}" "$dcim/a.jpg"
wait_until 30 "the other photo of that name is stored" is_stored "${photos[3]}" a~2.jpg
is_told 'a.jpg has changed' || fail "the change is not told"
cp "$workspace/odd/bad/bomb.jpg" "$dcim/refused.jpg"
wait_until 30 "ingest refuses a photo" is_told 'refused refused.jpg: '
cp "${photos[4]}" "$dcim/refused.jpg"
wait_until 30 "the photo in its place is stored" is_stored "${photos[4]}" refused.jpg

mv "$disk" "$disk.unplugged"
wait_until 30 "the vanished folder is told" is_told "$dcim has vanished; waiting for it"
mv "$disk.unplugged" "$disk"
wait_until 30 "its return is told" is_told "$dcim is there again"
cp "${photos[5]}" "$dcim/later.jpg"
wait_until 30 "a later photo is stored" is_stored "${photos[5]}" later.jpg

head -c "$half" "${photos[7]}" >"$dcim/never.jpg"
wait_until 30 "a photo that never becomes whole is waited for" is_told 'not taken yet: never.jpg: '
kill -INT "$agent"
code=0
wait "$agent" || code=$?
[[ $code == 3 ]] || fail "exit code $code, not 3"
is_told 'alice: 6 photos received, 0 duplicates, 1 refused, 1 never became whole' || fail "another summary: $(tail -n 3 "$log")"
is_told 'not taken: never.jpg: damaged JPEG' || fail "what is missing at the end is not told: $(tail -n 3 "$log")"
[[ $(find "$stored" -type f | wc -l) == 6 ]] || fail "more than six photos: $(ls "$stored")"
