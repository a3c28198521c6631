#!/usr/bin/env python3
"""Makes docs/measurements.md of docs/measurements/*.json and docs/speed.json.

    measurements.py            writes docs/measurements.md
    measurements.py --check    writes nothing; exits 1 where the file differs or a record lacks a field

A file of docs/measurements is a section, in the order of the names. Its `runs` say what printed the figures: command, commit,
date (the commit's, where the day of the run was not kept) and machine. A record of its `tables` is one figure:

    of      what was measured: a row of the table; a table of up to three rows is printed as an item of a list
    figure  what was counted: a column of the table
    value   a number, a text, a list (one value a run, or a value a name in `figure`) or {"min": a, "max": b}
    unit    of the value; empty for a count, "ratio" for a quotient
    run     a key of `runs`

A figure has one value, the present one: a new run replaces the record.
"""
import json
import os
import re
import sys
import textwrap

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..')
DATA = os.path.join(ROOT, 'docs/measurements')
PAGE = os.path.join(ROOT, 'docs/measurements.md')
RUN_FIELDS = ('command', 'commit', 'date', 'machine')
RECORD_FIELDS = ('of', 'figure', 'value', 'unit', 'run')
HEADER = '''# Measurements

The present figures, one value each. `scripts/measurements.py` makes this page of the records in `docs/measurements/`, which name command, commit, date and
machine of each figure; `static.measurements` holds the page against them. [experiments/](experiments/) tells what was tried and rejected.

**Machines** have 2 cores: AMD EPYC (AVX-512 VNNI) or Intel Xeon (AMX), Debian 12. Busy: other work ran beside, so times are upper bounds.
**Photos**: `DATA` is a folder of real photos. fountain-P11: 11 photos of 3072 × 2048, laser-scan truth. south-building: 128 photos of 1600 × 1200 by two
agents, compared with COLMAP 4.2.1's poses. caliterra: 75 photos of a nadir flight. temple-ring: 47 photos. Other places are `skein sim`'s, with exact truth.
**Position error**: RMSE after a similarity alignment, in % of the largest distance between two true camera centres.
'''


def sections():
    for name in sorted(os.listdir(DATA)):
        if name.endswith('.json'):
            with open(os.path.join(DATA, name), encoding='utf-8') as file:
                yield name, json.load(file)


def errors():
    """One line for each record or run that lacks a field, and for each run without records."""
    for name, section in sections():
        used = set()
        for key, run in section['runs'].items():
            for field in RUN_FIELDS:
                if not str(run.get(field, '')).strip():
                    yield f'{name}: run {key} has no {field}'
            if not re.fullmatch(r'[0-9a-f]{7,40}', run.get('commit', '')):
                yield f'{name}: the commit of run {key} is none'
            if not re.fullmatch(r'\d{4}-\d\d-\d\d', run.get('date', '')):
                yield f'{name}: the date of run {key} is none'
        for table in section['tables']:
            seen = set()
            for record in table['records']:
                if set(record) != set(RECORD_FIELDS) or record['value'] in (None, '', [], {}):
                    yield f'{name}: {table["title"]}: a record has not the fields {", ".join(RECORD_FIELDS)}: {record}'
                    continue
                if record['run'] not in section['runs']:
                    yield f'{name}: {table["title"]}: no run {record["run"]}'
                figure = (record['of'], record['figure'], record['unit'])
                if figure in seen:
                    yield f'{name}: {table["title"]}: two values of {", ".join(figure)}'
                seen.add(figure)
                used.add(record['run'])
        yield from (f'{name}: no record of run {key}' for key in section['runs'] if key not in used)


def number(value):
    if isinstance(value, int) and abs(value) >= 10000:
        return f'{value:,}'
    return str(value)


def text_of(value):
    if isinstance(value, dict):
        return f'{number(value["min"])} to {number(value["max"])}'
    if isinstance(value, list):
        return ', '.join(number(v) for v in value)
    return number(value)


def with_unit(figure, unit):
    return f'{figure}, {unit}' if unit else figure


def origins(runs, keys, letters=None):
    """The commands of the runs, each followed by commit, date and machine of its runs."""
    by_command = {}
    for key in keys:
        run = runs[key]
        told = f'{run["commit"]}, {run["date"]}, {run["machine"]}'
        by_command.setdefault(run['command'], []).append(f'{letters[key]}: {told}' if letters else told)
    return '; '.join(f'`{command}` ({"; ".join(told)})' for command, told in by_command.items())


def item(table, runs):
    """A small table, as an item of a list."""
    rows = {}
    for record in table['records']:
        unit = '' if record['unit'] == 'ratio' else record['unit'] if record['unit'][:1] == '°' else ' ' + record['unit']
        figure = f'{record["figure"]}: {text_of(record["value"])}{unit.rstrip()}'
        rows.setdefault(record['of'], []).append(figure)
    text = f'- **{table["title"]}**. ' + ' '.join(f'*{row}*. {"; ".join(figures)}.' for row, figures in rows.items())
    if 'note' in table:
        text += ' ' + table['note']
    keys = dict.fromkeys(record['run'] for record in table['records'])
    return text + ' ' + origins(runs, keys)


def grid(table, runs):
    """A table with its title, note and commands above it. Rows of several commands have letters."""
    records = table['records']
    rows = list(dict.fromkeys(record['of'] for record in records))
    columns = list(dict.fromkeys((record['figure'], record['unit']) for record in records))
    keys = list(dict.fromkeys(record['run'] for record in records))
    letters = {key: chr(ord('a') + at) for at, key in enumerate(keys)}
    cell = {(record['of'], record['figure'], record['unit']): text_of(record['value']) for record in records}
    lines = [f'**{table["title"]}.** {table["note"]}' if 'note' in table else f'**{table["title"]}.**', '']
    lines[0] += ' ' + origins(runs, keys, letters if len(keys) > 1 else None)
    head = [table['rows']] + [with_unit(*column) for column in columns] + ([''] if len(keys) > 1 else [])
    lines += ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    for row in rows:
        cells = [row.strip()] + [cell.get((row, *column), '') for column in columns]
        if len(keys) > 1:
            cells.append(''.join(sorted({letters[record['run']] for record in records if record['of'] == row})))
        lines.append('| ' + ' | '.join(cells) + ' |')
    return lines


def speed():
    with open(os.path.join(ROOT, 'docs/speed.json'), encoding='utf-8') as file:
        kept = json.load(file)
    ratios = ', '.join(f'{name} {value:.3f}' for name, value in kept['ratios'].items())
    return (f'- **Ratios to the same stage of OpenCV or COLMAP in one run** (28 photos, `docs/speed.json`): {ratios}. '
            f'`benchmark/colmap/speed.sh` ({kept["commit"]}, {kept["machine"]})')


def page():
    lines = HEADER.rstrip('\n').split('\n')
    for name, section in sections():
        lines += ['', f'## {section["title"]}']
        if 'about' in section:
            lines += textwrap.wrap(section['about'], 150, break_long_words=False, break_on_hyphens=False)
        grids = [table for table in section['tables'] if len({record['of'] for record in table['records']}) >= 4]
        items = [item(table, section['runs']) for table in section['tables'] if table not in grids]
        if 'speed' in section:
            items.append(speed())
        for at, table in enumerate(grids):
            lines += [''] * (at > 0 or 'about' in section) + grid(table, section['runs'])
        lines += [''] * bool(grids and items) + items
    return '\n'.join(lines) + '\n'


def main():
    if sys.argv[1:] not in ([], ['--check']):
        sys.exit(__doc__)
    wrong = list(errors())
    if wrong:
        sys.exit('\n'.join(wrong))
    made = page()
    if sys.argv[1:]:
        with open(PAGE, encoding='utf-8') as file:
            if file.read() != made:
                sys.exit('docs/measurements.md differs from its records: run scripts/measurements.py')
        return
    with open(PAGE, 'w', encoding='utf-8') as file:
        file.write(made)


if __name__ == '__main__':
    main()
