#!/usr/bin/env python3
"""Draws docs/rooms.svg from docs/rooms.txt. With --check: fails when the picture is not the table's.

A room stands above every room that it may enter. An arrow that follows from others (A to B to C, so A to C) is
left out, and so are those to gateway/base and config/model, which nearly every room enters.
"""
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
EVERYWHERE = {"gateway/base", "config/model"}
COLOURS = {"config": "#dbeafe", "protocols": "#fef3c7", "transports": "#dcfce7", "gateway": "#f3f4f6"}
LEGEND = ('An arrow: may include. Grey rooms lie in gateway/. Not drawn: arrows that follow from others,',
          'and those to base and config/model, which nearly every room may enter.')
WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 128, 30, 14, 44, 24


def read_rooms():
    rooms = {}
    for line in (HERE / "rooms.txt").read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        name, _, entries = line.partition(":")
        folders = {entry.rsplit("/", 1)[0] if entry.endswith(".h") else entry for entry in entries.split()}
        rooms[name] = folders - EVERYWHERE
    return rooms


def reachable(rooms, start):
    seen, todo = set(), list(rooms[start])
    while todo:
        room = todo.pop()
        if room not in seen:
            seen.add(room)
            todo += rooms[room]
    return seen


def reduce(rooms):
    """Leaves out each arrow that a longer way makes needless."""
    return {room: {to for to in targets if not any(to in reachable(rooms, other) for other in targets - {to})}
            for room, targets in rooms.items()}


def floors(rooms):
    """The rooms of each floor: a room stands one above the highest that it enters, then as near to who enters it as it can."""
    floor = {}
    for room in rooms:
        floor[room] = 1 + max((floor[to] for to in rooms[room]), default=0)
    for room in reversed(rooms):
        floor[room] = min((floor[by] for by in rooms if room in rooms[by]), default=floor[room] + 1) - 1
    for room in EVERYWHERE:
        floor[room] = 0
    rows = [[] for _ in range(max(floor.values()) + 1)]
    for room in rooms:
        rows[floor[room]].append(room)
    return rows


def order(rows, arrows):
    """Rooms of a floor stand near the rooms that they enter and that enter them: fewer arrows cross."""
    near = {room: arrows[room] | {by for by in arrows if room in arrows[by]} for room in arrows}
    place = {}
    for _ in range(12):
        for row in rows:
            def middle(room):
                known = [place[other] for other in near[room] if other in place]
                return sum(known) / len(known) if known else 0
            row.sort(key=middle)
            for index, room in enumerate(row):
                place[room] = index - (len(row) - 1) / 2
    return rows


def draw(rooms):
    arrows = reduce(rooms)
    rows = order(floors(rooms), arrows)
    most = max(len(row) for row in rows)
    width = 2 * MARGIN + most * (WIDTH + GAP_X) - GAP_X
    height = 2 * MARGIN + len(rows) * (HEIGHT + GAP_Y) - GAP_Y + 36
    at = {}
    for floor, row in enumerate(rows):
        left = (width - (len(row) * (WIDTH + GAP_X) - GAP_X)) / 2
        for index, room in enumerate(row):
            at[room] = (left + index * (WIDTH + GAP_X), MARGIN + (len(rows) - 1 - floor) * (HEIGHT + GAP_Y))
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
           'font-family="sans-serif" font-size="12">',
           '<!-- drawn by docs/draw_rooms.py from docs/rooms.txt: do not edit -->',
           '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
           '<path d="M0 0 L8 4 L0 8 z" fill="#6b7280"/></marker></defs>',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    for room, targets in arrows.items():
        for to in sorted(targets):
            x1, y1 = at[room][0] + WIDTH / 2, at[room][1] + HEIGHT
            x2, y2 = at[to][0] + WIDTH / 2, at[to][1]
            bend = (y2 - y1) / 2
            out.append(f'<path d="M{x1:g} {y1:g} C{x1:g} {y1 + bend:g} {x2:g} {y2 - bend:g} {x2:g} {y2:g}" fill="none" '
                       'stroke="#6b7280" marker-end="url(#tip)"/>')
    for room, (x, y) in at.items():
        fill = COLOURS[room.split("/")[0]]
        label = room.removeprefix("gateway/")
        out.append(f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5" fill="{fill}" stroke="#374151"/>')
        out.append(f'<text x="{x + WIDTH / 2:g}" y="{y + HEIGHT / 2 + 4:g}" text-anchor="middle">{label}</text>')
    for index, text in enumerate(LEGEND):
        out.append(f'<text x="{MARGIN}" y="{height - 24 + 16 * index}" fill="#4b5563">{text}</text>')
    out.append('</svg>\n')
    return "\n".join(out)


picture = draw(read_rooms())
target = HERE / "rooms.svg"
if "--check" in sys.argv:
    if target.read_text() != picture:
        sys.exit("docs/rooms.svg is not what docs/rooms.txt says: run docs/draw_rooms.py")
    print("docs/rooms.svg is drawn from docs/rooms.txt")
else:
    target.write_text(picture)
