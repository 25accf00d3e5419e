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
