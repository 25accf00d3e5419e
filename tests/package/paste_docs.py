#!/usr/bin/env python3
"""Runs every block of commands of README.md and docs as it could be pasted, in a copy of the checkout's layout.

Blocks of a document run in order in one folder, in which build/tactus is the program and scenes, rigs and docs are those of
the checkout. What SKIPPED names is left out and listed; SMALLER lists every word that is replaced to make a block quick. A
command that fails, a word of SMALLER or SKIPPED that no document holds any more, and a document without its blocks are errors.
usage: paste_docs.py SOURCE BUILD SCRATCH
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

# First words of a line that make an indented block one of commands. (Others are formulas and listings of files.)
COMMANDS = re.compile(r"\s*(sudo|make|tactus|build/|python3|for |export|cmake|tools/|\.ci/|TACTUS_\w+=|git)")

# document: {beginning of a block's line: why it is not run}
SKIPPED = {
    "README.md": {"sudo apt-get": "needs a network and root", "make ": "builds: .ci/run does it"},
    "CONTRIBUTING.md": {"make ": "builds: .ci/run does it", ".ci/run": "runs this test", "tools/fuzz.sh": "ten minutes",
                        "tools/live_chaos.py": "twenty minutes"},
    "docs/calibrate.md": {"tactus calibrate ": "needs pictures of a board", "tactus calibration ": "needs a calibration of yours"},
    "docs/first_scene.md": {"build/tactus reconstruct --source videos my_rig.yaml": "needs films of yours"},
    "docs/gpu.md": {"make testbundle": "needs a GPU", "tools/gpu_report.sh": "needs a GPU"},
    "docs/live.md": {"tactus client cam0 rig.yaml": "needs a camera"},
    "docs/live_view.md": {"make view": "builds and opens a window", "build/tactus view": "opens a window: window_script does it"},
    "docs/new_material.md": {"cmake": "package_new_material follows this page", "build/tests": "the same", "TACTUS_UPDATE": "the same"},
    "docs/performance.md": {"tactus bench": "an hour of benchmarks"},
    "docs/python.md": {"make python": "builds: the test `python` has it", "PYTHONPATH": "needs that build",
                       "python3 python/examples/": "the test `python` runs them"},
    "docs/replicate.md": {"tactus reconstruct --source middlebury": "needs recordings: docs/data.md"},
    "docs/web.md": {"make web": "installs packages", "build/tactus run scenes/poke.yaml": "waits for a browser", "build/tactus view scenes/slice.yaml --web": "waits for a browser", "build/tactus run scenes/fig19": "needs the page"},
    "docs/your_cameras.md": {"tactus ": "needs films: your_cameras_test runs this page"},
}

# (document, word, what stands for it here)
SMALLER = [
    ("README.md", "--frames 30", "--frames 2"),
    ("README.md", "--resolution 128", "--resolution 48"),
    ("README.md", "scenes/first.yaml --explain", "scenes/first.yaml --explain --frames 3 --view none"),
    ("docs/data.md", "--frames 30", "--frames 2"),
    ("docs/first_scene.md", "scenes/first.yaml --json", "scenes/first.yaml --frames 3 --view none --json"),
    ("docs/first_scene.md", "scenes/first.yaml --view none --explain", "scenes/first.yaml --view none --explain --frames 3"),
    ("docs/live.md", "--frames 30 ", "--frames 2 "),
    ("docs/live.md", "--seconds 60", "--seconds 20"),
    ("docs/live.md", "--frames 300", "--frames 3"),
]


def blocks(text: str) -> list[str]:
    """Fenced blocks of a shell, and indented ones that begin with a command."""
    found = re.findall(r"^```(?:sh|bash|console)\n(.*?)^```", text, re.M | re.S)
    text = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    lines, block, fresh = text.split("\n"), [], True
    for line in [*lines, ""]:
        if line.startswith("    ") and (block or fresh):
            block.append(line)
        else:
            if block and COMMANDS.match(block[0]):
                found.append("\n".join(b.strip() for b in block))
            block = []
            fresh = line == "" or line.startswith("#")
    return found


def lay_out(source: pathlib.Path, build: pathlib.Path, folder: pathlib.Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "build").mkdir(parents=True)
    (folder / "out").mkdir()
    for name in ("scenes", "rigs", "docs"):
        (folder / name).symlink_to(source / name)
    (folder / "build/tactus").symlink_to(build / "tactus")


def skip_reason(document: str, line: str) -> str:
    return next((why for begin, why in SKIPPED.get(document, {}).items() if line.startswith(begin)), "")


def main() -> int:
    source, build, scratch = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    if not (build / "tactus").exists():
        print(f"the program is not here: {build}/tactus")
        return 77
    no_live = "ZeroMQ" in subprocess.run([build / "tactus", "info"], capture_output=True, text=True, check=True).stdout
    failed, ran = 0, 0
    documents = ["README.md", "CONTRIBUTING.md", *sorted(str(p.relative_to(source)) for p in (source / "docs").rglob("*.md"))]
    unused = {(d, w) for d, w, _ in SMALLER} | {(d, b) for d, all_of in SKIPPED.items() for b in all_of}
    for document in documents:
        folder = scratch / document.replace("/", "_")
        lay_out(source, build, folder)
        for block in blocks((source / document).read_text()):
            kept = []
            for line in block.split("\n"):
                why = skip_reason(document, line)
                unused -= {(document, b) for b in SKIPPED.get(document, {}) if line.startswith(b)}
                if not why and no_live and document == "docs/live.md":
                    why = "this build has no live cameras"
                if why:
                    print(f"skipped, {why}: {document}: {line}")
                else:
                    kept.append(line)
            script = "\n".join(kept)
            for of, word, smaller in SMALLER:
                if of == document and word in block:
                    unused.discard((of, word))
                    script = script.replace(word, smaller)
            if not kept:
                continue
            environment = dict(os.environ, PATH=f"{build}:{os.environ['PATH']}", TACTUS_DEVICES="cpu")
            done = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", script + "\n{ kill $(jobs -p) || true; } 2>/dev/null; wait || true"], cwd=folder, env=environment,
                                  capture_output=True, text=True, timeout=300, check=False)
            ran += 1
            if done.returncode != 0:
                failed += 1
                print(f"FAILED ({done.returncode}): {document}:\n{script}\n{done.stdout}{done.stderr}")
    for document, word in sorted(unused):
        failed += 1
        print(f"FAILED: no block of {document} has '{word}' any more")
    print(f"{ran} blocks ran, {failed} failures")
    return 1 if failed or ran < 6 else 0


if __name__ == "__main__":
    sys.exit(main())
