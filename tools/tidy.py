#!/usr/bin/env python3
"""clang-tidy (.clang-tidy) over the host sources, in parallel; every finding is an error.

usage: tools/tidy.py [source.cpp ...]      without names: all of src/, bench/ and tests/

A file that was clean is checked again when it, a project header that it includes, .clang-tidy or the compiler's flags change
(stamps in build-tidy/stamps).
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build-tidy"
STAMPS = BUILD / "stamps"
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
FOLDERS = (ROOT / "src", ROOT / "bench", ROOT / "tests")


def with_headers(file: pathlib.Path, seen: dict[pathlib.Path, str]) -> dict[pathlib.Path, str]:
    """The file and the project's headers below it, with their texts."""
    if file not in seen:
        seen[file] = file.read_text()
        for name in INCLUDE.findall(seen[file]):
            for folder in (file.parent, *FOLDERS):
                if (folder / name).is_file():
                    with_headers((folder / name).resolve(), seen)
                    break
    return seen


def stamp_of(entry: dict, common: str) -> pathlib.Path:
    texts = with_headers(pathlib.Path(entry["file"]).resolve(), {})
    digest = hashlib.sha256((common + entry["command"]).encode())
    for path in sorted(texts):
        digest.update(texts[path].encode())
    return STAMPS / digest.hexdigest()


def check(entry: dict, stamp: pathlib.Path) -> str:
    """What clang-tidy has to say; empty when the file is clean."""
    run = subprocess.run(["clang-tidy", "-p", str(BUILD), "--quiet", "--extra-arg=-Wno-unknown-warning-option",
                          "--extra-arg=-Wno-ignored-optimization-argument", entry["file"]],
                         capture_output=True, text=True, check=False)
    if run.returncode == 0:
        stamp.touch()
        return ""
    return run.stdout.replace(f"{ROOT}/", "") or run.stderr


def self_test() -> bool:
    """clang-tidy with .clang-tidy does find a mistake."""
    bad = BUILD / "bad.cpp"
    bad.write_text("#include <utility>\nstruct S { S(S&&); int x; };\n"
                   "int f(S a) { S b = std::move(a); return a.x + b.x; }\n")
    run = subprocess.run(["clang-tidy", f"--config-file={ROOT / '.clang-tidy'}", "--quiet", str(bad), "--", "-std=c++20"],
                         capture_output=True, text=True, check=False)
    return run.returncode != 0 and "bugprone-use-after-move" in run.stdout


def main() -> int:
    if not shutil.which("clang-tidy"):
        print("tidy: clang-tidy is not here", file=sys.stderr)
        return 1
    subprocess.run(["cmake", "-S", str(ROOT), "-B", str(BUILD), "-G", "Ninja", "-DTACTUS_CUDA=OFF"],
                   stdout=subprocess.DEVNULL, check=True)
    STAMPS.mkdir(exist_ok=True)
    if not self_test():
        print("tidy: clang-tidy did not find a use after a move: something is wrong with .clang-tidy", file=sys.stderr)
        return 1
    version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True, check=True).stdout
    common = version + (ROOT / ".clang-tidy").read_text()
    entries = json.loads((BUILD / "compile_commands.json").read_text())
    wanted = {str(pathlib.Path(name).resolve()) for name in sys.argv[1:]}
    if unknown := wanted - {e["file"] for e in entries}:
        print("tidy: not part of the build: " + ", ".join(sorted(unknown)), file=sys.stderr)
        return 1
    todo = [(e, stamp_of(e, common)) for e in entries if not wanted or e["file"] in wanted]
    stale = {e["file"]: (e, stamp) for e, stamp in todo if not stamp.exists()}
    findings = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for text in pool.map(lambda job: check(*job), stale.values()):
            if text:
                findings += 1
                print(text.strip())
    print(f"tidy: {len(todo)} files, {len(stale)} checked now, " + (f"{findings} WITH FINDINGS" if findings else "clean"))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
