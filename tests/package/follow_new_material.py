#!/usr/bin/env python3
"""follow_new_material.py SOURCE SCRATCH: does what docs/new_material.md says to a copy of the sources, and runs the tests of it.

A build of the soft bodies takes minutes, so it is skipped (77) without TACTUS_LONG_TESTS=1.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import textwrap


def insert_above(file: pathlib.Path, anchor: str, text: str) -> None:
    old = file.read_text()
    at = old.index(anchor)
    file.write_text(old[:at] + text + "\n\n" + old[at:])


def main() -> int:
    if os.environ.get("TACTUS_LONG_TESTS") != "1":
        print("minutes of work: set TACTUS_LONG_TESTS=1")
        return 77
    source, scratch = (pathlib.Path(p).resolve() for p in sys.argv[1:3])
    shutil.rmtree(scratch, ignore_errors=True)
    copy = scratch / "tactus"
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("build*", ".git", "out", "bundle*"))

    page = (copy / "docs/new_material.md").read_text()
    struct = textwrap.dedent(re.search(r"^ *```cpp\n(.*?)^ *```", page, re.DOTALL | re.MULTILINE)[1]).strip()
    row = re.search(r"`(ROW\(\w+, \w+\))`", page)[1]
    word = re.search(r"\((\w+),", row)[1]

    laws = copy / "src/tactus/tissue/tled/material_laws.h"
    above = re.search(r"^(///.*\n)*template <class F>\n.*with_law\(", laws.read_text(), re.MULTILINE)
    insert_above(laws, above[0], struct)
    rows = copy / "include/tactus/tissue/tled/elastic_material.h"
    last = re.search(r"^  (ROW\(\w+, \w+\))$", rows.read_text(), re.MULTILINE)[0]
    rows.write_text(rows.read_text().replace(last, f"{last} \\\n  {row}"))

    build = copy / "build"
    programs = ["tled_test", "relaxation_test", "scene_file_test"]
    subprocess.run(["cmake", "-S", copy, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DTACTUS_CUDA=OFF"],
                   check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", build, "--target", *programs], check=True, stdout=subprocess.DEVNULL)
    for program in programs:
        subprocess.run([build / "tests" / program, "--gtest_brief=1"], check=True, env=dict(os.environ, TACTUS_UPDATE_DOCS="1"))
    if word not in (copy / "docs/scene.md").read_text():
        print(f"docs/scene.md does not name the law '{word}'")
        return 1
    print(f"docs/new_material.md: '{word}' was added as it says")
    return 0


if __name__ == "__main__":
    sys.exit(main())
