#!/usr/bin/env python3
"""Draws docs/modules.svg from docs/modules.txt. With --check: fails when the picture is not the table's.

A box is a layer, with its modules. It may include every layer below it that an arrow reaches; arrows that follow
from others (A to B to C, so A to C) are left out.
"""
import pathlib
import sys
import textwrap

HERE = pathlib.Path(__file__).parent
LEFT, WIDTH, LINE, PAD, GAP, LETTERS = 24, 640, 17, 10, 26, 96


def read():
    """name -> (layers that it names, its modules), bottom to top."""
    layers = {}
    for line in (HERE / "modules.txt").read_text().splitlines():
        name, _, named = line.strip().partition(":")
        if not name or name.startswith("#"):
            continue
        if line.startswith(" "):
            layers[latest][1].append(name)
        else:
            latest = name
            layers[name] = (named.split(), [])
    return layers


def reaches(layers, start, target):
    return any(to == target or reaches(layers, to, target) for to in layers[start][0])


def short(module, layer):
    for prefix in (f"gateway/{layer}/", f"{layer}/", "gateway/"):
        if module.startswith(prefix):
            return module[len(prefix):]
    return module


def draw(layers):
    boxes, y = {}, 24
    for name in reversed(layers):
        words = [short(module, name) for module in layers[name][1]]
        text = textwrap.wrap(" · ".join(words), LETTERS)
        height = 2 * PAD + LINE * (1 + len(text))
        boxes[name] = (y, height, text)
        y += height + GAP
    lanes, arrows = [], []
    for name in reversed(layers):
        for to in layers[name][0]:
            if not any(reaches(layers, other, to) for other in layers[name][0] if other != to):
                top, bottom = boxes[name][0] + boxes[name][1], boxes[to][0]
                lane = next((i for i, end in enumerate(lanes) if end <= top), len(lanes)) if bottom - top > GAP else -1
                if lane == len(lanes):
                    lanes.append(0)
                if lane >= 0:
                    lanes[lane] = bottom
                arrows.append((name, to, lane))
    width, height = 2 * LEFT + WIDTH + 22 * len(lanes), y
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
           'font-family="sans-serif" font-size="12">',
           '<!-- drawn by docs/draw_modules.py from docs/modules.txt: do not edit -->',
           '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
           '<path d="M0 0 L8 4 L0 8 z" fill="#6b7280"/></marker></defs>',
           f'<rect width="{width}" height="{height}" fill="white"/>']
    for name, (top, tall, text) in boxes.items():
        out.append(f'<rect x="{LEFT}" y="{top}" width="{WIDTH}" height="{tall}" rx="5" fill="#eef2f7" stroke="#374151"/>')
        out.append(f'<text x="{LEFT + PAD}" y="{top + PAD + 11}" font-weight="bold">{name}</text>')
        for index, line in enumerate(text):
            out.append(f'<text x="{LEFT + PAD}" y="{top + PAD + 11 + LINE * (index + 1)}">{line}</text>')
    for name, to, lane in arrows:
        top, tall, _ = boxes[name]
        if lane < 0:
            x = LEFT + WIDTH / 2
            path = f"M{x:g} {top + tall} V{boxes[to][0]}"
        else:
            right, x = LEFT + WIDTH, LEFT + WIDTH + 22 * (lane + 1)
            path = f"M{right} {top + tall - 12} H{x} V{boxes[to][0] + 12} H{right}"
        out.append(f'<path d="{path}" fill="none" stroke="#6b7280" marker-end="url(#tip)"/>')
    out.append("</svg>\n")
    return "\n".join(out)


picture = draw(read())
target = HERE / "modules.svg"
if "--check" in sys.argv:
    if target.read_text() != picture:
        sys.exit("docs/modules.svg is not what docs/modules.txt says: run docs/draw_modules.py")
    print("docs/modules.svg is drawn from docs/modules.txt")
else:
    target.write_text(picture)
