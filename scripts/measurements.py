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

A table's `left_out` names rows and columns that the page leaves to the records; true: the whole table.
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

The present figures, one value each. `scripts/measurements.py` makes this page of the records in `docs/measurements/`. They hold more figures, and
command, commit, date and machine of each. Brackets name the programs. [experiments/](experiments/) tells what was tried and rejected.

**Machines** have 2 cores, Debian 12: AMD EPYC (AVX-512 VNNI), or Intel Xeon (AMX) where the brackets say so. Times are upper bounds: other work ran
beside most runs.
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
            left_out = table.get('left_out', [])
            names = set().union(*map(left_out_names, table['records']))
            for left in [] if left_out is True else left_out:
                if left not in names:
                    yield f'{name}: {table["title"]}: no row or column {left} to leave out'
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


def left_out_names(record):
    """The names by which a table's `left_out` may leave a record out."""
    return {record['of'], record['figure'], with_unit(record['figure'], record['unit'])}


def shown_tables(section):
    """The section's tables as the page has them: without what they leave out."""
    for table in section['tables']:
        left_out = table.get('left_out', [])
        if left_out is not True:
            yield {**table, 'records': [r for r in table['records'] if not left_out_names(r) & set(left_out)]}


def programs(command):
    """The programs of a command, without their options: `skein` with its subcommand, ctest with the test."""
    for part in command.split('#')[0].split(';'):
        words = part.split()
        test = re.search(r'ctest .*(-R \S+)', part)
        yield f'ctest {test[1]}' if test else ' '.join(words[:2]) if words[0] == 'skein' else words[0]


def sources(section, table):
    """The programs that printed a table, in brackets, each with the machine where that is a Xeon."""
    told = {}
    for key in dict.fromkeys(record['run'] for record in table['records']):
        run = section['runs'][key]
        for program in programs(run['command']):
            told.setdefault(program, {})['Xeon' if 'Xeon' in run['machine'] else 'EPYC'] = None
    machines = {program: f', {" and ".join(sorted(told[program]))}' if 'Xeon' in told[program] else '' for program in told}
    return '(' + '; '.join(f'`{program}`{machines[program]}' for program in told) + ')'


def item(section, table):
    """A small table, as an item of a list."""
    rows = {}
    for record in table['records']:
        unit = '' if record['unit'] == 'ratio' else record['unit'] if record['unit'][:1] == '°' else ' ' + record['unit']
        figure = f'{record["figure"]}: {text_of(record["value"])}{unit.rstrip()}'
        rows.setdefault(record['of'], []).append(figure)
    text = f'- **{table["title"]}**. ' + ' '.join(f'*{row}*. {"; ".join(figures)}.' for row, figures in rows.items())
    if 'note' in table:
        text += ' ' + table['note']
    return text + ' ' + sources(section, table)


def grid(section, table):
    """A table with its title, note and programs above it."""
    records = table['records']
    rows = list(dict.fromkeys(record['of'] for record in records))
    columns = list(dict.fromkeys((record['figure'], record['unit']) for record in records))
    cell = {(record['of'], record['figure'], record['unit']): text_of(record['value']) for record in records}
    lines = [f'**{table["title"]}.** {table["note"]}' if 'note' in table else f'**{table["title"]}.**', '']
    lines[0] += ' ' + sources(section, table)
    head = [table['rows']] + [with_unit(*column) for column in columns]
    lines += ['| ' + ' | '.join(head) + ' |', '|' + '---|' * len(head)]
    for row in rows:
        lines.append('| ' + ' | '.join([row.strip()] + [cell.get((row, *column), '') for column in columns]) + ' |')
    return lines


def speed():
    """The items of docs/speed.json: ratios of stages and, where it has some, seconds of sessions."""
    with open(os.path.join(ROOT, 'docs/speed.json'), encoding='utf-8') as file:
        kept = json.load(file)
    ratios = ', '.join(f'{name} {value:.3f}' for name, value in kept['ratios'].items())
    yield (f'- **Ratios to the same stage of OpenCV or COLMAP in one run** (28 photos, `docs/speed.json`): {ratios}. '
           '(`benchmark/colmap/speed.sh`)')
    if 'sessions' in kept:
        yield (f'- **Sessions by kernel and number of processors** ({kept["machine"]}, `docs/speed.json`). *wall and CPU time a photo*. '
               + '; '.join(map(session, kept['sessions'].items())) + '. (`benchmark/colmap/speed.sh`)')


def session(named):
    """A session of docs/speed.json in words."""
    name, figures = named
    meter = next((unit for unit in ('joules', 'instructions') if unit in figures), None)
    return f'{name}: {figures["wall_s"]:.3f}, {figures["cpu_s"]:.3f} s' + (f', {figures[meter]:,} {meter}' if meter else '')


def page():
    lines = HEADER.rstrip('\n').split('\n')
    for name, section in sections():
        tables = list(shown_tables(section))
        about = f'{section["about"]} ' if 'about' in section else ''
        lines += ['', f'## {section["title"]}']
        lines += textwrap.wrap(f'{about}[Records](measurements/{name}).', 150, break_long_words=False, break_on_hyphens=False)
        grids = [table for table in tables if len({record['of'] for record in table['records']}) >= 4]
        items = [item(section, table) for table in tables if table not in grids]
        if 'speed' in section:
            items += speed()
        for table in grids:
            lines += [''] + grid(section, table)
        lines += [''] * bool(items) + items
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
