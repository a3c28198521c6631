#!/usr/bin/env bash
# The subcommands of `skein` (kSubcommands of clients/main.cc) are those that README.md lists, each once, and clients/README.md
# names each.
source "$(dirname "$0")/../harness.sh"
python3 - "$SKEIN_ROOT" <<'PY' || fail "mend the names above"
import re, sys
root = sys.argv[1] + '/'
code = open(root + 'clients/main.cc').read().split('kSubcommands = {')[1].split('\n};')[0]
section = open(root + 'README.md').read().split('\n## Commands\n')[1].split('\n## ')[0]
more = open(root + 'clients/README.md').read()
names = re.findall(r'\{"(\w+)",', code)
told = re.findall(r'^\| `(\w+)` \| \S', section, re.M)
errors = []
if len(names) != code.count('skein::Run'): errors.append('main.cc: a subcommand that is not read here')
for name in sorted(set(names) | set(told)):
    if names.count(name) != 1 or told.count(name) != 1:
        errors.append(f'{name}: {names.count(name)} times in kSubcommands, {told.count(name)} times in README.md')
errors += [f'{name}: not in clients/README.md' for name in names if f'`{name}`' not in more and f'skein {name} ' not in more]
print('\n'.join(errors) or f'{len(names)} subcommands')
sys.exit(bool(errors))
PY
