#!/usr/bin/env python3
"""What each kernel of a run waits for, by Nsight Compute (ncu), on a machine with a GPU. Of every kernel: launches,
time of one, threads, registers, cycles between two instructions of a warp, and how many of these are waits for code
("no instruction") and for global memory ("long scoreboard"). ncu runs each launch alone, so times are no frame's.

  tools/profile_kernels.py -- build/tactus-bench bench fluid --devices cuda:0
  tools/profile_kernels.py --kernels 'FindPairs|WakePoints' --skip 500 --count 20 -- build/tactus run scenes/fig18-scalpel.yaml --view none
  tools/profile_kernels.py --read kernels.csv     # what `ncu --csv` wrote before
"""
import argparse
import csv
import re
import subprocess
import sys

TIME = "gpu__time_duration.sum"
GRID, BLOCK, REGISTERS = "launch__grid_size", "launch__block_size", "launch__registers_per_thread"
STALL = "smsp__average_warps_issue_stalled_%s_per_issue_active.ratio"
CODE, MEMORY = STALL % "no_instruction", STALL % "long_scoreboard"
LATENCY = "smsp__average_warp_latency_per_inst_issued.ratio"
METRICS = [TIME, GRID, BLOCK, REGISTERS, CODE, MEMORY, LATENCY]
MICROSECONDS = {"ns": 1e-3, "us": 1.0, "ms": 1e3, "nsecond": 1e-3, "usecond": 1.0, "msecond": 1e3}


def run_ncu(options):
    command = ["ncu", "--csv", "--graph-profiling", "node", "--cache-control", "none", "--clock-control", "none",
               "--kernel-name-base", "demangled", "--metrics", ",".join(METRICS), "--kill", "yes",
               "--launch-skip", str(options.skip), "--launch-count", str(options.count)]
    if options.kernels:
        command += ["--kernel-name", "regex:" + options.kernels]
    try:
        done = subprocess.run(command + options.program, stdout=subprocess.PIPE, text=True, check=False)
    except FileNotFoundError:
        sys.exit("error: there is no ncu here; it comes with CUDA's Nsight Compute")
    return done.stdout.splitlines()


def short(name):
    """'WakePoints' of 'void tactus::detail::block_kernel<tactus::WakePoints>(T1, Count)'."""
    kernel = re.search(r"_kernel<(.*)>\(", name)
    return (kernel.group(1) if kernel else name).replace("tactus::", "")[:60]


def launches_of(lines):
    launches = {}
    for row in csv.DictReader(line for line in lines if line.startswith('"')):
        value = float(row["Metric Value"].replace(",", "") or "nan")
        if row["Metric Name"] == TIME:
            value *= MICROSECONDS[row["Metric Unit"]]
        launch = launches.setdefault(row["ID"], {"name": short(row["Kernel Name"])})
        launch[row["Metric Name"]] = value
    return list(launches.values())


def table_of(launches):
    """Rows by their share of the time, the largest first."""
    kernels = {}
    for launch in launches:
        kernels.setdefault(launch["name"], []).append(launch)
    rows = []
    for name, of_kernel in kernels.items():
        def mean(metric):
            return sum(launch[metric] for launch in of_kernel) / len(of_kernel)
        rows.append((len(of_kernel) * mean(TIME), len(of_kernel), mean(TIME), mean(GRID) * mean(BLOCK), mean(REGISTERS),
                     mean(LATENCY), mean(CODE), mean(MEMORY), name))
    return sorted(rows, reverse=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kernels", help="only those whose names match this regular expression")
    parser.add_argument("--skip", type=int, default=0, help="launches before the first that counts (0)")
    parser.add_argument("--count", type=int, default=500, help="launches that count (500)")
    parser.add_argument("--read", help="a file that ncu --csv wrote with these metrics, in place of a program")
    parser.add_argument("program", nargs="*", help="after --: the program and its arguments")
    options = parser.parse_args()
    if bool(options.read) == bool(options.program):
        parser.error("expected a program after --, or --read FILE")
    if options.read:
        with open(options.read, encoding="utf-8") as file:
            lines = file.read().splitlines()
    else:
        lines = run_ncu(options)
    launches = launches_of(lines)
    if not launches:
        sys.exit("error: no kernel was profiled; lower --skip, or see what ncu says:\n" + "\n".join(lines[-5:]))
    print("  all us  launches  each us    threads  registers  cycles   code  memory  kernel")
    for total, count, each, threads, registers, cycles, code, memory, name in table_of(launches):
        print(f"{total:8.1f} {count:9d} {each:8.2f} {threads:10.0f} {registers:10.0f} {cycles:7.1f} {code:6.1f} "
              f"{memory:7.1f}  {name}")


if __name__ == "__main__":
    main()
