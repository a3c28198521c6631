#!/usr/bin/env python3
"""Words a comment sentence, folder by folder: of comments with lines of their own. Notes behind code are short by nature.

    comment_words.py [ROOT] [--headers] [--over N] [--limit N]

--headers measures .h files alone; --over N lists each sentence above N words; --limit N fails when one is,
in notes behind code, too.
"""
import argparse
import os
import re
import subprocess
import sys
from collections import defaultdict

COMMENT = re.compile(r'(?P<code>(?:[^"/]|"(?:\\.|[^"\\])*"|/(?!/))*)//[/!<]*\s?(?P<text>.*)')
ABBREVIATIONS = re.compile(r'\b(e\.g|i\.e|etc|cf|vs|al|Eq|Fig|Sec|eq|fig|sec|no)\.')
LIST_ITEM = re.compile(r'^\s*([-*]|\d+\.)\s')


def comments(path):
    """(line, texts, behind code) of each comment: whole-line comments that follow each other are one, and so is a trailing
    comment with the whole-line comments aligned below it."""
    block, start, column, behind_code = [], 0, -1, False
    for number, line in enumerate(open(path, encoding='utf-8'), 1):
        match = COMMENT.match(line.rstrip('\n'))
        is_text = match and not re.match(r'\s*(clang-format|NOLINT|IWYU)', match['text'])
        if is_text:
            at, has_code = len(match['code']), bool(match['code'].strip())
            if block and (has_code or at != column):
                yield start, block, behind_code
                block = []
            if not block:
                start, column, behind_code = number, at, has_code
            block.append(match['text'])
        elif block:
            yield start, block, behind_code
            block = []
    if block:
        yield start, block, behind_code


def sentences(block):
    """A sentence ends at . ! or ?, at an empty line, before a list's item, and around indented lines (formulas)."""
    units, in_list, was_indented = [''], False, False
    for text in block:
        is_item, is_indented = LIST_ITEM.match(text), text.startswith('  ')
        in_list = bool(is_item) or in_list and is_indented
        is_formula = is_indented and not in_list
        if not text.strip() or is_item or is_formula or was_indented:
            units.append('')
        units[-1] += ' ' + text
        was_indented = is_formula
    for unit in units:
        unit = ABBREVIATIONS.sub(r'\1', unit)
        yield from (s.strip() for s in re.split(r'(?<=[.!?])["\')]*\s+', unit) if s.strip())


def num_words(sentence):
    return len(re.findall(r'[^\s]*[A-Za-z][^\s]*', sentence))


def folder_of(path):
    parts = path.split('/')
    return '/'.join(parts[:2]) if parts[0] in ('libs', 'services') else parts[0]


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('root', nargs='?', default=os.path.join(os.path.dirname(__file__), '../..'))
    parser.add_argument('--headers', action='store_true')
    parser.add_argument('--over', type=int, metavar='N')
    parser.add_argument('--limit', type=int, metavar='N')
    arguments = parser.parse_args()
    tracked = subprocess.run(['git', '-C', arguments.root, 'ls-files', '*.h', '*.cc', '*.lcm'], check=True,
                             capture_output=True, text=True).stdout.split('\n')
    words, too_long = defaultdict(list), []
    for path in filter(None, tracked):
        full = os.path.join(arguments.root, path)
        if not os.path.exists(full) or arguments.headers and not path.endswith('.h'):
            continue
        for line, block, behind_code in comments(full):
            for sentence in sentences(block):
                count = num_words(sentence)
                if count < 2:
                    continue
                if not behind_code:
                    words[folder_of(path)].append(count)
                    words['all'].append(count)
                if count > min(arguments.over or 10**6, arguments.limit or 10**6):
                    too_long.append((count, path, line, sentence))
    for count, path, line, sentence in sorted(too_long, key=lambda found: found[1:3]):
        print(f'{path}:{line}: {count} words: {sentence}')
    print(f'{"folder":24} {"sentences":>9} {"median":>6} {"p90":>4} {"max":>4}')
    for folder in sorted(words, key=lambda name: (name == 'all', name)):
        counts = words[folder]
        print(f'{folder:24} {len(counts):9} {percentile(counts, 0.5):6} {percentile(counts, 0.9):4} {max(counts):4}')
    return 1 if arguments.limit and any(count > arguments.limit for count, *_ in too_long) else 0


if __name__ == '__main__':
    sys.exit(main())
