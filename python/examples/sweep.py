#!/usr/bin/env python3
"""Presses a tissue in many scenes (stiffness x friction x seed), on the cores of this machine or of a Dask cluster.

usage: sweep.py OUT.npy [--scheduler tcp://HOST:8786] [--scenes N]
Writes a table of N rows (200): young_modulus_pa, friction, seed, most_N, slip_N, state_hash. The scenes that a lost worker had
begun are run again elsewhere: rows don't depend on where or how often they were run. Needs python3-distributed.
"""
import argparse
import sys

import distributed
import numpy as np

import tactus

TABLE = np.dtype([("young_modulus_pa", "f8"), ("friction", "f8"), ("seed", "i4"), ("most_N", "f8"), ("slip_N", "f8"),
                  ("state_hash", "U32")])


def scenes(count: int) -> list[tuple[float, float, int]]:
    """Stiffness in ten steps, friction in four, and as many seeds as it takes."""
    moduli, frictions = np.geomspace(5e3, 5e4, 10), (0.0, 0.2, 0.4, 0.8)
    return [(float(moduli[k % 10]), frictions[k // 10 % 4], k // 40) for k in range(count)]


def press(young_modulus_pa: float, friction: float, seed: int) -> tuple[float, float, int, float, float, str]:
    """A ball goes 6 mm down at a place that the seed says, then 4 mm aside. A row of the table."""
    x_m, z_m = np.random.default_rng(seed).uniform(-0.01, 0.01, 2)
    world = tactus.World("cpu", tactus.Scene({
        "contact": {"friction": friction},
        "bodies": [{"name": "tissue", "shape": {"kind": "box", "size_m": [0.1, 0.04, 0.1]}, "spacing_m": 0.01,
                    "placement": {"position_m": [0, 0.02, 0]}, "material": {"young_modulus_pa": young_modulus_pa},
                    "fixed": [{"kind": "half_space", "frame": "world", "point_m": [0, 0.001, 0], "normal": [0, 1, 0]}]}],
        "obstacles": [{"name": "ball", "kind": "sphere", "radius_m": 0.02, "held": True,
                       "placement": {"position_m": [float(x_m), 0.061, float(z_m)]}}]}))
    pose, most_N, slip_N = world.pose("ball"), 0.0, 0.0
    for frame in range(40):
        pose[1, 3] = 0.061 - 0.007 * min(frame / 20, 1)
        pose[0, 3] = x_m + 0.004 * max(frame / 20 - 1, 0)
        world.set_pose("ball", pose)
        force_N = world.step(1 / 60).force_N("ball")
        most_N, slip_N = max(most_N, float(force_N[1])), float(-force_N[0])
    return young_modulus_pa, friction, seed, most_N, slip_N, world.state_hash()


def sweep(client: distributed.Client, count: int) -> np.ndarray:
    jobs = [client.submit(press, *scene, retries=3, pure=False) for scene in scenes(count)]
    return np.array(client.gather(jobs), dtype=TABLE)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.npy")
    parser.add_argument("--scheduler", help="address of a Dask scheduler; without, a process for each core here")
    parser.add_argument("--scenes", type=int, default=200)
    options = parser.parse_args()
    with distributed.Client(options.scheduler) if options.scheduler else distributed.Client(
            threads_per_worker=1, dashboard_address=None) as client:
        table = sweep(client, options.scenes)
    np.save(options.out, table)
    print(f"{len(table)} scenes: {table['most_N'].min():.2f} to {table['most_N'].max():.2f} N")
    return 0


if __name__ == "__main__":
    sys.exit(main())
