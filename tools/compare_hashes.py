#!/usr/bin/env python3
"""Runs scenes by two programs and compares the hashes of their states: a change that is only to be faster
changes none.

    tools/compare_hashes.py BEFORE AFTER [--frames 20] [--devices cpu cpu:3] [scenes/demo.yaml ...]

Without scenes, all of scenes/ are run; those whose data aren't there are counted. Exit code 1: hashes differ.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent


def state_hash(program, scene, devices, frames):
    """The hash after so many frames; None where the program refuses the scene."""
    with tempfile.TemporaryDirectory() as folder:
        results = pathlib.Path(folder) / "results.json"
        command = [program, "run", scene, "--devices", devices, "--frames", str(frames), "--view", "none",
                   "--json", str(results)]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if not results.exists():
            print(f"{scene} {devices}: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else done.returncode}")
            return None
        return json.loads(results.read_text())["state_hash"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=lambda p: str(pathlib.Path(p).resolve()))
    parser.add_argument("after", type=lambda p: str(pathlib.Path(p).resolve()))
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--devices", nargs="+", default=["cpu", "cpu:3"])
    options = parser.parse_args()
    scenes = options.scenes or sorted(str(p.relative_to(ROOT)) for p in (ROOT / "scenes").glob("*.yaml"))
    same = different = refused = 0
    for scene in scenes:
        for devices in options.devices:
            hashes = [state_hash(p, scene, devices, options.frames) for p in (options.before, options.after)]
            if hashes == [None, None]:
                refused += 1
            elif hashes[0] == hashes[1]:
                same += 1
            else:
                different += 1
                print(f"{scene} {devices}: {hashes[0]}, then {hashes[1]}")
    print(f"{same} states are the same, {different} differ; {refused} runs were refused by both")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
