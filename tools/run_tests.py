#!/usr/bin/env python3
"""Runs all test programs of a build through ctest and counts gtest cases honestly: passed, failed, skipped.

usage: tools/run_tests.py BUILD [ctest arguments]
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys


def main() -> int:
    build = pathlib.Path(sys.argv[1]).resolve()
    results = build / "test_results"
    shutil.rmtree(results, ignore_errors=True)
    results.mkdir(parents=True)
    environment = dict(os.environ, GTEST_OUTPUT=f"json:{results}/")
    ctest = subprocess.run(
        ["ctest", "--test-dir", str(build), "--output-on-failure", "-j", str(os.cpu_count() or 1), *sys.argv[2:]],
        env=environment, check=False)
    passed = failed = skipped = 0
    reasons: dict[str, int] = {}
    for file in sorted(results.glob("*.json")):
        report = json.loads(file.read_text())
        for suite in report["testsuites"]:
            for case in suite["testsuite"]:
                if case.get("result") == "SKIPPED" or case.get("status") == "NOTRUN":
                    skipped += 1
                    for why in case.get("skipped", [{}]):
                        text = why.get("message", "a device or data set is not here (run the test program to see which)").strip().splitlines()[-1]
                        reasons[text] = reasons.get(text, 0) + 1
                elif case.get("failures"):
                    failed += 1
                else:
                    passed += 1
    for text, count in sorted(reasons.items(), key=lambda item: -item[1]):
        print(f"skipped {count}: {text}")
    if ctest.returncode != 0 and failed == 0:
        failed = 1  # a program crashed, or a test that is not gtest failed
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or ctest.returncode != 0 or passed == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
