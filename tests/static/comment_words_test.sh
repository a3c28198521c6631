#!/usr/bin/env bash
# No comment's sentence is longer than a reader can hold. COLMAP's headers have 9 words in the median, 20
# at the 90th percentile; the table says where each folder stands.
source "$(dirname "$0")/../harness.sh"
python3 "$SKEIN_ROOT/tests/static/comment_words.py" "$SKEIN_ROOT" --limit 40 || fail "shorten the sentences above (at most 40 words)"
