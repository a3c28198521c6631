#!/usr/bin/env python3
"""Draws docs/architecture.svg: the processes, and the floors and rooms of libs/ by tests/static/layers.txt.

    docs/draw_architecture.py && rsvg-convert docs/architecture.svg -o architecture.png
"""
import os

DOCS = os.path.dirname(os.path.abspath(__file__))
WIDTH = 1200

# What comes up from the ledger and what goes back, for each stage.
STAGES = [
    ('skein agent', 'any number', 'ack', 'photo'),
    ('features', 'any number', 'image', 'features'),
    ('retrieval', 'one', 'features', 'candidates'),
    ('matching', 'any number', 'candidates', 'matches'),
    ('mapper', 'one a submap', 'matches', 'poses, model'),
    ('merger', 'one', 'poses', 'seed, merge'),
]

# The floors of libs/ from the top; column and row of each room in its floor.
FLOORS = {
    'view': {
        'web': (1, 0, 'the live view: what it shows'),
        'export': (0, 1, 'models for other programs'),
        'http': (1, 1, 'the live view: server'),
        'invite': (2, 1, 'links and QR codes')},
    'state': {
        'shapes': (0, 0, 'maps, as their mappers tell them'),
        'session': (1, 0, 'the ledger, folded'),
        'guidance': (2, 0, 'how good a surface is, what to add')},
    'dense': {
        'surface': (0, 0, 'depth maps as a mesh'),
        'depth': (1, 0, 'depth maps, dense points')},
    'images': {
        'codecs': (0, 0, 'JPEG, PNG, TIFF, EXIF; confined'),
        'photo': (1, 0, 'names, headers, the decoder child'),
        'vocabulary': (2, 0, 'trained cells of local descriptors')},
    'scene': {
        'mapping': (0, 0, 'one submap: register, adjust'),
        'merging': (1, 0, 'two submaps: align, fuse, check'),
        'covisibility': (4, 0, 'verified pairs as a graph'),
        'disambiguation': (0, 1, 'visually similar structures'),
        'map': (1, 1, 'scene map, tracks, filters'),
        'bundle': (2, 1, 'bundle adjustment'),
        'sfm': (3, 1, 'cameras, images, tracks; COLMAP'),
        'geometry': (2, 0, 'similarities, GPS, errors')},
    'net': {
        'node': (0, 0, 'what every process has'),
        'ledger': (1, 0, 'ordered facts, SQLite'),
        'blobs': (2, 0, 'stored and pulled by hash'),
        'transport': (3, 0, 'LCM links, bus, channels, roles'),
        'auth': (4, 0, 'keys, signatures of messages')},
    'base': {
        'event_loop': (0, 0, 'poll loop, worker thread'),
        'config': (1, 0, 'the options, in one TOML file'),
        'formats': (2, 0, 'contents of blobs'),
        'core': (3, 0, 'files, hashes, log, status')},
}
COLUMN_PX, ROW_PX, ROOM_WIDTH, ROOM_HEIGHT, ROOMS_TOP, ROOMS_LEFT, FLOOR_GAP = 218, 70, 196, 46, 462, 106, 12


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
    """The rooms of its own floor that each room uses directly, without those it also reaches through another."""
    uses = {}
    for line in open(os.path.join(DOCS, '../tests/static/layers.txt')):
        folder, _, used = line.partition(':')
        if not folder.startswith('libs/'):
            continue
        _, floor, room = folder.split('/')
        if room not in FLOORS[floor]:
            raise SystemExit(f'no place in the picture: {folder}')
        uses[room] = {name.split('/')[2] for name in used.split() if name.startswith(f'libs/{floor}/')}

    def reached(room):
        return uses[room].union(*(reached(used) for used in uses[room]))
    return {room: {used for used in direct if not any(used in reached(other) for other in direct - {used})}
            for room, direct in uses.items()}


def link(corners, room, used):
    (x1, y1), (x2, y2) = corners[room], corners[used]
    middle = ROOM_WIDTH / 2
    if y1 == y2:
        side = 1 if x2 > x1 else -1
        return arrow(x1 + middle + side * middle, y1 + ROOM_HEIGHT / 2, x2 + middle - side * (middle + 3), y2 + ROOM_HEIGHT / 2)
    lean = max(-0.35, min(0.35, (x2 - x1) / (4 * ROOM_WIDTH))) * ROOM_WIDTH
    return arrow(x1 + middle + lean, y1 + ROOM_HEIGHT, x2 + middle - lean, y2 - 3)


def rooms():
    """The parts, and the lower end of the lowest floor."""
    uses = uses_of_rooms()
    parts = [text(20, 420, 'Floors of libs/: a floor uses only itself and those below', 16, 'bold', 'start'),
             text(20, 442, 'An arrow leads to what a room uses on its floor. Services and clients use rooms, never each other.', 12, anchor='start', fill='#3d4650')]
    y = ROOMS_TOP
    for i, (floor, places) in enumerate(FLOORS.items()):
        height = (1 + max(row for _, row, _ in places.values())) * ROW_PX
        parts += [f'<rect x="20" y="{y}" width="{WIDTH - 30}" height="{height}" fill="#f4f4f4"/>', text(30, y + height / 2 + 5, floor, 15, 'bold', 'start')]
        top = y + (ROW_PX - ROOM_HEIGHT) / 2
        corners = {room: (ROOMS_LEFT + column * COLUMN_PX, top + row * ROW_PX) for room, (column, row, _) in places.items()}
        parts += [link(corners, room, used) for room in places for used in sorted(uses.get(room, ()))]
        for room, (_, _, note) in places.items():
            parts += box(*corners[room], ROOM_WIDTH, ROOM_HEIGHT, room, note, '#dbe9f9' if i % 2 else '#e9e0f5')
        y += height + FLOOR_GAP
    return parts, y


def main():
    libs, height = rooms()
    head = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
            'font-family="DejaVu Sans, Verdana, sans-serif">',
            '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
            '<path d="M0,0 L8,4 L0,8 z" fill="#3d4650"/></marker></defs>',
            f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>']
    with open(os.path.join(DOCS, 'architecture.svg'), 'w', encoding='utf-8') as file:
        file.write('\n'.join(head + processes() + libs + ['</svg>']) + '\n')


if __name__ == '__main__':
    main()
