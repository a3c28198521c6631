#!/usr/bin/env python3
"""Figures of a source tree: rooms, long files, classes and functions, options, folds, includes across layers.

  scripts/code_figures.py [TREE [TREE...]]     default: this checkout

Counts C++ as .clang-format lays it out: a definition begins in column 0 and ends with "}" or "};" there.
"""
import collections
import os
import re
import sys

FACTS = 'image features candidates matches registration submap seed merge failure finish'.split()
FACT_TYPE = re.compile(r'\b(?:skein::)?(?:const )?(' + '|'.join(FACTS) + r')(?:_\w+)?_t\b')


def sources(tree):
    for top in ('libs', 'services', 'clients', 'benchmark', 'tests'):
        for folder, _, names in os.walk(os.path.join(tree, top)):
            for name in sorted(names):
                if name.endswith(('.h', '.cc')):
                    path = os.path.join(folder, name)
                    yield os.path.relpath(path, tree), open(path).read()


def room(path):
    parts = path.split('/')
    return '/'.join(parts[:2]) if parts[0] in ('libs', 'services') else parts[0]


def is_test(path):
    return re.search(r'_test(_util)?\.|/test_|/synthetic_|^libs/testing|^tests', path) is not None


def blocks(text):
    """(first line, number of lines, text) of each definition at namespace level."""
    lines, start = text.split('\n'), None
    for i, line in enumerate(lines):
        if start is None and re.match(r'[A-Za-z~].*', line) and not re.match(r'(namespace|using|extern)\b', line):
            start = i
        if start is not None and i > start and re.match(r'};?$', line):
            yield lines[start], i - start + 1, '\n'.join(lines[start:i + 1])
            start = None
        elif start is not None and (line.endswith(';') and not line.startswith(' ')) or line == '':
            if start is not None and not any('{' in l for l in lines[start:i + 1]):
                start = None


def class_size(text):
    body = text.split('\n')[1:-1]
    methods = members = 0
    for line in body:
        if not re.match(r'  \S', line) or re.match(r'  (//|using|friend|enum|struct|class|static constexpr)', line):
            continue
        if '(' in line and not re.search(r'\w_\s*(=|\{|;)', line.split('(')[0]):
            methods += 1
        elif re.search(r'\b\w+_\s*(=[^=].*|\{.*)?;', line):
            members += 1
    return methods, members


def figures(tree):
    files = dict(sources(tree))
    rooms = collections.Counter(room(p) for p in files if not is_test(p))
    code = {p: t for p, t in files.items() if not is_test(p)}
    longest_file = max(code, key=lambda p: code[p].count('\n'))
    classes, long_functions, fields, option_files = [], [], collections.Counter(), set()
    for path, text in code.items():
        for head, length, block in blocks(text):
            kind = re.match(r'(?:template.*\n)?(class|struct) (\w+)', block)
            if kind:
                methods, members = class_size(block)
                classes.append((methods + members, methods, members, kind.group(2), path))
                if re.search(r'(Options|Limits|Tolerance)$', kind.group(2)):
                    option_files.add(path)
                    inside = path.startswith(('libs', 'services'))
                    fields[inside] += len(re.findall(r'^  [^/\n(]+;', block, re.M))
            elif '(' in block and length > 40:
                long_functions.append((length, path, head[:60]))
    constants = sum(len(re.findall(r'constexpr [^;(]*\bk[A-Z]\w*', t)) for t in code.values())
    exists = lambda p: os.path.exists(os.path.join(tree, p))
    across = collections.Counter()
    for path, text in code.items():
        user = room(path)
        for include in re.findall(r'^#include "([^"]+)"', text, re.M):
            if user.startswith(('libs', 'services', 'clients')) and exists('services/' + include):
                used = room('services/' + include)
                if used != user:
                    across[user.split('/')[0] + ' -> services'] += 1
    folds = []
    for path, text in code.items():
        kinds = set(re.findall(r'get_if<(?:const )?(?:skein::)?(\w+_t)>', text))
        kinds |= set(re.findall(r'(?:Apply|Take|On|Fold)\w*\(const (?:skein::)?(\w+_t)&', text))
        kinds = {k for k in kinds if k.split('_')[0] in FACTS}
        if path.endswith('.cc') and len(kinds) >= 3 or 'ForEachFact<' in text:
            folds.append(f'{path} ({len(kinds)})')
    top = sorted(classes)[-3:][::-1]
    print(f'# {tree}')
    print('source files a room:', ', '.join(f'{r} {n}' for r, n in sorted(rooms.items())))
    print(f'longest file: {longest_file}, {code[longest_file].count(chr(10))} lines')
    print('largest classes:', '; '.join(f'{n}: {m} methods, {v} members' for _, m, v, n, _ in top))
    print(f'functions over 40 lines: {len(long_functions)}', *(f'\n  {n} {p}: {h}' for n, p, h in sorted(long_functions)[::-1]))
    print(f'option fields: {fields[True]} in libs and services, {fields[False]} in clients and benchmarks, '
          f'in {len(option_files)} files; constants: {constants}')
    print('includes into services from elsewhere:', dict(across) or 0)
    print(f'files that fold three or more kinds of fact: {len(folds)}', *('\n  ' + f for f in sorted(folds)))


for tree in sys.argv[1:] or [os.path.join(os.path.dirname(__file__), '..')]:
    figures(tree)
