#!/usr/bin/env bash
# The metrics that skein-web exports (libs/view/web/metrics.cc) are those that docs/metrics.md lists, with their types. The dashboard
# and the rule of the cluster's autoscaler ask for these alone, by labels that they have.
source "$(dirname "$0")/../harness.sh"
python3 - "$SKEIN_ROOT" <<'PY' || fail "mend the names above"
import json, re, sys
root = sys.argv[1] + '/'
code = open(root + 'libs/view/web/metrics.cc').read()
page = open(root + 'docs/metrics.md').read()
dashboard = json.load(open(root + 'docs/deploy/grafana.json'))
errors = []

exported = {name: kind.lower() for name, kind in re.findall(r'Begin\("(\w+)",\s*k(\w+)', code)}
if len(exported) != code.count('Begin('): errors.append('metrics.cc: a Begin( that is not read here')
rows = re.findall(r'^\| `(\w+)` \| (\w+) \| ([^|]*)\|', page, re.M)
told = {name: kind for name, kind, _ in rows}
for name in sorted(exported.keys() | told.keys()):
    if exported.get(name) != told.get(name):
        errors.append(f'{name}: {exported.get(name)} in metrics.cc, {told.get(name)} in docs/metrics.md')

# Labels: before the colon of each column; Prometheus adds instance and job, a histogram le.
labels = {name: {word.split(':')[0].strip() for word in re.sub(r':.*', '', cell).split(',')} for name, _, cell in rows}
used = {name for pairs in re.findall(r'\{(\{"\w+".*?)\}\)', code, re.S) for name in re.findall(r'\{"(\w+)", (?!PhotoPhase)', pairs)}
for label in sorted(used - set().union(*labels.values())):
    errors.append(f'label {label} of metrics.cc is not in docs/metrics.md')

def check(where, expression):
    named = re.findall(r'skein_\w+', expression)
    if not named: errors.append(f'{where}: no metric of ours in {expression}')
    asked = {label for part in re.findall(r'\{([^}]*)\}', expression) for label in re.findall(r'(\w+)\s*[=!]', part)}
    asked |= {label for part in re.findall(r'by \(([^)]*)\)', expression) for label in re.findall(r'\w+', part)}
    for name in named:
        base = name if name in exported else re.sub(r'_(bucket|sum|count)$', '', name)
        if base not in exported or (base != name) != (exported[base] == 'histogram'):
            errors.append(f'{where}: no metric {name}')
        elif asked - labels.get(base, set()) - {'instance', 'job'}:
            errors.append(f'{where}: {name} has not all labels of {sorted(asked)}')

num = 0
for panel in dashboard['panels']:
    for target in panel['targets']:
        check(f'grafana.json, {panel["title"]}', target['expr'])
        num += 1
for variable in dashboard['templating']['list']:
    if variable['type'] == 'query': check('grafana.json, variables', variable['query']['query'])
rule = re.search(r'metricsQuery: >-\n((?: {6}.*\n)+)', open(root + 'packaging/kubernetes/adapter.yaml').read())[1]
for line in rule.splitlines():
    check('adapter.yaml', line)
    num += 1
print(*errors, sep='\n')
print(f'{len(exported)} metrics, {num} expressions')
sys.exit(1 if errors or not exported or not num else 0)
PY
