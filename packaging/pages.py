#!/usr/bin/env python3
"""Manual pages and bash completion of `skein`, from what it says with --help.

  packaging/pages.py --skein PROGRAM --man FOLDER --completion FILE

FOLDER/skein.1 and one skein-SUBCOMMAND.1 each are written. The words are --help's: nothing is said twice.
"""
import argparse
import pathlib
import re
import subprocess


def help_of(program, *subcommand):
    return subprocess.run([program, *subcommand, '--help'], check=True, capture_output=True, text=True).stdout


def escaped(text):
    """Text of a line for troff. A line must not begin with a dot or a quote."""
    text = text.replace('\\', r'\e').replace('-', r'\-').replace('^', r'\(ha').replace('~', r'\(ti').replace('`', r'\(ga')
    return r'\&' + text if text[:1] in ".'" else text


def subcommands(text):
    """[(name, summary)] of the main help: lines "  NAME   SUMMARY" up to the options."""
    return re.findall(r'^  ([a-z]+) +(\S.*)$', text, re.M)


def body(lines):
    """troff lines of a help text. Usage, paragraphs, and items "  NAME   TEXT", continued by deeper lines."""
    item = None
    for line in lines:
        if not line.strip():
            item = None
            yield '.PP'
        elif item is not None and re.match(r' {6,}\S', line):
            yield escaped(line.strip())
        elif match := re.match(r'  (\S.*?)(?: {2,}(\S.*))?$', line):
            item = match[1]
            yield '.TP'
            yield r'\fB' + escaped(match[1]) + r'\fR'
            if match[2]:
                yield escaped(match[2])
        elif line.startswith('Exit codes:'):
            item = None
            yield '.SH EXIT STATUS'
            yield escaped(line.removeprefix('Exit codes:').strip())
        elif re.match(r'[A-Z][^.]*:$', line):
            yield '.SH ' + escaped(line.rstrip(':').upper())
        else:
            item = None
            yield escaped(line)


def page(name, summary, text, version, see_also):
    lines = [line for line in text.splitlines() if not line.startswith('Usage:')]
    usage = re.findall(r'^Usage: (.*)$', text, re.M) or re.findall(rf'^  ({name.replace("-", " ")} .*)$', text, re.M)
    lines = [line for line in lines if line.strip() not in usage]
    out = [f'.TH {name.upper()} 1 "" "{version}" "Skein"', '.SH NAME', escaped(f'{name} - {summary}'), '.SH SYNOPSIS']
    for line in usage:
        out += [escaped(line), '.br']
    out += ['.SH DESCRIPTION', *body(lines), '.SH SEE ALSO', escaped(', '.join(f'{other}(1)' for other in see_also))]
    return re.sub(r'(\.PP\n)+(?=\.(PP|SH|TP))', '', '\n'.join(out) + '\n')


def options_of(text):
    """Long options that begin an item, or stand beside another in one."""
    items = re.findall(r'^  (-.*?)(?: {2,}|$)', text, re.M)
    return sorted({option for item in items for option in re.findall(r'(--[a-z][-a-z]*)', item.split(' Excludes')[0])} | {'--help'})


def completion(helps):
    cases = '\n'.join(f"    {name}) words='{' '.join(options_of(text))}' ;;" for name, text in helps.items())
    return f"""# bash completion of skein: subcommands, their options, else files. Written by packaging/pages.py.
_skein() {{
  local words current=${{COMP_WORDS[COMP_CWORD]}}
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W '{' '.join(helps)} --help --version' -- "$current"))
    return
  fi
  case ${{COMP_WORDS[1]}} in
{cases}
    *) return ;;
  esac
  [[ $current != -* ]] || COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _skein skein
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--skein', required=True)
    parser.add_argument('--man', type=pathlib.Path, required=True)
    parser.add_argument('--completion', type=pathlib.Path, required=True)
    options = parser.parse_args()

    version = subprocess.run([options.skein, '--version'], check=True, capture_output=True, text=True).stdout.strip()
    main_help = help_of(options.skein)
    rows = subcommands(main_help)
    helps = {name: help_of(options.skein, name) for name, _ in rows}
    options.man.mkdir(parents=True, exist_ok=True)
    summary = 'reconstructs a place in 3D while it is photographed'
    text = page('skein', summary, main_help, version, [f'skein-{name}' for name in helps])
    (options.man / 'skein.1').write_text(text)
    for name, summary in rows:
        text = page(f'skein-{name}', summary, helps[name], version, ['skein'])
        (options.man / f'skein-{name}.1').write_text(text)
    options.completion.parent.mkdir(parents=True, exist_ok=True)
    options.completion.write_text(completion(helps))


if __name__ == '__main__':
    main()
