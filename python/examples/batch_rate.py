#!/usr/bin/env python3
"""Frames of many worlds a second: a block of soft tissue in each, pressed by a ball, as in reinforcement learning.

    python3 python/examples/batch_rate.py --devices cuda:0 --worlds 1024

Each world has another stiffness. Some are run again alone, and must have the same bits. Rates of other programs on
scenes of their own, as Newton's 11,808 and PhysX's 18,622 environment steps a second, are not of this scene."""
import argparse
import json
import os
import time

os.environ.setdefault("CUDA_DEVICE_MAX_CONNECTIONS", "32")  # queues of a GPU that streams are spread over: 8, else
import numpy as np
import tactus

DT_S = 1 / 60


def scene(cubes: tuple[int, int, int], spacing_m: float = 0.01) -> tactus.Scene:
    x_m, y_m, z_m = (n * spacing_m for n in cubes)
    return tactus.Scene({
        "bodies": [{"name": "tissue", "shape": {"kind": "box", "size_m": [x_m, y_m, z_m]}, "spacing_m": spacing_m,
                    "placement": {"position_m": [0, y_m / 2, 0]}, "material": {"young_modulus_pa": 10000},
                    "fixed": [{"kind": "half_space", "frame": "world", "point_m": [0, 0.001, 0], "normal": [0, 1, 0]}]}],
        "obstacles": [{"name": "ball", "kind": "sphere", "radius_m": 0.025, "held": True,
                       "placement": {"position_m": [0, y_m + 0.03, 0]}}]})


def stiffen(world: tactus.World, k: int) -> None:
    world.parameters["bodies.tissue.material.young_modulus_pa"] = 8000 + 4000 * ((37 * k) % 64) / 63


def go_down(world: tactus.World, frame: int) -> None:
    """In ten frames, 10 mm into the surface. There it stays."""
    if frame < 10:
        pose = world.pose("ball")
        pose[1, 3] -= 0.0015
        world.set_pose("ball", pose)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--devices", default="cpu", help="'cpu', 'cuda:0'")
    arguments.add_argument("--worlds", type=int, default=16)
    arguments.add_argument("--cubes", type=int, nargs=3, default=(20, 10, 10), metavar=("X", "Y", "Z"))
    arguments.add_argument("--frames", type=int, default=30, help="that are timed, after 12 others")
    arguments.add_argument("--check", type=int, default=3, help="so many worlds are run again alone")
    arguments.add_argument("--json", help="a file for the figures")
    given = arguments.parse_args()

    described = scene(tuple(given.cubes))
    begin = time.perf_counter()
    batch = tactus.World(given.devices, described).batch(given.worlds)
    for k in range(given.worlds):
        stiffen(batch[k], k)
    made_s = time.perf_counter() - begin

    frames = 12 + given.frames
    wall_s = cpu_s = 0.0
    for frame in range(frames):
        for world in batch:
            go_down(world, frame)
        wall, cpu = time.perf_counter(), time.process_time()
        reports = batch.step(DT_S)
        if frame >= 12:
            wall_s += time.perf_counter() - wall
            cpu_s += time.process_time() - cpu

    checked = sorted({int(k) for k in np.linspace(0, given.worlds - 1, given.check)}) if given.check > 0 else []
    for k in checked:
        lone = tactus.World(given.devices, described)
        stiffen(lone, k)
        for frame in range(frames):
            go_down(lone, frame)
            report = lone.step(DT_S)
        assert lone.state_hash() == batch[k].state_hash(), f"world {k} differs from its lone run"
        assert (report.force_N("ball") == reports[k].force_N("ball")).all()
    force_N = [float(report.force_N("ball")[1]) for report in reports]
    assert min(force_N) > 0.1, "every ball touches"

    figures = {
        "devices": given.devices, "worlds": given.worlds, "cubes": int(np.prod(given.cubes)), "frames": given.frames,
        "world_frames_per_s": given.worlds * given.frames / wall_s, "wall_s": wall_s, "cpu_s": cpu_s,
        "substeps_per_frame": float(np.mean([report.substeps for report in reports])), "made_s": made_s,
        "checked": checked, "force_N": [min(force_N), max(force_N)]}
    print(f"{given.worlds} worlds of {figures['cubes']} cubes on {given.devices}: "
          f"{figures['world_frames_per_s']:.0f} world-frames/s, {1e3 * wall_s / given.frames:.1f} ms a step of all "
          f"({figures['substeps_per_frame']:.0f} substeps, {1e3 * cpu_s / given.frames:.1f} ms of the CPU's time); "
          f"made in {made_s:.1f} s; {len(checked)} have the bits of their lone runs")
    if given.json:
        with open(given.json, "w") as file:
            json.dump(figures, file, indent=1)


if __name__ == "__main__":
    main()
