#!/usr/bin/env bash
# No comment's sentence is longer than a reader can hold. COLMAP's headers have 9 words in the median, 20
# at the 90th percentile; the table says where each folder stands. No sentence of a header or README begins
# with a word that names no thing, as in COLMAP (0.4 %) and PoseLib (0.0 %).
source "$(dirname "$0")/../harness.sh"
readonly words="$SKEIN_ROOT/tests/static/comment_words.py"
python3 "$words" "$SKEIN_ROOT" --limit 40 || fail "shorten the sentences above (at most 40 words)"
python3 "$words" "$SKEIN_ROOT" --beginnings ||
  fail "begin the sentences above with their subject, a thing that has a name in the code"
