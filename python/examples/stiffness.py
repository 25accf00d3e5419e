#!/usr/bin/env python3
"""Identifies a tissue's stiffness from a recorded press: heights of an indenter, and forces on it.

usage: stiffness.py [PRESS.csv]        columns height_m, force_N; a frame (1/60 s) a row
Without a file it records a press of its own, with 5 % noise on each force, and compares.

Minimises sum(((f(E) - f_k) / f_k)^2) over log E, where f(E) is a run of the scene with Young's modulus E: a
residual is relative, as the noise is. Needs scipy.
"""
import sys

import numpy as np
import scipy.optimize

import tactus

FRAME_S = 1 / 60
MODULUS = "bodies.tissue.material.young_modulus_pa"
TISSUE = {
    "name": "tissue", "shape": {"kind": "box", "size_m": [0.12, 0.04, 0.12]}, "spacing_m": 0.01,
    "placement": {"position_m": [0, 0.02, 0]},
    "material": {"model": "tled", "young_modulus_pa": 10000, "poisson_ratio": 0.45, "damping": 0.5},
    "fixed": [{"kind": "half_space", "frame": "world", "point_m": [0, 0.001, 0], "normal": [0, 1, 0]}]}
INDENTER = {"name": "indenter", "kind": "sphere", "radius_m": 0.025, "held": True,
            "placement": {"position_m": [0, 0.07, 0]}}
SCENE = {"source": {"kind": "none", "frames": "0-59", "fps": 60}, "bodies": [TISSUE], "obstacles": [INDENTER]}


class Press:
    """Forces of a press, as a function of the modulus."""

    def __init__(self, height_m: np.ndarray) -> None:
        self.height_m = height_m
        self.world = tactus.World("cpu", tactus.Scene(SCENE))
        self.begin = self.world.save_state()
        self.runs = 0

    def force_N(self, young_modulus_Pa: float) -> np.ndarray:
        """On the indenter, upwards, one a frame."""
        self.runs += 1
        self.world.load_state(self.begin)
        self.world.parameters[MODULUS] = young_modulus_Pa
        pose, force_N = np.eye(4), []
        for k, height_m in enumerate(self.height_m):
            pose[1, 3] = height_m
            self.world.set_pose("indenter", pose)
            force_N.append(self.world.step(FRAME_S if k > 0 else 0).force_N("indenter")[1])
        return np.array(force_N)


def recorded(young_modulus_Pa: float, seed: int, noise: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Heights and forces of a press of 1 s, 8 mm deep, that stays down for half of it."""
    down = np.minimum(np.arange(60) / 30, 1)
    height_m = 0.067 - 0.010 * down
    force_N = Press(height_m).force_N(young_modulus_Pa)
    return height_m, force_N * (1 + noise * np.random.default_rng(seed).standard_normal(60))


def identify(height_m: np.ndarray, force_N: np.ndarray) -> tuple[float, float, int]:
    """Young's modulus [Pa], its standard error [Pa], and the number of runs that it took."""
    press = Press(height_m)
    touching = force_N > 0.05 * force_N.max()  # lighter ones say little, and their noise is the sensor's

    def residuals(x: np.ndarray) -> np.ndarray:
        return press.force_N(float(np.exp(x[0])))[touching] / force_N[touching] - 1

    # Forces are nearly proportional to E, so one run anywhere gives a start.
    start_Pa = TISSUE["material"]["young_modulus_pa"]
    start_Pa *= np.median(force_N[touching] / np.maximum(press.force_N(start_Pa)[touching], 1e-9))
    fit = scipy.optimize.least_squares(residuals, [np.log(start_Pa)], diff_step=1e-3, xtol=1e-4)
    spread = np.sqrt(2 * fit.cost / (touching.sum() - 1) / float((fit.jac**2).sum()))
    modulus_Pa = float(np.exp(fit.x[0]))
    return modulus_Pa, modulus_Pa * float(spread), press.runs


def main() -> int:
    if len(sys.argv) > 1:
        height_m, force_N = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1, unpack=True)
        modulus_Pa, error_Pa, _ = identify(height_m, force_N)
        print(f"E = {modulus_Pa:.0f} +- {error_Pa:.0f} Pa")
        return 0
    true_Pa = 14000.0
    modulus_Pa, error_Pa, runs = identify(*recorded(true_Pa, seed=1))
    off = modulus_Pa / true_Pa - 1
    print(f"E = {modulus_Pa:.0f} +- {error_Pa:.0f} Pa after {runs} runs; it was {true_Pa:.0f} Pa: {100 * off:+.2f} %")
    return 0 if abs(off) < 0.02 else 1


if __name__ == "__main__":
    sys.exit(main())
