# The table of captures.sh. Input: an array of rows/SET.KIND.json.

def is_rotation: .kind | startswith("rotation");
def largest: .maps | max // 0;
# null where it did not run, or did not end
def colmap: .colmap | select(. != null and .ended) // null;
def round_to($digits): if . == null then null else . * pow(10; $digits) | round / pow(10; $digits) end;

# Skein's error over COLMAP's; null where one has none
def error_ratio:
  colmap.error.percent as $colmap
  | if .error == null or $colmap == null or $colmap == 0 then null else .error.percent / $colmap end;

# What is wrong with a row.
def faults: [
  (select(.ended | not) | "endless"),
  (select(.restarts > 0) | "crash"),
  (select(.ended and (.reported | not)) | "failed"),
  (select(.reported and (.accounted | not)) | "unaccounted"),
  (select(is_rotation and (.maps | length) > 0) | "invented"),
  (select(.mixed > 0) | "mixed"),
  (select(colmap != null and largest < 0.99 * (colmap | largest)) | "fewer"),
  (select(error_ratio != null and error_ratio > 1.1) | "error")];

def columns: [
  ["set", .set], ["kind", .kind], ["photos", .offered], ["registered", .registered], ["largest map", largest], ["maps", (.maps | length)],
  ["COLMAP: registered", (colmap | if . then .maps | add // 0 else null end)], ["COLMAP: largest", (colmap | if . then largest else null end)],
  ["COLMAP: maps", (colmap | if . then .maps | length else null end)],
  ["error, %", (.error.percent | round_to(4))], ["COLMAP: error", (colmap.error.percent | round_to(4))], ["ratio", (error_ratio | round_to(2))],
  ["placements a photo", (.placements / .offered | round_to(2))], ["wall s", (.wall_s | round_to(0))], ["CPU s", (.cpu_s | round_to(0))],
  ["matched after s", (.matched_s | round_to(0))], ["finish s", (.finish_s | round_to(0))], ["COLMAP: CPU s", (.colmap.cpu_s | round_to(0))],
  ["restarts", .restarts], ["mixed maps", .mixed], ["left out", (.causes // {} | to_entries | map("\(.value) \(.key)") | join(", "))],
  ["commit", .commit], ["faults", (faults | join(", "))]];

def markdown_row: "| " + (map(if . == null then "–" else tostring end) | join(" | ")) + " |";
def heads: {kind: "", maps: [], offered: 1, placements: 0, restarts: 0, mixed: 0} | columns | map(.[0]);
def markdown_head: (heads | markdown_row), "|" + (heads | map("---|") | join(""));
def markdown: .[] | columns | map(.[1]) | markdown_row;
def tsv: (heads | @tsv), (.[] | columns | map(.[1]) | @tsv);

def count(f): map(select(f)) | length;
def has($fault): faults | index($fault) != null;
def has_failed: any(.[]; has("endless") or has("failed") or has("crash"));
def totals:
  map(error_ratio | select(. != null)) as $ratios
  | "\(length) rows: \(map(.registered) | add // 0) of \(map(.offered) | add // 0) photos registered; \(count(has("endless"))) without end, \(count(has("failed"))) failed; "
    + "\(count(has("crash"))) with a crash (\(map(.restarts) | add // 0) in all); \(count(has("unaccounted"))) with photos unaccounted for; "
    + "\(count(has("fewer"))) of \(count(colmap != null)) with fewer photos than 0.99 x COLMAP's in the largest map; "
    + "\(count(has("error"))) of \($ratios | length) with an error above 1.1 x COLMAP's, \(if $ratios == [] then "no ratio" else "mean ratio \($ratios | add / length | round_to(3)), median \($ratios | sort | .[(length - 1) / 2 | floor] | round_to(3))" end); "
    + "\(count(has("mixed"))) with maps of two places; \(count(has("invented"))) of \(count(is_rotation)) rotations with a map";
