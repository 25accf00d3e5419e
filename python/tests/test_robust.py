"""Objects that were never made, and values that nobody means: one exception each, and nothing else happens."""
import copy
import os
import pathlib

import numpy as np
import pytest
import tactus
import tactus._tactus as module

SOURCE = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve()
CLASSES = [c for c in vars(module).values() if isinstance(c, type) and not issubclass(c, Exception)]
ARGUMENTS = ["x", 1, 1.5, b"", None, (0, 1), np.zeros((4, 4)), lambda *_: None]


def members(cls):
    return {n: m for n, m in vars(cls).items() if n not in ("__module__", "__doc__", "__new__", "__init__", "__dict__")}


@pytest.mark.parametrize("cls", CLASSES, ids=lambda c: c.__name__)
def test_an_object_that_was_not_made_is_refused(cls):
    empty = cls.__new__(cls)
    for member in members(cls).values():
        if isinstance(member, property):
            calls = [lambda: member.fget(empty)]
        else:
            calls = [lambda: member(empty)] + [lambda: member(empty, a) for a in ARGUMENTS] + \
                    [lambda: member(empty, a, b) for a in ARGUMENTS for b in ARGUMENTS]
        for call in calls:
            with pytest.raises(TypeError):
                call()


def test_an_object_that_was_not_made_is_no_argument():
    def empty(cls):
        return cls.__new__(cls)

    devices, scene = tactus.Devices("cpu"), tactus.Scene(SOURCE / "scenes/touch.yaml")
    world = tactus.World(devices, scene)
    for call in (lambda: tactus.World(empty(tactus.Devices), scene), lambda: tactus.World(devices, empty(tactus.Scene)),
                 lambda: tactus.World(devices, scene, empty(tactus.Perception)),
                 lambda: world.set_surface(empty(tactus.Observation)),
                 lambda: tactus.Rig([empty(tactus.Camera)], ((0, 0, 0), (1, 1, 1))),
                 lambda: tactus.VisualHull(devices, empty(tactus.Rig)),
                 lambda: tactus.doctor(tactus.Rig([], ((0, 0, 0), (1, 1, 1))), [empty(tactus.Frame)]),
                 lambda: tactus.open_scene_source(empty(tactus.Scene)),
                 lambda: tactus.FrameLoop(tactus.FrameSource(), empty(tactus.World)),
                 lambda: tactus.FrameLoop(tactus.FrameSource(), world).add(empty(tactus.FrameSink)),
                 lambda: tactus.run(empty(tactus.Scene), "cpu", print)):
        with pytest.raises(TypeError, match="was not initialised: expected an object made by"):
            call()


def test_a_class_that_uses_itself_too_early_is_told():
    class Early(tactus.FrameSource):
        def __init__(self):
            print(self.rig)
            super().__init__()

    with pytest.raises(TypeError, match=r"this Early was not initialised: .*super\(\).__init__\(..\) before"):
        Early()

    class Never(tactus.FrameSink):
        def __init__(self):
            pass

    with pytest.raises(TypeError, match="__init__"):
        Never()


def test_copies_are_refused():
    for value in (tactus.World("cpu", tactus.Scene(SOURCE / "scenes/touch.yaml")), tactus.Frame([]), tactus.FrameSink()):
        with pytest.raises(TypeError):
            copy.deepcopy(value)


def values(scene, world):
    """What a call may get by mistake."""
    nan = float("nan")
    strided = np.zeros((8, 400), bool)[:, ::-2]
    readonly = np.zeros((200, 200), np.uint8)
    readonly.flags.writeable = False
    return [
        None, True, -1, 0, 1, 2, 2**31, -2**63, 2**64, 10**30, nan, float("inf"), -0.0, 1e308, "", "slab", "ball", "a\0b", "\udcff", "é" * 500,
        b"", b"TACTUSPY", bytearray(40), (), [], {}, (320, 240), (16, 2**31), (nan, nan), ((0, 0, 0), (1, 1, 1)), ((nan,) * 3,) * 2, print, object(),
        np.eye(4), np.eye(4)[::-1], np.asfortranarray(np.eye(4)), np.full((4, 4), nan), np.eye(4, dtype=np.float16), np.eye(4, dtype=complex),
        np.eye(3), np.zeros((0, 3), np.float32), np.zeros((0, 0), bool), np.zeros((2, 2, 2), bool), np.float32(3), np.array(3), np.array("x"),
        np.array([None, {}], dtype=object), np.zeros((5, 3), np.float32), np.full((5, 3), nan, np.float32), np.array([[0, 1, 9]], np.int32),
        np.array([[0, 1, 2]], np.int64), np.array([[-1, 1, 2]], np.int32), np.eye(4).astype(">f8"), np.zeros(7, "f4,i4"), strided, readonly,
        np.lib.stride_tricks.as_strided(np.zeros(1, bool), (200, 200), (0, 0)), np.datetime64("2020"), [np.zeros((200, 200), bool)] * 8,
        [None] * 8, scene, world, world.parameters, tactus.Devices("cpu"), tactus.Rig([], ((0, 0, 0), (1, 1, 1))),
        tactus.Camera("c", np.eye(3), (200, 200), np.eye(4)), tactus.Frame([np.ones((200, 200), bool)] * 8), tactus.Frame([]),
        tactus.FrameSource(), tactus.FrameSink(), [tactus.FrameSource()], {"a": [np.zeros((9, 9), np.uint8)]}, "chessboard:3x3",
        {"bodies": [{"name": "b"}]}, {3: nan}, {"source": world}, "bodies.slab.material.young_modulus_pa"]


def live_objects(scene):
    from test_frames import ball_masks, ring, touched
    devices, rig = tactus.Devices("cpu"), ring()
    world = tactus.World("cpu", scene)
    report = world.step(1 / 60)
    seen = tactus.Perception(devices, touched(), rig)
    filmed = tactus.World(devices, touched(), seen)
    frame = tactus.Frame(ball_masks(rig))
    observation = seen.observe(frame, 0)
    filmed.set_surface(observation)
    filmed.step(0)
    hull = tactus.VisualHull("cpu", rig, 16)
    return [devices, rig, rig.cameras[0], scene, world, report, seen, filmed, frame, observation, hull, hull.reconstruct(frame), world.snapshot(),
            world.monitors()[0], world.parameters, world.parameters.describe("contact.friction"), world.batch(2), tactus.FrameSource(rig),
            tactus.open_scene_source(scene), tactus.FrameSink(), tactus.FrameLoop(tactus.FrameSource(), world)]


EXPECTED = (tactus.Error, TypeError, ValueError, IndexError, KeyError, OverflowError, NotImplementedError, OSError)


@pytest.mark.parametrize("seed", range(4))
def test_no_value_does_harm(seed, tmp_path, monkeypatch):
    """Thousands of calls with values that aren't meant: each returns, or raises what Python programs expect, and the world goes on."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(seed)
    scene = tactus.Scene(SOURCE / "scenes/touch.yaml")
    world = tactus.World("cpu", scene)
    world.step(0)
    pool = values(scene, world)
    calls = [(type(o).__name__ + "." + n, getattr(o, n)) for o in live_objects(scene) for n in dir(o)
             if callable(getattr(o, n)) and (not n.startswith("_") or n in ("__getitem__", "__setitem__", "__contains__"))]
    calls += [(c.__name__, c) for c in CLASSES]
    calls += [(f.__name__, f) for f in (tactus.run, tactus.open_scene_source, tactus.calibrate, tactus.shared)]
    failures = []
    for name, call in calls:
        for count in range(5):
            for _ in range(1 if count == 0 else 12):
                arguments = [pool[i] for i in rng.integers(0, len(pool), count)]
                try:
                    call(*arguments)
                except EXPECTED as error:
                    if not str(error):
                        failures.append((name, arguments, "no message"))
                except BaseException as error:
                    failures.append((name, arguments, repr(error)))
    assert not failures, failures[:5]
    hash_before = world.state_hash()
    assert world.state_hash() == hash_before
    other = tactus.World("cpu", scene)
    other.step(1 / 60)
    assert other.step(1 / 60).substeps > 0


def test_results_outlive_all_that_made_them():
    import gc
    objects = live_objects(tactus.Scene(SOURCE / "scenes/touch.yaml"))
    world, hull, seen, batch, snapshot, parameters = objects[4], objects[10], objects[6], objects[16], objects[12], objects[14]
    mesh, surface, kept = hull.reconstruct(objects[8]), seen.surface(), batch[1]
    arrays = [mesh.positions, mesh.triangles, surface.normals, snapshot.bodies[0].positions, snapshot.real.positions, world.positions("slab")]
    before = [a.copy() for a in arrays]
    del objects, world, hull, seen, batch, snapshot, mesh, surface
    gc.collect()
    np.full(10**6, np.nan)  # takes what was given back
    for a, b in zip(arrays, before):
        assert (a == b).all()
    assert kept.step(1 / 60).substeps > 0
    parameters["contact.friction"] = 0.3  # keeps its world
    assert parameters["contact.friction"] == 0.3


@pytest.mark.parametrize("call, message", [
    (lambda: tactus.Frame([], time_s=float("nan")), r"time_s is nan, expected"),
    (lambda: tactus.Frame([np.zeros((4, 4), bool)]).mask(1), r"camera 1 of 1"),
    (lambda: tactus.Frame([np.zeros((4, 4), bool)]).mask(-2), r"camera -2 of 1"),
    (lambda: tactus.Frame([]).depth_m(0), r"camera 0 of 0"),
    (lambda: tactus.Frame(3), r"masks is a int, expected a list"),
    (lambda: tactus.Camera("", np.eye(3), (4, 4), np.eye(4)), r"name is '', expected"),
    (lambda: tactus.Camera("a", np.diag([1e300, 1, 1]), (4, 4), np.eye(4)), r"K of camera 'a' is no camera matrix"),
    (lambda: tactus.Camera("a", np.eye(3), (10**6, 10**6), np.eye(4)), r"size_px of camera 'a' is \(1000000, 1000000\), expected"),
    (lambda: tactus.Rig([tactus.Camera("a", np.eye(3), (4, 4), np.eye(4))] * 2, ((0, 0, 0), (1, 1, 1))), r"'a' twice"),
    (lambda: tactus.Mesh(np.full((3, 3), np.nan, np.float32), np.array([[0, 1, 2]], np.int32)), r"positions\[0\] is not finite"),
    (lambda: tactus.Mesh([[0, 0, 0]], np.array([[0, 1, 2]], np.int32)), r"positions is a list, expected"),
    (lambda: tactus.VisualHull("cpu", tactus.Rig([], ((0, 0, 0), (1, 1, 1)))), r"camera"),
])
def test_values_are_named(call, message):
    with pytest.raises((tactus.Error, IndexError), match=message):
        call()
