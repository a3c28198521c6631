"""clang-tidy over the sources of a build, within a bounded time.

  tidy.py ROOT BUILD BUDGET_S [JOBS]

The files that a unity build compiles as one are looked at as one: most of the time goes into headers of others.
What was found clean is not looked at again while its files, the headers of ours that they include, its compile
command and .clang-tidy are the same: BUILD/tidy_cache.json remembers. Files of the last commit and those changed
since come first, then those whose headers changed, then the rest, in an order that the commit decides, so that runs
without a cache reach every file in time. A finding fails; what the time did not suffice for is counted and said.
"""
import concurrent.futures, hashlib, json, os, re, shlex, subprocess, sys, time

# Folders that are clean. The others join as they are made so.
FOLDERS = ('libs/base/core', 'libs/net/auth', 'libs/base/config', 'libs/base/event_loop', 'libs/net/transport', 'libs/base/formats', 'libs/net/blobs', 'libs/scene/bundle',
           'libs/scene/covisibility', 'libs/scene/disambiguation', 'libs/net/ledger', 'libs/net/node', 'libs/images/photo', 'libs/state/session')

root, build, budget_s = os.path.realpath(sys.argv[1]), sys.argv[2], float(sys.argv[3])
num_jobs = int(sys.argv[4]) if len(sys.argv) > 4 else os.cpu_count()
cache_path = os.path.join(build, 'tidy_cache.json')
text_of = {}


def read(path):
    if path not in text_of: text_of[path] = open(path, errors='replace').read()
    return text_of[path]


def headers(path):
    """Headers of ours that `path` includes, directly or not."""
    found, todo = set(), [path]
    while todo:
        for name in re.findall(r'^#include "([^"]+)"', read(todo.pop()), re.M):
            for folder in ('libs', 'services', ''):
                header = os.path.join(root, folder, name)
                if os.path.isfile(header) and header not in found:
                    found.add(header)
                    todo.append(header)
                    break
    return sorted(found)


def arguments(command):
    """Without output, warnings as errors and what only GCC's precompiled headers want."""
    kept, words = [], iter(shlex.split(command)[1:])
    for word in words:
        if word in ('-o', '-c', '-include', '-Xclang'): next(words)
        elif word not in ('-fpch-preprocess', '-Winvalid-pch', '-Werror'): kept.append(word)
    return kept


def files_of(source):
    """What is compiled as `source`: the files that a unity build's includes, else itself."""
    if '/Unity/' not in source: return [source]
    return [os.path.realpath(path) for path in re.findall(r'^#include "([^"]+)"', read(source), re.M)]


def digest(source, flags):
    sha = hashlib.sha256(read(os.path.join(root, '.clang-tidy')).encode() + ' '.join(flags).encode())
    for file in files_of(source):
        for path in [file] + headers(file): sha.update(read(path).encode())
    return sha.hexdigest()


def git(*words):
    return subprocess.run(['git', '-C', root, *words], capture_output=True, text=True).stdout.split()


def look(source, flags, folder):
    run = subprocess.run(['clang-tidy', '--quiet', source, '--', *flags], cwd=folder, capture_output=True, text=True)
    return run.returncode, run.stdout or run.stderr


def main():
    start_s = time.monotonic()
    cache = json.load(open(cache_path)) if os.path.exists(cache_path) else {}
    jobs = {}
    for entry in json.load(open(os.path.join(build, 'compile_commands.json'))):
        source = os.path.realpath(entry['file'])
        if not any(os.path.relpath(os.path.dirname(file), root) in FOLDERS for file in files_of(source)): continue
        name = os.path.relpath(source, root)
        if source.endswith(('.cc', '.cxx')): jobs.setdefault(name, (source, arguments(entry['command']), entry['directory']))
    digests = {name: digest(source, flags) for name, (source, flags, _) in jobs.items()}
    todo = [name for name in jobs if cache.get(name) != digests[name]]
    changed = {os.path.join(root, name) for name in git('diff', '--name-only', 'HEAD~1')}
    commit = ''.join(git('rev-parse', 'HEAD'))

    def turn(name):
        files = files_of(jobs[name][0])
        is_changed, has_changed_headers = changed.intersection(files), any(changed.intersection(headers(file)) for file in files)
        return 0 if is_changed else 1 if has_changed_headers else 2, hashlib.sha256((commit + name).encode()).hexdigest()

    def work(name):
        if time.monotonic() - start_s > budget_s: return name, None
        return name, look(*jobs[name])

    def num_files(names): return sum(len(files_of(jobs[name][0])) for name in names)

    looked_at, num_found = [], 0
    with concurrent.futures.ThreadPoolExecutor(num_jobs) as pool:
        for name, result in pool.map(work, sorted(todo, key=turn)):
            if result is None: continue
            looked_at.append(name)
            if result[0] == 0:
                cache[name] = digests[name]
                json.dump(cache, open(cache_path, 'w'), indent=0)
            else:
                num_found += 1
                print(result[1], flush=True)
    num_all, num_looked_at, num_todo = num_files(jobs), num_files(looked_at), num_files(todo)
    print(f'{num_all} files: {num_looked_at} looked at in {time.monotonic() - start_s:.0f} s, {num_all - num_todo} unchanged '
          f'since they were found clean, {num_todo - num_looked_at} not reached; {num_found} findings')
    if num_all < 40: sys.exit(f'only {num_all} files in compile_commands.json')
    sys.exit(1 if num_found else 0)


main()
