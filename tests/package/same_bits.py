#!/usr/bin/env python3
"""A small library, compiled in two folders of different names with this build's flags: the same bytes.

usage: same_bits.py SOURCE BUILD SCRATCH
"""
import json
import pathlib
import shlex
import shutil
import subprocess
import sys


def compiler_words(command: str) -> list[str]:
    """Without a launcher (a compiler cache)."""
    words = shlex.split(command)
    first = next(i for i, w in enumerate(words) if pathlib.Path(w).name.startswith(("c++", "g++", "clang++")))
    return words[first:]


def main() -> int:
    source, build, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    entries = [e for e in json.loads((build / "compile_commands.json").read_text()) 
               if "/src/tactus/base/" in e["file"] and "cmake_pch" not in e["file"]]
    objects = []
    for name in ("one", "another/deeper"):
        folder = scratch / name
        shutil.rmtree(folder, ignore_errors=True)
        for part in ("src/tactus/base", "include/tactus"):
            shutil.copytree(source / part, folder / part)
        made = {}
        for entry in entries:
            moved = [w.replace(str(source), str(folder)) for w in compiler_words(entry["command"])]
            if "-include" in moved:  # a precompiled header of the other folder
                del moved[moved.index("-include"):moved.index("-include") + 2]
            target = folder / (pathlib.Path(entry["file"]).stem + ".o")
            moved[moved.index("-o") + 1] = str(target)
            written = pathlib.Path(entry["file"])
            if written.is_relative_to(build):  # sources that are compiled in groups
                group = folder / written.name
                group.write_text(written.read_text().replace(str(source), str(folder)))
                moved[moved.index("-c") + 1] = str(group)
            (folder / "build").mkdir(parents=True, exist_ok=True)
            subprocess.run(moved, cwd=folder / "build", check=True)
            made[target.name] = target.read_bytes()
        objects.append(made)
    differ = [name for name in objects[0] if objects[0][name] != objects[1][name]]
    folders = [name for name, data in objects[0].items() if str(scratch).encode() in data]
    print(f"{len(objects[0])} objects; {len(differ)} differ: {differ}; {len(folders)} hold their folder's name: {folders}")
    return 0 if objects[0] and not differ and not folders else 1


if __name__ == "__main__":
    sys.exit(main())
