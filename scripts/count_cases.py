"""count_cases.py REPORT FOLDER: prints how many tests passed, failed and were skipped.

REPORT is ctest's JUnit file. A test with a report of GoogleTest, FOLDER/NAME.xml, counts as its cases; one that failed
though no case did, as one more that failed.
"""
import collections, os, sys
import xml.etree.ElementTree as tree

report, folder = sys.argv[1:]
counts = collections.Counter()


def kind(case):
    if case.find('failure') is not None: return 'failed'
    return 'skipped' if case.get('result') != 'completed' else 'passed'


for test in tree.parse(report).iter('testcase'):
    status = {'run': 'passed', 'fail': 'failed'}.get(test.get('status'), 'skipped')
    cases = os.path.join(folder, test.get('name') + '.xml')
    if not os.path.exists(cases):
        counts[status] += 1
        continue
    found = collections.Counter(map(kind, tree.parse(cases).iter('testcase')))
    counts += found
    if status == 'failed' and not found['failed']: counts['failed'] += 1
print(', '.join(f'{counts[kind]} {kind}' for kind in ('passed', 'failed', 'skipped')))
