#!/usr/bin/env python3
"""Words a comment sentence, folder by folder: of comments with lines of their own. Notes behind code are short by nature.

    comment_words.py [ROOT] [--headers] [--over N] [--limit N] [--beginnings]

--headers measures .h files alone; --over N lists each sentence above N words; --limit N fails when one is,
in notes behind code, too. --beginnings lists each sentence of a header (notes behind code, too) and of a README in
libs, services, clients and benchmark that begins with a word that names no thing, prints their share by folder, and fails
when there is one. A sentence that begins with a quotation mark is not looked at.
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
# Beginnings after which a reader asks "which?". This, That, These, Those and One may stand before a noun.
NAMELESS = {'what', 'who', 'whom', 'whose', 'where', 'which', 'of', 'nobody', 'none', 'it', 'they', 'others'}
POINTING = {'this', 'that', 'these', 'those', 'one'}
NUMERALS = {'two', 'three', 'four', 'five', 'six'}
NO_NOUN = set('''alone also always and are as at be becomes been by can come comes could did do does done for from had has
    have if in into is it may means might must need never no not of off on only or shall should so than that the then there
    they this those to was were what when where which who whom whose will with without would'''.split())
SUBJECT_FOLDERS = ('libs/', 'services/', 'clients/', 'benchmark/')


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


def has_nameless_subject(sentence, behind_code):
    """"One of the photos" has a noun; "This keeps" and "One that" have none: a singular noun rarely ends with one s.
    A note behind code may continue the name before it: `int num_points;  // of the map`."""
    if behind_code and re.match(r'(of|that|where|whose|which|one|none)\b', sentence):
        return False
    words = re.match(r"[A-Za-z][\w']*(?:[ /]+[\w':`]+){0,2}", sentence)
    words = words[0].lower().replace('/', ' ').split() if words else []
    if not words or words[0] in NAMELESS:
        return bool(words)
    if words[0] not in POINTING:
        return False
    following = [word for word in words[1:] if word not in NUMERALS]
    if len(words) < 2 or not following:
        return len(words) < 3
    if words[0] == 'one' and following[0] == 'of':
        return False
    is_verb = words[0] in ('this', 'that') and re.search(r'[^siu]s$', following[0])
    return following[0].strip(':`') in NO_NOUN or bool(is_verb)


def prose_of(readme):
    """(line, texts, False) of a README's paragraphs and list items, markup taken off; code, tables and headings are left out."""
    start, texts, in_code = 0, [], False
    for number, line in enumerate(open(readme, encoding='utf-8'), 1):
        in_code ^= line.startswith('```')
        is_prose = line.strip() and not in_code and not re.match(r'\s*([|#<]|```|    )', line)
        if texts and (not is_prose or LIST_ITEM.match(line)):
            yield start, texts, False
            texts = []
        if is_prose:
            start = start if texts else number
            texts.append(re.sub(r'^\s*([-*]|\d+\.)\s+|\*\*?(?=\w)|(?<=\S)\*\*', '', line.strip()))
    if texts:
        yield start, texts, False


def beginnings(root, tracked):
    """Prints the sentences that begin with a word that names no thing. Returns how many there are."""
    counts = defaultdict(lambda: [0, 0])
    for path in tracked:
        full = os.path.join(root, path)
        if not path.startswith(SUBJECT_FOLDERS) or not path.endswith(('.h', 'README.md')) or not os.path.exists(full):
            continue
        for line, block, behind_code in comments(full) if path.endswith('.h') else prose_of(full):
            for sentence in filter(lambda text: num_words(text) > 1, sentences(block)):
                is_nameless = has_nameless_subject(sentence, behind_code)
                for name in (folder_of(path), 'all'):
                    counts[name][0] += 1
                    counts[name][1] += is_nameless
                if is_nameless:
                    print(f'{path}:{line}: {sentence}')
    print(f'{"folder":24} {"sentences":>9} {"nameless":>8} {"share":>6}')
    for folder in sorted(counts, key=lambda name: (name == 'all', name)):
        total, nameless = counts[folder]
        print(f'{folder:24} {total:9} {nameless:8} {nameless / total:6.1%}')
    return counts['all'][1]


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
    parser.add_argument('--beginnings', action='store_true')
    arguments = parser.parse_args()
    patterns = ['*.h', '*README.md'] if arguments.beginnings else ['*.h', '*.cc', '*.lcm']
    tracked = subprocess.run(['git', '-C', arguments.root, 'ls-files', *patterns], check=True,
                             capture_output=True, text=True).stdout.split('\n')
    if arguments.beginnings:
        return 1 if beginnings(arguments.root, tracked) else 0
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
