"""A world without cameras."""
import gc
import os
import resource
import subprocess
import threading
import time

import numpy as np
import pytest
import tactus

SOURCE = os.environ["TACTUS_SOURCE_DIR"]
PROGRAM = os.environ.get("TACTUS_PROGRAM", "")
TOUCH = os.path.join(SOURCE, "scenes/touch.yaml")


def slab(**material):
    """A slab that is held from below, and a ball that a program holds."""
    return {
        "bodies": [{
            "name": "slab", "shape": {"kind": "box", "size_m": [0.08, 0.04, 0.08]}, "spacing_m": 0.01,
            "placement": {"position_m": [0, 0.02, 0]}, "material": {"young_modulus_pa": 20000, **material},
            "fixed": [{"kind": "half_space", "frame": "world", "point_m": [0, 0.001, 0], "normal": [0, 1, 0]}]}],
        "obstacles": [{"name": "ball", "kind": "sphere", "radius_m": 0.02, "held": True,
                       "placement": {"position_m": [0, 0.0605, 0]}}],
        "probes": [{"name": "top", "body": "slab", "position_m": [0, 0.01, 0]}],
    }


def pressed(world, frames=10):
    """The ball goes 10 mm down; the last report."""
    T = np.eye(4)
    for k in range(frames):
        T[1, 3] = 0.0605 - 0.01 * (k + 1) / frames
        world.set_pose("ball", T)
        report = world.step(1 / 60)
    return report


def test_state_hash_is_the_command_lines(tmp_path):
    if not PROGRAM:
        pytest.skip("the program isn't built")
    json = tmp_path / "r.json"
    subprocess.run([PROGRAM, "run", TOUCH, "--frames", "10", "--view", "none", "--devices", "cpu", "--json", json],
                   check=True, stdout=subprocess.DEVNULL)
    world = None

    def keep(w, report, time_s):
        nonlocal world
        world = w

    assert tactus.run(tactus.Scene(TOUCH), "cpu", keep, frames=10) == 10
    import json as js
    assert world.state_hash() == js.loads(json.read_text())["state_hash"]


@pytest.mark.parametrize("devices", ["cpu", "cpu:3"])
def test_a_pressed_slab_pushes_back(devices):
    world = tactus.World(devices, tactus.Scene(slab()))
    world.report_contacts("slab")
    report = pressed(world)
    force_N = report.force_N("ball")
    assert force_N[1] > 0.5 and abs(force_N[0]) < 0.05 * force_N[1]
    contacts = world.contacts("slab")
    # The slab gets what the ball gives: each impulse is a float, rounded by 6e-8 of it.
    impulse = [c.impulse_N_s for c in report.contacts if c.other == "ball"][0]
    assert np.allclose(contacts["impulse_N_s"].sum(axis=0), -impulse, atol=1e-6 * np.abs(impulse).max())
    assert set(contacts["other"]) == {"ball"} and (contacts["position_m"][:, 1] > 0).all()
    assert world.probes()["top"]["position_m"][1] < 0.03
    assert world.pose("ball")[1, 3] == pytest.approx(0.0505)


def test_same_bits_on_virtual_devices():
    hashes = set()
    for devices in ("cpu", "cpu:3"):
        world = tactus.World(devices, tactus.Scene(slab()))
        pressed(world)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


def test_arrays_are_views_that_outlive_everything():
    world = tactus.World("cpu", tactus.Scene(slab()))
    pressed(world)
    snapshot = world.snapshot()
    body = snapshot.bodies[0]
    positions = body.positions
    assert positions.ctypes.data == snapshot.bodies[0].positions.ctypes.data, "the same buffer"
    assert positions.dtype == np.float32 and not positions.flags.writeable and not positions.flags.owndata
    with pytest.raises(ValueError):
        positions[0, 0] = 1
    before = positions.copy()
    world.step(1 / 60)
    del world, snapshot, body
    gc.collect()
    assert (positions == before).all()
    nodes = tactus.World("cpu", tactus.Scene(slab())).positions("slab")
    assert nodes.shape == (9 * 5 * 9, 3) and not nodes.flags.writeable


def test_states_branch():
    world = tactus.World("cpu", tactus.Scene(slab()))
    pressed(world, 5)
    state = world.save_state()
    hashes = []
    for _ in range(2):
        world.load_state(state)
        for _ in range(5):
            world.step(1 / 60)
        hashes.append(world.state_hash())
    assert hashes[0] == hashes[1]
    with pytest.raises(tactus.Error, match="checkpoint"):
        world.load_state(state[:-1])


def test_parameters_are_a_mapping():
    world = tactus.World("cpu", tactus.Scene(slab()))
    parameters = world.parameters
    assert parameters["contact.friction"] == 0.4 and "contact.friction" in parameters
    parameters["bodies.slab.material.young_modulus_pa"] = 40000
    stiff = pressed(world).force_N("ball")[1]
    soft = pressed(tactus.World("cpu", tactus.Scene(slab()))).force_N("ball")[1]
    assert 1.5 * soft < stiff < 2.5 * soft
    assert parameters.describe("contact.friction").most == 10
    assert len(dict(parameters)) == len(parameters)


@pytest.mark.parametrize("call, message", [
    (lambda w: w.set_pose("ball", np.eye(3)), r"T_world_tool is a float64 array of shape \(3, 3\), expected a \(4, 4\)"),
    (lambda w: w.set_pose("ball", "up"), r"T_world_tool is a str, expected"),
    (lambda w: w.set_pose("ball", 2 * np.eye(4)), r"is no rigid pose"),
    (lambda w: w.set_pose("ball", np.full((4, 4), np.nan)), r"is no rigid pose"),
    (lambda w: w.set_pose("ball", np.eye(4, dtype=complex)), r"T_world_tool is a complex128 array"),
    (lambda w: w.set_pose("bal", np.eye(4)), r"'bal'"),
    (lambda w: w.step(float("nan")), r"dt_s is nan, expected"),
    (lambda w: w.step(-1), r"dt_s is -1, expected"),
    (lambda w: w.parameters.__setitem__("contact.friction", -1), r"is -1, expected >= 0 and <= 10"),
    (lambda w: w.positions("slob"), r"body 'slob' is not in the scene; did you mean 'slab'\?"),
    (lambda w: w.contacts("slob"), r"'slob'"),
    (lambda w: tactus.Scene({"bodies": [{"nam": "x"}]}), r"'nam'"),
    (lambda w: tactus.Scene(3), r"source is a int, expected the path of a scene file or a dict"),
    (lambda w: tactus.Scene("nowhere.yaml"), r"nowhere.yaml"),
    (lambda w: tactus.World("cpx", tactus.Scene(slab())), r"cpx"),
    (lambda w: tactus.World(7, tactus.Scene(slab())), r"devices is a int, expected"),
])
def test_mistakes_are_named(call, message):
    world = tactus.World("cpu", tactus.Scene(slab()))
    with pytest.raises(tactus.Error, match=message):
        call(world)


def test_other_threads_run_while_it_steps():
    """A counting thread gets on during steps that hold no lock: at least a tenth of what it does alone, on two loaded
    cores."""
    scene = slab()
    scene["bodies"][0]["spacing_m"] = 0.004
    world = tactus.World("cpu", tactus.Scene(scene))
    counts, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counts[0] += 1

    begin = time.perf_counter()
    thread = threading.Thread(target=count)
    thread.start()
    time.sleep(0.3)
    alone = counts[0] / (time.perf_counter() - begin)
    counts[0], begin = 0, time.perf_counter()
    for _ in range(5):
        world.step(1 / 60)
    beside = counts[0] / (time.perf_counter() - begin)
    stop.set()
    thread.join()
    assert beside > 0.1 * alone


def test_arrays_that_are_dropped_take_no_memory():
    world = tactus.World("cpu", tactus.Scene(slab()))
    world.step(1 / 60)

    def take(times):
        for _ in range(times):
            world.snapshot().bodies[0].positions, world.positions("slab"), world.monitors()

    take(200)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    take(2000)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1024, "kB"


def test_states_of_other_scenes_are_refused():
    """And change nothing."""
    world = tactus.World("cpu", tactus.Scene(slab()))
    pressed(world, 3)
    before = world.save_state()
    edited = tactus.World("cpu", tactus.Scene(slab(young_modulus_pa=20001)))
    split = tactus.World("cpu:2", tactus.Scene(slab()))
    for state, message in ((edited.save_state(), "of another scene, or this scene was edited since"),
                           (split.save_state(), "of another number of devices, expected one of cpu"),
                           (b"", r"no state of a World, expected the bytes of save_state\(\)"),
                           (before[8:], "no state of a World"), (before[:20], "checkpoint"), (before[:-1], "checkpoint"),
                           (before[:-1] + bytes([before[-1] ^ 1]), "checkpoint"), (before + b"x", "checkpoint")):
        with pytest.raises(tactus.Error, match=message):
            world.load_state(state)
        assert world.save_state() == before
    tactus.World("cpu", tactus.Scene(slab())).load_state(before)
