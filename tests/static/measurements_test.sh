#!/usr/bin/env bash
# docs/measurements.md is what scripts/measurements.py makes of the records, each record has all of its fields, and the page
# has at most 300 lines and 4,000 words: `left_out` of a table leaves rows and columns to the records.
source "$(dirname "$0")/../harness.sh"
"$SKEIN_ROOT/scripts/measurements.py" --check || fail "run scripts/measurements.py"
lines=$(wc -l <"$SKEIN_ROOT/docs/measurements.md")
((lines <= 300)) || fail "docs/measurements.md has $lines lines: one value a figure, the present one"
words=$(wc -w <"$SKEIN_ROOT/docs/measurements.md")
((words <= 4000)) || fail "docs/measurements.md has $words words: leave figures to the records (left_out)"
