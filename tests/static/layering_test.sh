#!/usr/bin/env bash
# Each folder links and includes only what layers.txt allows it: checked in CMake's own link graph and in
# the #include lines. Benchmarks may use every library and the algorithms of the services. Tests may use more.
# A header that only tests and benchmarks include stands in libs/testing or benchmark/, never in a product folder.
# COLMAP is included by libs/scene/sfm/colmap_api.h alone, and that by .cc files of libs/scene/sfm.
source "$(dirname "$0")/../harness.sh"
python3 - "$SKEIN_ROOT" "$SKEIN_BUILD/link_graph.txt" <<'PY' || fail "see above: layers.txt says what may be used"
import os, re, sys
root, graph = sys.argv[1:]
allowed = {}
for line in open(os.path.join(root, 'tests/static/layers.txt')):
    if not line.strip() or line.startswith('#'): continue
    folder, _, uses = line.partition(':')
    allowed[folder] = set(uses.split())

# Each uses itself and those before it.
FLOORS = re.search(r'set\(SKEIN_FLOORS ([a-z ]+)\)', open(os.path.join(root, 'cmake/SkeinTargets.cmake')).read())[1].split()
def room(path):
    parts = path.split('/')
    depth = 2 if parts[0] == 'services' or parts[:2] in (['libs', 'testing'], ['clients', 'places']) else 3 if parts[0] == 'libs' else 1
    return '/'.join(parts[:depth])

errors = []
for folder, uses in allowed.items():
    for used in uses:
        floors = [FLOORS.index(name.split('/')[1]) for name in (folder, used) if name.startswith('libs/')]
        if len(floors) == 2 and floors[0] < floors[1]: errors.append(f'layers.txt: {folder} lies below {used}')
        if not folder.startswith('services') and used.startswith('services'): errors.append(f'layers.txt: {folder} may not use {used}')

folder_of, links_of = {}, {}
for line in open(graph):
    target, folder, links = re.match(r'(\S+) (\S*): ?(.*)', line).groups()
    folder_of[target], links_of[target] = room(folder), links.split()
folder_of['skein_lcmtypes'] = 'lcmtypes'
is_test = lambda target: target.endswith('_test') or folder_of[target] == 'libs/testing'
num_links = 0
for target, links in links_of.items():
    user = folder_of[target]
    if user in ('', 'benchmark', 'tests') or is_test(target): continue
    for link in links:
        used = folder_of.get(link)
        num_links += 1
        if used is None or used != user and used not in allowed.get(user, ()):
            errors.append(f'{target} ({user}) links {link} ({used})')

PREFIXES = (*(f'libs/{floor}/' for floor in FLOORS), 'libs/', 'services/', '')
def find(include):
    return next((prefix + include for prefix in PREFIXES if os.path.exists(os.path.join(root, prefix + include))), None)

num_includes = 0
headers_of = {}
for top in ('libs', 'services', 'clients'):
    for folder, _, names in os.walk(os.path.join(root, top)):
        for name in names:
            if not name.endswith(('.h', '.cc')) or re.search(r'_test\.cc', name) or folder.endswith('libs/testing'): continue
            path = os.path.relpath(os.path.join(folder, name), root)
            user = room(path)
            includes = re.findall(r'^#include "([^"]+)"', open(os.path.join(root, path)).read(), re.M)
            headers_of[path] = {find(include) for include in includes}
            for include in includes:
                header = find(include)
                used = 'lcmtypes' if include.startswith('skein/') else room(header) if header else None
                if used is None or used == user: continue
                num_includes += 1
                if include == 'map/map_access.h': errors.append(f'{path} changes a map past SceneMap')
                if used not in allowed.get(user, ()): errors.append(f'{path} includes {include} ({used})')

# Headers that a source of a product reaches; its own does not count: foo.cc includes foo.h.
reached, todo = set(), [path for path in headers_of if path.endswith('.cc')]
while todo:
    path = todo.pop()
    found = headers_of.get(path, set()) - reached - {None, path[:-3] + '.h'}
    reached |= found
    todo += found
errors += [f'{path} is included by tests and benchmarks alone: libs/testing' for path in sorted(headers_of)
           if path.endswith('.h') and path not in reached]
COLMAP = r'^\s*#\s*include\s*[<"](?:skein_colmap/)?(?:colmap|base|estimators|feature|optim|util)/[^">]*[">]'
names_colmap = set()
for top in ('libs', 'services', 'clients', 'benchmark', 'tests'):
    for folder, _, names in os.walk(os.path.join(root, top)):
        for name in names:
            if not name.endswith(('.h', '.cc')): continue
            path = os.path.relpath(os.path.join(folder, name), root)
            text = open(os.path.join(root, path)).read()
            if path != 'libs/scene/sfm/colmap_api.h' and re.search(COLMAP, text, re.M): errors.append(f'{path} includes COLMAP')
            if re.search(r'\bcolmap::', text): names_colmap.add(path)
            if '#include "sfm/colmap_api.h"' in text and not re.fullmatch(r'libs/scene/sfm/\w+\.cc', path):
                errors.append(f'{path} includes sfm/colmap_api.h')
errors += [f'{path} names colmap::' for path in sorted(names_colmap) if not path.startswith('libs/scene/sfm/')]
if len(names_colmap) < 5: errors.append('COLMAP is named nowhere: this test looks for it in vain')
print(*errors, sep='\n')
if num_links < 40 or num_includes < 200: sys.exit(f'only {num_links} links and {num_includes} includes were found')
sys.exit(1 if errors else 0)
PY
