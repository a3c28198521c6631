#!/usr/bin/env bash
# docs/exchange.md has a row for each source file that opens a file, a folder or a database, and none for another.
source "$(dirname "$0")/../harness.sh"
python3 - "$SKEIN_ROOT" <<'PY' || fail "mend the table in docs/exchange.md"
import os, re, subprocess, sys
root = sys.argv[1]
OPENS = re.compile(r'''(?<![\w.])(?<!Array4f\ )(?:::)?(?:open|openat|fopen|freopen|opendir|memfd_create|sqlite3_open(?:_v2)?)\(
    |\bifstream\b|\bofstream\b|\bfstream\b|directory_iterator\(|\bfs::copy\(|\bVideoCapture\s+\w+;|\bimread\(|\bimwrite\(
    |\b(?:Read|Write|Open|Is|Copy)Files?(?:Below|Atomic)?\(|\bRenameBelow\(|\b(?:Read|Write)(?:Secret|Keys)File\(''', re.X)
DECLARED = re.compile(r'^\s*#include|^\s*//')
tracked = subprocess.run(['git', '-C', root, 'ls-files', '--', 'libs', 'services', 'clients'], capture_output=True, text=True, check=True)
opening = set()
for path in tracked.stdout.split():
    if not path.endswith('.cc') or path.endswith('_test.cc') or path.startswith('libs/testing/'): continue
    lines = [line for line in open(os.path.join(root, path)) if not DECLARED.match(line)]
    if any(OPENS.search(line) for line in lines): opening.add(path)
text = open(os.path.join(root, 'docs/exchange.md')).read()
rows = re.findall(r'^\| `((?:libs|services|clients)/[^`]+)` \| [^|]+ \| [^|]+ \|$', text, re.M)
errors = [f'{path}: has no row' for path in sorted(opening - set(rows))]
errors += [f'{path}: opens nothing' for path in sorted(set(rows) - opening)]
errors += [f'{path}: has {rows.count(path)} rows' for path in sorted(set(rows)) if rows.count(path) > 1]
print('\n'.join(errors) or f'{len(rows)} files open something')
sys.exit(bool(errors) or len(rows) < 40)
PY
