#!/usr/bin/env python3
"""clang-tidy (.clang-tidy) over the host sources, in parallel; every finding is an error.

usage: tools/tidy.py [source.cpp|folder ...]      without names: all of src/, bench/ and tests/

A file that was clean is checked again when it, a project header that it includes, .clang-tidy or the compiler's flags change
(stamps in build-tidy/stamps). Most of the time goes into headers, so files are checked together, as one source that includes
them, with the definitions and folders of all targets; where that finds something, its halves are looked at, down to single
files with their own flags.
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build-tidy"
STAMPS = BUILD / "stamps"
INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
MOST_TOGETHER = 10
# What a line at the margin of a source defines, and no other file of a batch may: a function, a type or a value.
DEFINED = re.compile(r"^(?:template <[^>]*> *)?(?:(?:struct|class|enum class|enum|union) (\w+) *(?:\{|: )|using (\w+) =|(?!using|namespace|extern)\w[\w:<>,&*\[\] ]+?[ &*](\w+) *[({=;\[])")
CONSTANT = re.compile(r"\b(k[A-Z]\w*) = ")  # several on a line, or of an enum
# What only files together are guilty of.
NOT_TOGETHER = "--checks=-bugprone-suspicious-include,-bugprone-forward-declaration-namespace"
FOLDERS = (ROOT / "include", ROOT / "src", ROOT / "bench", ROOT / "tests")


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


def flags_of(entry: dict) -> tuple[str, ...]:
    """The compiler's arguments without the source and its object."""
    words = shlex.split(entry["command"])[1:]
    drop = {i for i, word in enumerate(words) if word in ("-o", "-c", entry["file"])}
    return tuple(w for i, w in enumerate(words) if i not in drop and i - 1 not in {d for d in drop if words[d] == "-o"})


def flags_of_all(entries: list[dict]) -> tuple[str, ...]:
    """Flags for any files together: the folders and definitions of all of them, once, after the rest of one's."""
    rest = [w for w in flags_of(entries[0]) if not w.startswith(("-D", "-I", "-f", "-O", "-W"))]
    rest = [w for i, w in enumerate(rest) if w != "-isystem" and (i == 0 or rest[i - 1] != "-isystem")]
    wanted: dict[tuple[str, ...], None] = {}
    for flags in map(flags_of, entries):
        for i, word in enumerate(flags):
            if word == "-isystem":
                wanted[word, flags[i + 1]] = None
            elif word.startswith(("-D", "-I")):
                wanted[(word,)] = None
    return (*rest, *(word for words in wanted for word in words))


def names_of(text: str) -> set[str]:
    found = (DEFINED.match(line) for line in text.splitlines())
    return {m[1] or m[2] or m[3] for m in found if m} | set(CONSTANT.findall(text))


class Batch:
    """Files, MOST_TOGETHER at most, none of which defines a name of another or of its headers."""

    def __init__(self, entry: dict):
        file = pathlib.Path(entry["file"]).resolve()
        texts = with_headers(file, {})
        self.names = names_of(texts[file])
        self.headers = set().union(*(names_of(text) for path, text in texts.items() if path != file))
        self.entries = [entry]

    def take(self, other: "Batch") -> bool:
        if (len(self.entries) >= MOST_TOGETHER or self.names & (other.names | other.headers)
                or self.headers & other.names):
            return False
        self.names |= other.names
        self.headers |= other.headers
        self.entries += other.entries
        return True


def batches(entries: list[dict]) -> list[list[dict]]:
    made: list[Batch] = []
    for one in map(Batch, entries):
        if not any(batch.take(one) for batch in made):
            made.append(one)
    return [batch.entries for batch in made]


def check(batch: list[dict], together: tuple[str, ...], stamps: dict[str, pathlib.Path]) -> list[str]:
    """What clang-tidy has to say of each file that is not clean. `together`: flags_of_all."""
    files = [entry["file"] for entry in batch]
    source, checks = files[0], []
    if len(files) > 1:
        text = "".join(f'#include "{file}"\n' for file in files)
        source = str(BUILD / f"together-{hashlib.sha256(text.encode()).hexdigest()[:16]}.cpp")
        pathlib.Path(source).write_text(text)
        checks = [NOT_TOGETHER]
    run = subprocess.run(["clang-tidy", "--quiet", f"--config-file={ROOT / '.clang-tidy'}", *checks, source, "--",
                          *(together if len(files) > 1 else flags_of(batch[0])),
                          "-Wno-unknown-warning-option", "-Wno-ignored-optimization-argument"],
                         capture_output=True, text=True, check=False, cwd=batch[0]["directory"])
    if run.returncode == 0:
        for file in files:
            stamps[file].touch()
        return []
    if len(files) == 1:
        return [run.stdout.replace(f"{ROOT}/", "").strip() or run.stderr.strip()]
    half = len(batch) // 2
    return check(batch[:half], together, stamps) + check(batch[half:], together, stamps)


def named_by_cmake(file: pathlib.Path) -> bool:
    """Whether a CMakeLists.txt above the file says its name."""
    above = [folder / "CMakeLists.txt" for folder in file.parents if ROOT in (folder, *folder.parents)]
    return any(file.name in cmake.read_text() for cmake in above if cmake.is_file())


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
    subprocess.run(["cmake", "-S", str(ROOT), "-B", str(BUILD), "-G", "Ninja", "-DTACTUS_CUDA=OFF", "-DTACTUS_UNITY=OFF"],
                   stdout=subprocess.DEVNULL, check=True)
    STAMPS.mkdir(exist_ok=True)
    if not self_test():
        print("tidy: clang-tidy did not find a use after a move: something is wrong with .clang-tidy", file=sys.stderr)
        return 1
    version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True, check=True).stdout
    common = version + (ROOT / ".clang-tidy").read_text()
    entries = json.loads((BUILD / "compile_commands.json").read_text())
    named = [pathlib.Path(name).resolve() for name in sys.argv[1:]]
    wanted = {str(path) for path in named if path.is_file()}
    wanted |= {e["file"] for e in entries for path in named if path.is_dir() and path in pathlib.Path(e["file"]).parents}
    if missing := [str(path) for path in named if not path.exists()]:
        print("tidy: no such file or folder: " + ", ".join(missing), file=sys.stderr)
        return 1
    unbuilt = wanted - {e["file"] for e in entries}
    if strays := [file for file in sorted(unbuilt) if not named_by_cmake(pathlib.Path(file))]:
        print("tidy: no CMakeLists.txt names: " + ", ".join(strays), file=sys.stderr)
        return 1
    for file in sorted(unbuilt):  # CUDA's, or those of a library that isn't here: their flags aren't known
        print(f"tidy: SKIPPED, this build leaves it out: {pathlib.Path(file).relative_to(ROOT)}")
    if not wanted - unbuilt and wanted:
        return 0
    todo = [(e, stamp_of(e, common)) for e in entries if not wanted or e["file"] in wanted]
    stamps = {e["file"]: stamp for e, stamp in todo if not stamp.exists()}
    stale = {e["file"]: e for e, _ in todo if e["file"] in stamps}
    together = flags_of_all(entries)
    findings = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for texts in pool.map(lambda batch: check(batch, together, stamps), batches(list(stale.values()))):
            for text in texts:
                findings += 1
                print(text)
    print(f"tidy: {len(todo)} files, {len(stale)} checked now, " + (f"{findings} WITH FINDINGS" if findings else "clean"))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
