#!/usr/bin/env bash
# What the documents name exists: files that are linked, files of the tree in backticks or behind a comment's
# "docs/", and programs in build/release/bin.
source "$(dirname "$0")/../harness.sh"
python3 - "$SKEIN_ROOT" <<'PY' || fail "mend the references above"
import os, re, subprocess, sys
root = sys.argv[1]
tracked = subprocess.run(['git', '-C', root, 'ls-files'], capture_output=True, text=True, check=True).stdout.split('\n')
files = {path for path in tracked if os.path.exists(os.path.join(root, path))}
names = files | {'/'.join(path.split('/')[:i]) for path in files for i in range(1, path.count('/') + 1)}
cmake = '\n'.join(open(os.path.join(root, path)).read() for path in files if path.endswith('CMakeLists.txt'))
TOPS = 'libs|services|clients|tests|benchmark|scripts|docs|lcmtypes|cmake|data'
errors = []

def in_tree(path, mention):
    path = path.rstrip('/.')
    if not (path in names or any(path + end in names for end in ('.cc', '.h', '.sh'))):
        errors.append(f'{mention}: no {path}')

for doc in sorted(path for path in files if path.endswith('.md') and path != 'CHANGELOG.md'):
    text = open(os.path.join(root, doc)).read()
    for target in re.findall(r'\]\(([^)#:]+)[^):]*\)', text):
        path = os.path.normpath(os.path.join(os.path.dirname(doc), target))
        if path not in names: errors.append(f'{doc}: no {path}')
    for path in re.findall(rf'`((?:{TOPS})/[\w./-]+)', text): in_tree(path, doc)
    for name in re.findall(r'`((?:[a-z_]+/)?[a-z0-9_]+\.(?:h|cc|sh|lcm))`', text):
        if re.match(r'(base|estimators|optim|sfm|util)/', name): continue  # COLMAP's
        if not any(('/' + path).endswith('/' + name) for path in files): errors.append(f'{doc}: no file {name}')
    for program in re.findall(r'build/release/bin/([\w-]+)', text):
        if not re.search(rf'\({program}\b', cmake): errors.append(f'{doc}: no program {program}')
for source in sorted(path for path in files if path.endswith(('.h', '.cc', '.lcm', '.txt', '.sh'))):
    for path in re.findall(r'\b(docs/[\w/]+\.md)', open(os.path.join(root, source)).read()): in_tree(path, source)
print(*errors, sep='\n')
sys.exit(1 if errors else 0)
PY
