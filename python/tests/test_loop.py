"""Loops with sources, sinks and controllers of Python."""
import gc
import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
import weakref

import numpy as np
import pytest
import tactus
from test_frames import ball_masks, ring, touched

TOUCH = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve() / "scenes/touch.yaml"
MODULUS = "bodies.slab.material.young_modulus_pa"


class Ball(tactus.FrameSource):
    """A ball of 0.1 m at the origin, seen by eight cameras 30 times a second."""

    def __init__(self, frames=3):
        super().__init__(ring(), frame_count=frames, fps=30)
        self.taken, self.frames = 0, frames

    def next_frame(self):
        if self.taken == self.frames:
            return None
        self.taken += 1
        return tactus.Frame(ball_masks(self.rig), tick=self.taken, time_s=self.taken / 30)


class Ticks(tactus.FrameSource):
    """Time that passes: no cameras."""

    def __init__(self, frames=5):
        super().__init__(frame_count=frames)
        self.taken, self.frames = 0, frames

    def next_frame(self):
        self.taken += 1
        return tactus.Frame([], tick=self.taken, time_s=self.taken / 60) if self.taken <= self.frames else None


class Log(tactus.FrameSink):
    def __init__(self):
        super().__init__()
        self.seen = []

    def begin(self, world, frame_count):
        self.seen.append(("begin", repr(world), frame_count))

    def frame(self, frame):
        self.seen.append((frame.number, round(60 * frame.time_s), frame.is_new, frame.report.substeps > 0))
        self.last = frame

    def end(self, notices):
        self.seen.append(("end", len(notices)))


def filmed():
    rig, scene, devices = ring(), touched(), tactus.Devices("cpu")
    return tactus.World(devices, scene, tactus.Perception(devices, scene, rig))


def test_a_source_and_sinks_of_python_have_the_bits_of_steps_by_hand():
    loop, first, second = tactus.FrameLoop(Ball(), filmed()), Log(), Log()
    loop.add(first)
    loop.add(second)
    assert loop.run() == loop.frames == 3 and loop.bad_frames == loop.open_frames == 0
    assert first.seen == second.seen
    assert [s[:3] for s in first.seen[1:-1]] == [(1, 2, True), (2, 4, True), (3, 6, True)]
    assert first.seen[0][::2] == ("begin", 3) and first.seen[-1] == ("end", len(loop.notices))

    rig, scene, devices = ring(), touched(), tactus.Devices("cpu")
    perception = tactus.Perception(devices, scene, rig)
    world, source = tactus.World(devices, scene, perception), Ball()
    for k in range(3):
        world.set_surface(perception.observe(source.next_frame(), 1 / 30 if k else 0))
        world.step(1 / 30 if k else 0)
    assert loop.world.state_hash() == world.state_hash()


def test_a_frame_ends_with_its_call():
    class Keeps(Log):
        def frame(self, frame):
            super().frame(frame)
            self.kept = frame.images, frame.report, frame.snapshot(), frame.world

    sink, loop = Keeps(), tactus.FrameLoop(Ball(), filmed())
    loop.add(sink)
    loop.run()
    images, report, snapshot, world = sink.kept
    assert world is loop.world and report.substeps > 0 and images.time_s == pytest.approx(0.1)
    assert (images.mask(0) == ball_masks(ring())[0]).all() and 0.003 < snapshot.real.volume_m3 < 0.006
    for use in (lambda f: f.report, lambda f: f.world, lambda f: f.number, lambda f: f.is_new, lambda f: f.time_s,
                lambda f: f.snapshot()):
        with pytest.raises(tactus.Error, match=r"this RunFrame ended with its FrameSink.frame\(\), expected"):
            use(sink.last)


def test_a_controller_has_the_bits_of_poses_and_parameters_by_hand():
    def stiffness(time_s):
        return 20000 + 60000 * time_s

    def control(world, time_s):
        world.parameters[MODULUS] = stiffness(time_s)

    loop = tactus.FrameLoop(Ticks(30), tactus.World("cpu", tactus.Scene(TOUCH)), controller=control)
    assert loop.run() == 30
    soft = tactus.World("cpu", tactus.Scene(TOUCH))
    by_hand = tactus.World("cpu", tactus.Scene(TOUCH))
    for k in range(30):
        by_hand.parameters[MODULUS] = stiffness((k + 1) / 60)
        dt_s = (k + 1) / 60 - k / 60 if k else 0
        by_hand.step(dt_s)
        soft.step(dt_s)
    assert loop.world.state_hash() == by_hand.state_hash() != soft.state_hash()
    assert loop.world.parameters[MODULUS] == stiffness(0.5)


def test_the_sources_of_scenes_run_too():
    scene = tactus.Scene(TOUCH)
    loop = tactus.FrameLoop(tactus.open_scene_source(scene), tactus.World("cpu", scene), most_frames=4)
    assert loop.run() == 4 and loop.run() == 4 and loop.frames == 8, "it goes on"
    hashes = []
    tactus.run(scene, "cpu", lambda world, report, time_s: hashes.append(world.state_hash()), frames=8)
    assert loop.world.state_hash() == hashes[-1]


def test_nothing_new_and_bad_frames():
    class Holes(Ball):
        status = "the cable is loose"

        def next_frame(self):
            frame = super().next_frame()
            if frame is None or self.taken == 2:
                return frame
            return tactus.Frame([] if self.taken < 4 else [None] * 8, time_s=frame.time_s)

    loop, log = tactus.FrameLoop(Holes(4), filmed()), Log()
    loop.add(log)
    # Before the first images a filmed world waits; the third frame has none, and nobody delivered the fourth.
    assert loop.run() == 2 and loop.bad_frames == 1
    assert [s[:3] for s in log.seen[1:-1]] == [(1, 4, True), (2, 6, False)]


class Fault(Exception):
    pass


def failing(where):
    def fail(*_):
        raise Fault(where)

    class Source(Ball):
        def next_frame(self):
            frame = super().next_frame()
            if where == "source" and self.taken == 2:
                fail()
            return frame

    class Sink(Log):
        def begin(self, world, frame_count):
            if where == "begin":
                fail()

        def frame(self, frame):
            super().frame(frame)
            if where == "frame" and frame.number == 2:
                fail()

        def end(self, notices):
            if where == "end":
                fail()

    def controller(world, time_s):
        if where == "controller" and time_s > 0.05:
            fail()

    def should_stop():
        if where == "should_stop" and loop.world.state_hash():
            fail()

    loop = tactus.FrameLoop(Source(4), filmed(), controller=controller, should_stop=should_stop)
    loop.add(Sink())
    return loop


@pytest.mark.parametrize("where", ["source", "begin", "frame", "end", "controller", "should_stop"])
def test_an_exception_comes_out_once_and_all_can_be_used(where):
    loop = failing(where)
    with pytest.raises(Fault, match=where):
        loop.run()
    before, where_before = loop.frames, where
    world = loop.world
    assert world.state_hash() and world.snapshot().bodies and world.monitors()
    # The world goes on in another loop, and by itself.
    again, log = tactus.FrameLoop(Ball(2), world), Log()
    again.add(log)
    assert again.run() == 2 and before <= 4, where_before
    world.step(1 / 60)


def test_a_failed_loop_can_go_on():
    loop = failing("controller")
    with pytest.raises(Fault):
        loop.run()
    assert loop.frames == 1, "the second was taken from the source, and its step did not begin"
    with pytest.raises(Fault):
        loop.run()
    loop = failing("source")
    with pytest.raises(Fault):
        loop.run()
    assert loop.frames == 1 and loop.run() == 2 and loop.frames == 3


def test_images_that_a_failed_loop_lost_are_not_used():
    """The frame's memory is gone: the World wants new images before its next step."""
    class Bad(tactus.FrameSource):
        def next_frame(self):
            return tactus.Frame([np.zeros((4, 4), bool)] * 8, time_s=0.1)

    loop = tactus.FrameLoop(Bad(ring()), filmed())
    with pytest.raises(tactus.Error, match="4"):
        loop.run()
    with pytest.raises(tactus.Error, match=r"expected set_surface\(\) with new ones"):
        loop.world.step(1 / 60)
    assert tactus.FrameLoop(Ball(2), loop.world).run() == 2
    loop.world.step(1 / 60)


def test_other_threads_are_refused_while_the_loop_steps_and_served_while_python_runs():
    world = tactus.World("cpu", tactus.Scene({
        "bodies": [{"name": "b", "shape": {"kind": "box", "size_m": [0.1, 0.1, 0.1]}, "spacing_m": 0.005}]}))
    served, refused = [], []

    def other():
        try:
            world.step(0)
            served.append(1)
        except tactus.Error as error:
            assert "expected one call at a time" in str(error)
            refused.append(1)

    class Waits(Log):
        def frame(self, frame):
            thread = threading.Thread(target=other)
            thread.start()
            thread.join()

    loop = tactus.FrameLoop(Ticks(3), world)
    loop.add(Waits())
    assert loop.run() == 3 and len(served) == 3 and not refused
    loop = tactus.FrameLoop(Ticks(20), world)
    runner = threading.Thread(target=loop.run)
    runner.start()
    while runner.is_alive():
        other()
        time.sleep(1e-4)
    runner.join()
    assert refused, "the loop holds it"
    world.step(1 / 60)


@pytest.mark.parametrize("call, message", [
    (lambda w: tactus.FrameLoop(7, w), r"source is a int, expected a FrameSource, or an object with 'rig' and"),
    (lambda w: tactus.FrameLoop(Ticks(), w, most_frames=-1), r"most_frames is -1, expected a number of frames"),
    (lambda w: tactus.FrameLoop(Ticks(), w, controller=3), r"controller is a int, expected a function"),
    (lambda w: tactus.FrameLoop(Ticks(), w, should_stop="no"), r"should_stop is a str, expected a function"),
    (lambda w: tactus.FrameLoop(Ticks(), None), r"world is None, expected a World"),
    (lambda w: tactus.FrameLoop(Ticks(), w).add(print), r"sink is a builtin_function_or_method, expected an object of a class"),
    (lambda w: tactus.FrameSource(fps=float("nan")), r"fps is nan, expected"),
    (lambda w: tactus.FrameSource(frame_count=-1), r"frame_count is -1, expected"),
])
def test_mistakes_are_named(call, message):
    with pytest.raises(tactus.Error, match=message):
        call(tactus.World("cpu", tactus.Scene(TOUCH)))


def test_mistakes_of_sources_are_named():
    class Source(tactus.FrameSource):
        def __init__(self, what):
            super().__init__(ring())
            self.what = what

        def next_frame(self):
            return self.what

    for what, message in ((5, r"next_frame\(\) returned a int, expected a Frame, or None at the end"),
                          (tactus.Frame([None] * 7), r"a Frame of 7 masks, expected one for each of the 8 cameras")):
        with pytest.raises(tactus.Error, match=message):
            tactus.FrameLoop(Source(what), filmed()).run()
    with pytest.raises(NotImplementedError, match=r"has a next_frame\(\)"):
        tactus.FrameLoop(tactus.FrameSource(ring()), filmed()).run()
    loop = tactus.FrameLoop(Ticks(), tactus.World("cpu", tactus.Scene(TOUCH)))
    loop.add(tactus.FrameSink())
    with pytest.raises(NotImplementedError, match=r"has a frame\(frame\)"):
        loop.run()


def test_a_loop_can_not_run_in_itself():
    errors = []

    class Again(Log):
        def frame(self, frame):
            for call in (loop.run, lambda: loop.add(Log())):
                with pytest.raises(tactus.Error, match=r"this FrameLoop runs, expected a call after its run\(\)") as error:
                    call()
                errors.append(error)

    loop = tactus.FrameLoop(Ticks(2), tactus.World("cpu", tactus.Scene(TOUCH)))
    loop.add(Again())
    assert loop.run() == 2 and len(errors) == 4


def test_a_cut_world_is_not_exchanged_under_its_loop():
    """Cuts are undone in a World of its own, which the loop would not know."""
    scene = tactus.Scene(TOUCH.parent / "slice.yaml")
    world = tactus.World("cpu", scene)
    begin, refused = world.save_state(), []

    def reset(w, time_s):
        try:
            w.load_state(begin)
        except tactus.Error as error:
            refused.append(str(error))

    tactus.FrameLoop(tactus.open_scene_source(scene), world, most_frames=40).run()
    loop = tactus.FrameLoop(Ticks(2), world, controller=reset)
    loop.run()
    assert len(refused) == 2 and "is in a FrameLoop" in refused[0]
    world.load_state(begin)
    assert world.save_state() == begin


def test_loops_leave_nothing_behind():
    world = tactus.World("cpu", tactus.Scene(TOUCH))
    source, sink = Ticks(), Log()
    loop = tactus.FrameLoop(source, world)
    loop.add(sink)
    loop.run()
    gone = [weakref.ref(x) for x in (source, sink)]
    sink.last = None
    del loop, source, sink
    gc.collect()
    assert [w() for w in gone] == [None, None]


@pytest.mark.parametrize("where", ["sink", "source", "nowhere"])
def test_ctrl_c_ends_a_loop(where):
    script = f"""
import signal, time, tactus
class Ticks(tactus.FrameSource):
    time_s = 0
    def next_frame(self):
        self.time_s += 1 / 60
        if {where == "source"}: time.sleep(0.2)
        return tactus.Frame([], time_s=self.time_s)
class Sink(tactus.FrameSink):
    def frame(self, frame):
        if frame.number == 1: print("begun", flush=True)
        if {where == "sink"}: time.sleep(0.2)
world = tactus.World("cpu", tactus.Scene({str(TOUCH)!r}))
loop = tactus.FrameLoop(Ticks(), world)
loop.add(Sink())
try:
    loop.run()
except KeyboardInterrupt:
    world.step(1 / 60)
    print("usable", loop.frames > 0, flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        assert run.stdout.readline() == "begun\n"
        time.sleep(0.3)
        run.send_signal(signal.SIGINT)
        out, errors = run.communicate(timeout=30)
    assert run.returncode == 0 and out == "usable True\n", errors
