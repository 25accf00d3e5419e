#!/usr/bin/env python3
"""Follows each link between installed documents: readers of a package have no sources beside them.

usage: tests/package/installed_links.py PREFIX/share/doc/tactus
"""
import pathlib
import re
import sys


def main() -> None:
    root = pathlib.Path(sys.argv[1])
    dead, followed = [], 0
    for page in sorted(root.rglob("*.md")):
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
            if re.match(r"[a-z]+:", target):
                continue
            followed += 1
            if not (page.parent / target).exists():
                dead.append(f"{page.relative_to(root)}: {target}")
    print(f"{followed} links of installed documents, {len(dead)} dead", *dead, sep="\n  ")
    sys.exit(1 if dead or followed == 0 else 0)


if __name__ == "__main__":
    main()
