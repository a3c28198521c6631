#!/usr/bin/env python3
"""Draws docs/architecture.svg: the processes, and the rooms of libs/ by tests/static/layers.txt.

    docs/draw_architecture.py && rsvg-convert docs/architecture.svg -o architecture.png
"""
import os

DOCS = os.path.dirname(os.path.abspath(__file__))
WIDTH, HEIGHT = 1200, 974

# What comes up from the ledger and what goes back, for each stage.
STAGES = [
    ('skein agent', 'any number', 'ack', 'photo'),
    ('features', 'any number', 'image', 'features'),
    ('retrieval', 'one', 'features', 'candidates'),
    ('matching', 'any number', 'candidates', 'matches'),
    ('mapper', 'one a submap', 'matches', 'poses, model'),
    ('merger', 'one', 'poses', 'seed, merge'),
]

# Column and row of each room, from the top.
ROOMS = {
    'export': (0, -1, 'models for other programs'),
    'web': (1, -1, 'the live view: server, events'),
    'shapes': (2, -1, 'maps, as their mappers tell them'),
    'node': (0, 0, 'what every process has'),
    'ledger': (0, 1, 'ordered facts, SQLite'),
    'blobs': (0, 2, 'stored and pulled by hash'),
    'transport': (0, 3, 'LCM links, bus, channels, roles'),
    'event_loop': (0, 4, 'poll loop, worker thread'),
    'session': (1, 0, 'the ledger, folded'),
    'guidance': (1.5, 2, 'how good a surface is, what to add'),
    'geometry': (1, 3, 'similarities, GPS, errors'),
    'auth': (1, 4, 'keys, signatures of messages'),
    'config': (4, 5, 'the options, in one TOML file'),
    'photo': (3, 5, 'names, headers, the decoder child'),
    'codecs': (3, 4, 'JPEG, PNG, TIFF, EXIF; confined'),
    'merging': (2, 0, 'two submaps: align, fuse, check'),
    'mapping': (3, 0, 'one submap: register, adjust'),
    'disambiguation': (2.5, 1, 'visually similar structures'),
    'map': (2.5, 2, 'scene map, tracks, filters'),
    'formats': (2, 5, 'contents of blobs'),
    'bundle': (2, 3, 'bundle adjustment'),
    'sfm': (2, 4, 'cameras, images, tracks; COLMAP'),
    'depth': (3, 3, 'depth maps, dense points'),
    'surface': (4, 3, 'depth maps as a mesh'),
    'covisibility': (4, 1, 'verified pairs as a graph'),
    'vocabulary': (3, -1, 'trained cells of local descriptors'),
    'core': (0, 5, 'files, hashes, log, status; all but covisibility use it'),
}
COLUMN_PX, ROW_PX, ROOM_WIDTH, ROOM_HEIGHT, ROOMS_TOP, ROOMS_LEFT = 236, 74, 212, 46, 538, 20


def text(x, y, words, size=13, weight='normal', anchor='middle', fill='#1b1f24'):
    return f'<text x="{x}" y="{y}" font-size="{size}" font-weight="{weight}" text-anchor="{anchor}" fill="{fill}">{words}</text>'


def box(x, y, width, height, title, note, fill):
    return [f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="5" fill="{fill}" stroke="#3d4650"/>',
            text(x + width / 2, y + height / 2 - 3, title, 14, 'bold'),
            text(x + width / 2, y + height / 2 + 14, note, 11, fill='#3d4650')]


def arrow(x1, y1, x2, y2, color='#3d4650'):
    return f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{color}" stroke-width="1.4" marker-end="url(#head)"/>'


def label(x, y, words):
    width = 7 * len(words) + 4
    return f'<rect x="{x - width / 2}" y="{y - 12}" width="{width}" height="16" fill="#ffffff"/>' + text(x, y, words, 12)


def processes():
    parts = [text(20, 30, 'Processes: each stage takes facts from the ledger and gives facts back', 16, 'bold', 'start')]
    for i, (name, copies, taken, given) in enumerate(STAGES):
        x = 20 + i * 158
        parts += box(x, 50, 132, 56, name, copies, '#dbe9f9' if i else '#fbe7cf')
        parts += [arrow(x + 40, 200, x + 40, 110), label(x + 40, 146, taken),
                  arrow(x + 96, 110, x + 96, 200), label(x + 96, 174, given)]
    parts += box(20, 204, 922, 56, 'skein-ingest', 'the one writer: checks photos, orders facts, leases work, serves blobs, writes final models', '#dff0dc')
    parts += [arrow(195, 262, 195, 306), arrow(475, 262, 475, 306), arrow(648, 262, 648, 306), arrow(820, 262, 820, 306), arrow(840, 306, 840, 264)]
    parts += box(20, 310, 350, 56, 'session folder', 'ledger.db  images/  blobs/  sparse/  report.json  keys/', '#f0f0f0')
    parts += box(390, 310, 170, 56, 'skein-guide', 'tells what to photograph next', '#dbe9f9')
    parts += box(572, 310, 152, 56, 'skein-dense', 'depth maps, dense points', '#dbe9f9')
    parts += box(736, 310, 206, 56, 'skein-web, skein', 'read the ledger; ask for the finish', '#fbe7cf')
    return parts


def uses_of_rooms():
    """The libs/ each room uses directly, without those it also reaches through another."""
    uses = {}
    for line in open(os.path.join(DOCS, '../tests/static/layers.txt')):
        folder, _, used = line.partition(':')
        if folder.startswith('libs/'):
            uses[folder[5:]] = {name[5:] for name in used.split() if name.startswith('libs/')}

    def reached(room):
        return uses[room].union(*(reached(used) for used in uses[room])) if uses[room] else set()
    return {room: {used for used in direct if used not in ('core', 'config') and not any(used in reached(other) for other in direct - {used})}
            for room, direct in uses.items()}


def corner(room):
    column, row, _ = ROOMS[room]
    return ROOMS_LEFT + column * COLUMN_PX, ROOMS_TOP + row * ROW_PX


def link(room, used):
    (x1, y1), (x2, y2) = corner(room), corner(used)
    middle = ROOM_WIDTH / 2
    if y1 == y2:
        side = 1 if x2 > x1 else -1
        return arrow(x1 + middle + side * middle, y1 + ROOM_HEIGHT / 2, x2 + middle - side * (middle + 3), y2 + ROOM_HEIGHT / 2)
    lean = max(-0.35, min(0.35, (x2 - x1) / (4 * ROOM_WIDTH))) * ROOM_WIDTH
    return arrow(x1 + middle + lean, y1 + ROOM_HEIGHT, x2 + middle - lean, y2 - 3)


def rooms():
    uses = uses_of_rooms()
    missing = set(uses) ^ set(ROOMS)
    if missing:
        raise SystemExit(f'no place in the picture, or no folder: {missing}')
    parts = [text(20, 420, 'Rooms of libs/: an arrow leads to what a room uses', 16, 'bold', 'start'),
             text(20, 442, 'What is reached through another arrow is left out. Services and clients use rooms, never each other.', 12, anchor='start', fill='#3d4650')]
    parts += [link(room, used) for room in sorted(uses) for used in sorted(uses[room])]
    for room, (column, _, note) in ROOMS.items():
        width = COLUMN_PX + ROOM_WIDTH if room == 'core' else ROOM_WIDTH
        fill = '#f0f0f0' if room == 'core' else '#dbe9f9' if column == 0 or room in ('session', 'auth', 'config') else '#e9e0f5'
        parts += box(*corner(room), width, ROOM_HEIGHT, room, note, fill)
    return parts


def main():
    head = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
            'font-family="DejaVu Sans, Verdana, sans-serif">',
            '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
            '<path d="M0,0 L8,4 L0,8 z" fill="#3d4650"/></marker></defs>',
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>']
    with open(os.path.join(DOCS, 'architecture.svg'), 'w', encoding='utf-8') as file:
        file.write('\n'.join(head + processes() + rooms() + ['</svg>']) + '\n')


if __name__ == '__main__':
    main()
