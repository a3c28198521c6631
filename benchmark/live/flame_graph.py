#!/usr/bin/env python3
"""Draws where processor time went, as a flame graph in SVG: a column is a call stack, its width the share of samples.

    perf record -F 49 -a --call-graph dwarf,8192 -o FILE -- COMMAND
    perf script -i FILE | benchmark/live/flame_graph.py --title TEXT [--processes REGEX] > PICTURE.svg

--processes  only samples of processes whose name matches (default: skein)
Stacks are drawn from the process downwards; what is narrower than 0.2 % is left out. Hover over a box for its name and share.
"""
import argparse
import html
import re
import sys

WIDTH, ROW, MIN_SHARE, MAX_DEPTH = 1200, 16, 0.002, 26


class Frame:
    def __init__(self):
        self.samples = 0
        self.children = {}


def shorten(symbol):
    """A C++ name without templates, arguments and the namespaces that all have."""
    symbol = re.sub(r'\+0x[0-9a-f]+$', '', symbol).replace('(anonymous namespace)::', '')
    while re.search(r'<[^<>]*>', symbol):
        symbol = re.sub(r'<[^<>]*>', '', symbol)
    symbol = re.sub(r'\(.*', '', symbol)
    return re.sub(r'^(?:.* )?(?:skein::)?', '', symbol) or '?'


def is_plain(name):
    """Frames that tell nothing: threads' beginnings, function objects, unknown addresses."""
    return name == '[unknown]' or re.match(r'(_Function_handler|function::|__invoke|start_thread|clone|__clone|_start|'
                                           r'__libc_start|operator$|main$|std::|_M_invoke|execute_native)', name) is not None


def read_stacks(lines, processes):
    """Yields (process, [outermost frame, ...]) of each sample of `perf script`."""
    process, stack = None, []
    for line in lines:
        if line.strip() and not line[0].isspace():
            process, stack = line.split()[0], []
        elif line.strip():
            stack.append(shorten(re.sub(r'^\s*[0-9a-f]+ (.*) \([^()]*\)$', r'\1', line.rstrip())))
        elif process is not None:
            if processes.search(process):
                yield process, [name for name in reversed(stack) if not is_plain(name)]
            process = None


def colour(name):
    hue = sum(ord(c) * (i + 7) for i, c in enumerate(name)) % 55
    return f'hsl({hue}, 75%, 68%)'


def draw(frame, name, x, depth, total, out):
    width = WIDTH * frame.samples / total
    label = html.escape(f'{name}: {100 * frame.samples / total:.1f} %')
    out.append(f'<g><title>{label}</title><rect x="{x:.1f}" y="{depth * ROW + 30}" width="{width:.1f}" height="{ROW - 1}" '
               f'fill="{colour(name)}"/>')
    if width > 24:
        out.append(f'<text x="{x + 3:.1f}" y="{depth * ROW + 41}">{html.escape(name[:int(width / 6.2)])}</text>')
    out.append('</g>')
    deepest = depth
    for child_name, child in sorted(frame.children.items()):
        if child.samples >= MIN_SHARE * total and depth < MAX_DEPTH:
            deepest = max(deepest, draw(child, child_name, x, depth + 1, total, out))
        x += WIDTH * child.samples / total
    return deepest


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--title', required=True)
    parser.add_argument('--processes', type=re.compile, default=re.compile('skein'))
    arguments = parser.parse_args()
    root = Frame()
    for process, stack in read_stacks(sys.stdin, arguments.processes):
        frame = root
        frame.samples += 1
        for name in [process, *stack]:
            frame = frame.children.setdefault(name, Frame())
            frame.samples += 1
    if root.samples == 0:
        sys.exit('flame_graph: no sample of such a process; is this the output of perf script?')
    boxes = []
    depth = draw(root, 'all', 0, 0, root.samples, boxes)
    print(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {(depth + 1) * ROW + 36}" '
          'font-family="sans-serif" font-size="11">')
    print(f'<rect width="100%" height="100%" fill="#fff"/><text x="4" y="19" font-size="14">{html.escape(arguments.title)}, '
          f'{root.samples} samples</text>')
    print('\n'.join(boxes))
    print('</svg>')


if __name__ == '__main__':
    main()
