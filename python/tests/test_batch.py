"""Worlds that are stepped by one call, the environment, and the example."""
import ast
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import tactus
import tactus.gym

SOURCE = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve()
TOUCH = SOURCE / "scenes/touch.yaml"
MODULUS = "bodies.slab.material.young_modulus_pa"


@pytest.mark.parametrize("devices", ["cpu", "cpu:3"])
def test_worlds_of_a_batch_have_the_bits_of_lone_ones(devices):
    batch = tactus.World(devices, tactus.Scene(TOUCH)).batch(5)
    for k in range(5):
        batch[k].parameters[MODULUS] = 10000 + 5000 * k
    for _ in range(8):
        reports = batch.step(1 / 60)
    assert len(batch) == len(reports) == 5
    assert len({world.state_hash() for world in batch}) == 5, "they are independent"
    for k in range(5):
        lone = tactus.World(devices, tactus.Scene(TOUCH))
        lone.parameters[MODULUS] = 10000 + 5000 * k
        for _ in range(8):
            report = lone.step(1 / 60)
        assert batch[k].state_hash() == lone.state_hash()
        assert (reports[k].force_N("ball") == report.force_N("ball")).all()


def test_a_batch_begins_in_the_state_of_its_world():
    world = tactus.World("cpu", tactus.Scene(TOUCH))
    for _ in range(12):
        world.step(1 / 60)
    batch = world.batch(2)
    assert batch[0].state_hash() == world.state_hash()
    batch.step(1 / 60)
    world.step(1 / 60)
    assert batch[1].state_hash() == batch[-2].state_hash() == world.state_hash()
    del batch


def test_mistakes_of_batches_are_named():
    world = tactus.World("cpu", tactus.Scene(TOUCH))
    with pytest.raises(tactus.Error, match="count is 0, expected the number of worlds, 1 or more"):
        world.batch(0)
    for count in (10**6, 10**12):
        with pytest.raises(tactus.Error, match=rf"count is {count}, expected at most \d+: a world takes .*B, and .*B of memory are free"):
            world.batch(count)
    batch = world.batch(2)
    with pytest.raises(tactus.Error, match="dt_s is -1, expected"):
        batch.step(-1)
    with pytest.raises(IndexError, match="world 2 of a batch of 2"):
        batch[2]
    kept = batch[0]
    del batch, world
    kept.step(1 / 60)  # a world outlives its batch


def test_a_second_thread_is_refused_during_a_step():
    """And nothing crashes: the first thread's steps go on."""
    scene = tactus.gym.SCENE | {"bodies": [tactus.gym.SCENE["bodies"][0] | {"spacing_m": 0.004}]}
    world = tactus.World("cpu", tactus.Scene(scene))
    thread = threading.Thread(target=lambda: [world.step(1 / 60) for _ in range(3)])
    thread.start()
    refusals = 0
    while thread.is_alive():
        try:
            world.monitors()
        except tactus.Error as error:
            assert "World is in a call of another thread, expected one call at a time" in str(error)
            refusals += 1
        time.sleep(1e-3)
    thread.join()
    assert refusals > 0 and repr(world)
    world.step(1 / 60)


def test_torch_sees_results_without_a_copy():
    torch = pytest.importorskip("torch", reason="python3-torch isn't installed")
    positions = tactus.World("cpu", tactus.Scene(TOUCH)).snapshot().bodies[0].positions
    address, values = positions.ctypes.data, positions.copy()
    with pytest.raises((BufferError, TypeError)):
        positions.__dlpack__()
    tensor = torch.from_dlpack(tactus.shared(positions))
    del positions
    assert tensor.data_ptr() == address and (tensor.numpy() == values).all()


def press(env, seed):
    """An episode of a controller that goes down as long as the force is too small."""
    observation, info = env.reset(seed=seed)
    assert info == {} and observation.shape == env.observation_space.shape and observation.dtype == np.float32
    seen = [observation]
    while True:
        action = np.array([0.02 * (observation[1] - observation[2])], dtype=np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        seen.append(observation)
        assert reward <= 0 and info["report"].dt_s == pytest.approx(1 / 60)
        if terminated or truncated:
            return np.array(seen), terminated


def test_the_environment_is_solved_and_has_the_same_bits_for_the_same_seed():
    env = tactus.gym.PressEnv()
    first, is_solved = press(env, 3)
    assert is_solved and abs(first[-1, 1] / first[-1, 2] - 1) < 0.05
    again, _ = press(env, 3)
    assert first.tobytes() == again.tobytes(), "after a reset"
    other, _ = press(tactus.gym.PressEnv(), 3)
    assert first.tobytes() == other.tobytes(), "in another environment"
    assert press(env, 4)[0][0, 2] != first[0, 2], "another seed has another force to reach"


def test_an_episode_ends():
    env = tactus.gym.PressEnv()
    env.reset(seed=0)
    ends = [env.step(np.zeros(1))[2:4] for _ in range(240)]
    assert not any(terminated for terminated, _ in ends)
    assert [truncated for _, truncated in ends] == [False] * 239 + [True]


def test_a_stiffness_is_identified():
    """5 % noise on some 50 forces leaves 0.7 % (and 0.5 % were measured): 2 % are three standard errors."""
    pytest.importorskip("scipy", reason="python3-scipy isn't installed")
    spec = importlib.util.spec_from_file_location("stiffness", SOURCE / "python/examples/stiffness.py")
    stiffness = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(stiffness)
    modulus_Pa, error_Pa, runs = stiffness.identify(*stiffness.recorded(14000.0, seed=2))
    assert abs(modulus_Pa / 14000 - 1) < 0.02 and error_Pa < 0.02 * 14000 and runs < 20


def test_stubs_name_what_the_module_has():
    """Classes, their public members, and functions: none is missing in the stubs, none is there alone."""
    import tactus._tactus as module
    stubs = ast.parse((pathlib.Path(tactus.__file__).parent / "_tactus.pyi").read_text())
    members = {c.name: {f.name for f in c.body if isinstance(f, ast.FunctionDef) and not f.name.startswith("_")}
               for c in stubs.body if isinstance(c, ast.ClassDef)}
    classes = {name: {n for n in vars(c) if not n.startswith("_")} for name, c in vars(module).items()
               if isinstance(c, type) and name != "Error"}
    assert {name: members.get(name) for name in classes} == classes
    only_types = {"Error", "Contacts", "Deviation", "HullCounts", "LensValues", "LiquidCounts", "Probe", "Source"}
    assert set(members) - set(classes) == only_types
    functions = {f.name for f in stubs.body if isinstance(f, ast.FunctionDef)}
    assert functions == {n for n, f in vars(module).items() if callable(f) and not isinstance(f, type)}
    for name in set(classes) | functions:
        assert getattr(tactus, name) is getattr(module, name) and getattr(module, name).__doc__, name


OWN_CLASSES = """
import numpy as np
import tactus

class Source(tactus.FrameSource):
    def __init__(self, rig: tactus.Rig) -> None:
        super().__init__(rig, fps=30)

    def next_frame(self) -> tactus.Frame | None:
        return tactus.Frame([np.zeros((4, 4), bool) for _ in self.rig.cameras])

class Sink(tactus.FrameSink):
    def frame(self, frame: tactus.RunFrame) -> None:
        print(frame.report.force_N("tool")[1], frame.snapshot().bodies[0].positions.max())

def control(world: tactus.World, time_s: float) -> None:
    world.parameters["contact.friction"] = 0.5 * time_s

def go(rig: tactus.Rig, world: tactus.World) -> int:
    loop = tactus.FrameLoop(Source(rig), world, controller=control)
    loop.add(Sink())
    return loop.run()
"""


def test_types_pass_mypy(tmp_path):
    if subprocess.run([sys.executable, "-c", "import mypy"], capture_output=True).returncode:
        pytest.skip("mypy isn't installed")
    package = pathlib.Path(tactus.__file__).parent
    own = tmp_path / "own_classes.py"
    own.write_text(OWN_CLASSES)
    environment = os.environ | {"MYPYPATH": str(package.parent)}
    for what in (["-p", "tactus"], [own]):
        found = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull, *what],
                               env=environment, cwd=package.parent, capture_output=True, text=True)
        assert found.returncode == 0, found.stdout + found.stderr


def test_the_rate_of_batches_is_measured(tmp_path):
    figures = tmp_path / "rate.json"
    text = subprocess.run([sys.executable, SOURCE / "python/examples/batch_rate.py", "--worlds", "4", "--cubes", "6", "4", "6", "--frames", "2",
                           "--check", "2", "--json", figures], check=True, capture_output=True, text=True).stdout
    assert "4 worlds of 144 cubes on cpu" in text and "2 have the bits of their lone runs" in text
    measured = json.loads(figures.read_text())
    assert measured["checked"] == [0, 3] and measured["world_frames_per_s"] == pytest.approx(8 / measured["wall_s"])
    assert measured["force_N"][0] < measured["force_N"][1], "stiffer tissue pushes harder"
