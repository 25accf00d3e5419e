#!/usr/bin/env python3
"""Runs all test programs of a build through ctest and counts cases honestly: passed, failed, skipped and why.

A test that is not a gtest program (the package test) counts as one case. Cases that need a GPU are one skipped case where
there is none, as are those on two devices of a CPU; its line says how many they are. The last line but one tells the processor time.
usage: tools/run_tests.py BUILD [ctest arguments]
"""
import collections
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree


def reason_of(skipped: ElementTree.Element) -> str:
    """gtest's message is "file:line" and, on the lines below, what was given to GTEST_SKIP."""
    lines = skipped.get("message", "").strip().splitlines()
    return " ".join(lines[1:]).strip() or "without a reason, at " + (lines[0] if lines else "an unknown place")


def join_cases_elsewhere(counts: collections.Counter, reasons: collections.Counter) -> None:
    """Every program tells its own numbers: 'no GPU here (why): 27 cases', 'cpu:2, why: 9 cases'."""
    joined: dict = {}
    for text in list(reasons):
        if found := re.fullmatch(r"((?:no GPU here|cpu:2).*): (\d+) cases", text):
            programs, cases = joined.get(found[1], (0, 0))
            count = reasons.pop(text)
            joined[found[1]] = programs + count, cases + int(found[2]) * count
    for why, (programs, cases) in joined.items():
        counts["skipped"] -= programs - 1
        reasons[f"{why}: {cases} cases of {programs} programs"] = 1


def count_gtest(file: pathlib.Path, counts: collections.Counter, reasons: collections.Counter) -> None:
    for case in ElementTree.parse(file).getroot().iter("testcase"):
        if case.find("failure") is not None:
            counts["failed"] += 1
        elif (skipped := case.find("skipped")) is not None:
            counts["skipped"] += 1
            reasons[reason_of(skipped)] += 1
        elif case.get("status") == "notrun":
            counts["skipped"] += 1
            reasons["disabled in the source"] += 1
        else:
            counts["passed"] += 1


def main() -> int:
    build = pathlib.Path(sys.argv[1]).resolve()
    results = build / "test_results"
    shutil.rmtree(results, ignore_errors=True)
    results.mkdir(parents=True)
    programs = build / "test_programs.xml"
    programs.unlink(missing_ok=True)
    ctest = subprocess.run(
        ["ctest", "--test-dir", str(build), "--output-on-failure", "-j", str(os.cpu_count() or 1),
         "--output-junit", str(programs), *sys.argv[2:]],
        env=dict(os.environ, GTEST_OUTPUT=f"xml:{results}/"), check=False)
    counts: collections.Counter = collections.Counter()
    reasons: collections.Counter = collections.Counter()
    for file in sorted(results.glob("*.xml")):
        count_gtest(file, counts, reasons)
    if programs.exists():
        for program in ElementTree.parse(programs).getroot().iter("testcase"):
            if (results / f"{program.get('name')}.xml").exists():
                continue
            if program.find("skipped") is not None:
                counts["skipped"] += 1
                reasons[(program.findtext("system-out") or "").strip() or "without a reason"] += 1
            else:  # not gtest, or it crashed
                counts["passed" if program.get("status") == "run" else "failed"] += 1
    if ctest.returncode != 0 and counts["failed"] == 0:
        counts["failed"] = 1
    join_cases_elsewhere(counts, reasons)
    for text, count in reasons.most_common():
        print(f"skipped {count}: {text}")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{used.ru_utime + used.ru_stime:.0f} CPU seconds")
    print(f"{counts['passed']} passed, {counts['failed']} failed, {counts['skipped']} skipped")
    return 1 if counts["failed"] or ctest.returncode != 0 or counts["passed"] == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
