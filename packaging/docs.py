#!/usr/bin/env python3
"""Copies the documents for users into a folder, with valid links.

usage: docs.py FOLDER

The folder has the structure of the sources. A link to a file that is not installed is replaced by its text.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import sys

SOURCE = pathlib.Path(__file__).resolve().parent.parent
PATTERNS = ["README.md", "CHANGELOG.md", "SECURITY.md", "LICENSE", "docs/**/*.md", "docs/*.svg", "docs/*.png", "docs/NOTICE",
            "docs/modules.txt", "docs/vex.json", "protocols/**/README.md", "config/examples/*.yaml", "gateway/outputs/dds/baudgate.idl"]
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#\s]*)(#[^)]*)?\)")


def documents():
    return sorted(path.relative_to(SOURCE) for pattern in PATTERNS for path in SOURCE.glob(pattern))


def linked(text, folder, installed):
    """Returns the text of a document in `folder`, without links to files that are not installed."""
    folders = {parent for path in installed for parent in path.parents}

    def one(match):
        target = match.group(3)
        if not target or "://" in target:
            return match.group(0)
        path = pathlib.Path(os.path.normpath(folder / target))
        return match.group(0) if path in installed or path in folders else match.group(2)

    return LINK.sub(one, text)


def main(out):
    installed = set(documents())
    for path in sorted(installed):
        made = pathlib.Path(out) / path
        made.parent.mkdir(parents=True, exist_ok=True)
        content = (SOURCE / path).read_bytes()
        if path.suffix == ".md":
            content = linked(content.decode(), path.parent, installed).encode()
        made.write_bytes(content)
        made.chmod(0o644)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
