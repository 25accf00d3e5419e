"""An environment in the shape of gymnasium's, which it doesn't need: press a ball onto tissue until a force is there."""
from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._tactus import Scene, World

Floats = NDArray[np.float32]
SCENE: dict[str, Any] = {
    "source": {"kind": "none", "frames": "0-239", "fps": 60},
    "bodies": [{
        "name": "tissue", "shape": {"kind": "box", "size_m": [0.12, 0.04, 0.12]}, "spacing_m": 0.01,
        "placement": {"position_m": [0, 0.02, 0]}, "material": {"young_modulus_pa": 20000},
        "fixed": [{"kind": "half_space", "frame": "world", "point_m": [0, 0.001, 0], "normal": [0, 1, 0]}]}],
    "obstacles": [{"name": "ball", "kind": "sphere", "radius_m": 0.025, "held": True,
                   "placement": {"position_m": [0, 0.068, 0]}}]}


@dataclasses.dataclass(frozen=True)
class Box:
    """Arrays between two bounds."""
    low: float
    high: float
    shape: tuple[int, ...]
    dtype: type = np.float32


class PressEnv:
    """action: (1,) velocity of the ball upwards [m/s]. observation: (3,) height of the ball's centre [m], force on it
    upwards [N], force to reach [N]. reward: minus the force's error, as a part of the force to reach. An episode has
    240 frames, or ends after 10 frames within 5 %."""
    action_space = Box(-0.05, 0.05, (1,))
    observation_space = Box(-np.inf, np.inf, (3,))

    def __init__(self, devices: str = "cpu", scene: dict[str, Any] | None = None) -> None:
        self.world = World(devices, Scene(scene or SCENE))
        self._begin = self.world.save_state()
        self._random = np.random.default_rng()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self.world.load_state(self._begin)
        self._pose, self._target_N = self.world.pose("ball"), self._random.uniform(0.5, 2.0)
        self._frames = self._held = 0
        return self._frame(0.0)[0], {}

    def step(self, action: NDArray[Any]) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        velocity_m_s = np.clip(np.asarray(action, dtype=np.float64).reshape(1)[0], -0.05, 0.05)
        self._pose[1, 3] = np.clip(self._pose[1, 3] + velocity_m_s / 60, 0.045, 0.075)
        observation, report = self._frame(1 / 60)
        error = abs(float(observation[1]) / self._target_N - 1)
        self._frames, self._held = self._frames + 1, self._held + 1 if error < 0.05 else 0
        return observation, -error, self._held >= 10, self._frames >= 240, {"report": report}

    def _frame(self, dt_s: float) -> tuple[Floats, Any]:
        self.world.set_pose("ball", self._pose)
        report = self.world.step(dt_s)
        return np.array([self._pose[1, 3], report.force_N("ball")[1], self._target_N], dtype=np.float32), report
