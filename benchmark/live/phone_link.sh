#!/usr/bin/env bash
# A phone (headless Chromium in a network namespace of its own) sends photos over a cable that is cut three times for some
# seconds, and that is the whole network. Prints how many are stored, once each, and the bytes that went over the cable.
#
#   benchmark/live/phone_link.sh [--photos N] [--mb MEGABYTES]      default: 100 photos of 4 MB
source "$(dirname "$0")/../../tests/harness.sh"
source "$SKEIN_ROOT/tests/session.sh"
source "$SKEIN_ROOT/tests/page.sh"
photos=100 mb=4
take_options "photos mb" "$@"
enter_network_namespace "$@"
require_page
new_workspace
url=$(test_lcm_url)
use_place 2 8 --seed 1
session=$workspace/session
add_other_host 10
nsenter --net -t "$other_host" ip link set lo up

# A photo of the place with comments of random bytes, so that it has its size: each another.
mkdir "$workspace/photos"
python3 - "$place/images/agent-1" "$workspace/photos" "$photos" "$mb" <<'PY'
import os, sys
source, target, count, mb = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
base = open(os.path.join(source, sorted(os.listdir(source))[0]), 'rb').read()
for i in range(count):
    missing, comments = int(mb * 1e6) - len(base), b''
    while missing > 0:
        n = min(65000, missing)
        comments += b'\xff\xfe' + (n + 2).to_bytes(2, 'big') + os.urandom(n)
        missing -= n + 4
    open(os.path.join(target, f'{i:04}.jpg'), 'wb').write(base[:2] + comments + base[2:])
PY
total=$(cat "$workspace"/photos/* | wc -c)
# Nothing works the photos off here, so ingest is to take all of them.
printf '[ingest]\nmax_pending = %d\nmax_pending_agent = %d\n' $((photos + 1)) $((photos + 1)) >"$workspace/config.toml"
start_services "$session" "$url" --config "$workspace/config.toml" --features 0 --matching 0 --mappers 0 --web 8600 --web-public 10.77.0.1 --web-public-port 8700 --web-plain 8701 >"$workspace/launch.log"
link=$("$SKEIN_BUILD/bin/skein" invite --session "$session" --role agent --name phone --browser | sed -n 2p)
came() { awk '/ cable:|^cable:/ { sub(/.*:/, ""); print $1 }' /proc/net/dev; }
before=$(came)
print_machine
started=$SECONDS
TMPDIR=$workspace nsenter --net -t "$other_host" node "$SKEIN_ROOT/tests/page/phone_link.mjs" "$link" "$workspace/photos" >"$workspace/page.log" 2>&1 &
page_pid=$!
has_come() { (($(came) - before > $1)) || { kill -0 "$page_pid" 2>/dev/null || fail "the phone ended: $(cat "$workspace/page.log")"; false; }; }
for cut in 1 2 3; do
  wait_until 300 "$cut quarters were sent" has_come $((total * cut / 4))
  ip link set cable down
  sleep 3 # the cut lasts so long
  ip link set cable up
done
wait "$page_pid" || { cat "$workspace/page.log"; fail "the phone failed"; }
seconds=$((SECONDS - started)) sent=$(($(came) - before))
all_stored() { (($(count_facts "$session" image) == photos)); }
wait_until 300 "all photos are in the ledger" all_stored
stored=$(cd "$session/images/phone" && sha256sum -- * | cut -d ' ' -f 1 | sort -u | wc -l)
[[ $stored == "$photos" && $(ls "$session/images/phone" | wc -l) == "$photos" ]] || fail "$stored photos are stored, not $photos once each"
stop_services
cat "$workspace/page.log"
awk -v p="$photos" -v t="$total" -v s="$sent" -v d="$seconds" 'BEGIN { printf "%d photos stored once each, three cuts of 3 s, %d s; photos %.1f MB, over the cable %.1f MB: %.3f x\n", p, d, t / 1e6, s / 1e6, s / t; exit s > 1.05 * t }' ||
  fail "more than 1.05 x was sent"
