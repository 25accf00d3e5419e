#!/usr/bin/env python3
"""Shipped scenes run with floating-point exceptions trapped: only kernels divide by zero or overflow.

usage: trapped_scenes.py PROGRAM libtactus_trap_floats.so SCENES [--all] [--frames N]

A vectorised loop computes all lanes and chooses afterwards, so lanes that nobody asked for trap in kernels; what they chose is
checked by the tests of finite states. Code around kernels must not trap: that is a number that nobody thought of. Prints each function
that trapped, and exits 1 when it is no kernel and not in MASKED. --all runs every scene, which takes minutes (each trap costs two
signals, and liquids trap often); else those of QUICK are run.
"""
import argparse
import bisect
import os
import pathlib
import re
import subprocess
import sys
import tempfile

QUICK = ("first.yaml", "demo.yaml", "slice.yaml", "fig18-scalpel.yaml", "moved.yaml")
# Host code that the compiler vectorised, whose divisions by zero are masked in the next instruction (vdivps, vandps).
MASKED = {"tactus::Hybrid::Layout::Layout": "1 / mass, or 0 where a node has none"}
KERNEL = re.compile(r"tactus::detail::run_on_cpu<|CpuBlock<")


def symbols(program: str):
    """Begins of functions, and their names."""
    rows = []
    for line in subprocess.run(["nm", "-C", "-n", "--defined-only", program], capture_output=True, text=True, check=True).stdout.splitlines():
        row = re.match(r"([0-9a-f]+) [tTwWiu] (.*)", line)
        if row and not row.group(2).startswith(".L"):
            rows.append((int(row.group(1), 16), row.group(2)))
    return [at for at, _ in rows], [name for _, name in rows]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("preload")
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--frames", type=int, default=3)
    a = parser.parse_args()
    starts, names = symbols(a.program)
    own = os.path.basename(a.program)

    def name(file: str, offset: int) -> str:
        if os.path.basename(file) != own:
            return f"{os.path.basename(file)}+0x{offset:x}"
        return names[max(0, bisect.bisect_right(starts, offset) - 1)]

    environment = {**os.environ, "LD_PRELOAD": os.path.abspath(a.preload), "TACTUS_TRAP_REPORT": "1"}
    wrong = kernels = 0
    scenes = sorted(a.scenes.glob("*.yaml")) if a.all else [a.scenes / s for s in QUICK]
    for scene in scenes:
        with tempfile.TemporaryDirectory() as folder:
            ran = subprocess.run([os.path.abspath(a.program), "run", scene.resolve(), "--frames", str(a.frames), "--view", "none", "--devices", "cpu"],
                                 capture_output=True, text=True, check=False, cwd=folder, env=environment)
        if ran.returncode != 0:
            skips = "TACTUS_DATA" in ran.stderr
            print(f"{scene.name}: {'skipped, its data are not here' if skips else f'code {ran.returncode}'}: {ran.stderr.strip().splitlines()[-1:]}")
            wrong += 0 if skips else 1
            continue
        sites: list[list[str]] = []
        for word, file, offset in re.findall(r"^trap: (at|from) (\S+) \+0x([0-9a-f]+)", ran.stderr, re.M):
            if word == "at":
                sites.append([])
            if sites:
                sites[-1].append(name(file, int(offset, 16)))
        of_kernels = [s for s in sites if any(KERNEL.search(n) for n in s) or s[0].split("(")[0] in MASKED]
        kernels += len(of_kernels)
        print(f"{scene.name}: {len(of_kernels)} places in vectorised loops, {len(sites) - len(of_kernels)} elsewhere")
        for site in sites:
            if site not in of_kernels:
                wrong += 1
                print("  WRONG " + "\n    from ".join(n[:150] for n in site[:6]))
    print(f"{len(scenes)} scenes: {kernels} places in vectorised loops, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
