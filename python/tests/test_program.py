"""What Python computes has the bits of the command line."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import tactus

SOURCE = pathlib.Path(os.environ["TACTUS_SOURCE_DIR"]).resolve()
PROGRAM = os.environ.get("TACTUS_PROGRAM", "")
needs_program = pytest.mark.skipif(not PROGRAM, reason="the program isn't built")


def program(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


@needs_program
@pytest.mark.parametrize("devices", ["cpu", "cpu:3"])
def test_a_hull_of_numpy_masks_is_the_programs_file(devices, tmp_path):
    program("synth", "hand", "--frames", 1, "--out", tmp_path / "film")
    program("reconstruct", "--source", "masks", tmp_path / "film/rig.yaml", "--frames", 0, "--resolution", 64, "--no-depth",
            "--devices", devices, "--mesh", tmp_path / "program.ply")
    film = tactus.open_scene_source(tactus.Scene({"source": {"kind": "masks", "path": str(tmp_path / "film/rig.yaml")}}))
    frame = film.next_frame()
    masks = [frame.mask(k) for k in range(len(film.rig.cameras))]
    assert len(masks) == 8 and masks[0].dtype == bool and film.status == ""

    hull = tactus.VisualHull(devices, film.rig, resolution=64)
    hull.reconstruct(tactus.Frame(masks)).write_ply(str(tmp_path / "python.ply"))
    assert (tmp_path / "python.ply").read_bytes() == (tmp_path / "program.ply").read_bytes()
    assert film.next_frame() is None and film.frame_count == 1


@needs_program
@pytest.mark.parametrize("scene_file", ["fig16-rabbit.yaml", "fig18-scalpel.yaml"])
def test_a_figure_of_numpy_masks_is_the_programs_run(scene_file, tmp_path):
    """Frames go through numpy: source, Perception and World by hand."""
    path, frames = SOURCE / "scenes" / scene_file, 3
    program("run", path, "--frames", frames, "--view", "none", "--devices", "cpu", "--json", tmp_path / "run.json")
    scene, devices = tactus.Scene(path), tactus.Devices("cpu")
    source = tactus.open_scene_source(scene)
    perception = tactus.Perception(devices, scene, source.rig)
    world = tactus.World(devices, scene, perception)
    last_s = None
    for _ in range(frames):
        seen = source.next_frame()
        frame = tactus.Frame([seen.mask(k) for k in range(len(source.rig.cameras))], tick=seen.tick, time_s=seen.time_s,
                             depths_m=[seen.depth_m(k) for k in range(seen.depth_count)])
        dt_s = 0 if last_s is None else frame.time_s - last_s
        world.set_surface(perception.observe(frame, dt_s))
        report = world.step(dt_s)
        last_s = frame.time_s
    assert report.substeps > 0
    assert world.state_hash() == json.loads((tmp_path / "run.json").read_text())["state_hash"]


def test_sources_say_what_is_wrong():
    nobody = tactus.open_scene_source(tactus.Scene({"source": {"kind": "none", "frames": "0-1", "fps": 50}}))
    assert [nobody.next_frame().time_s for _ in range(2)] == [0, 0.02] and nobody.next_frame() is None
    assert len(nobody.rig.cameras) == 0 and nobody.frame_count == 0 and nobody.fps == 50
    with pytest.raises(tactus.Error, match="nowhere.yaml"):
        tactus.open_scene_source(tactus.Scene({"source": {"kind": "masks", "path": "nowhere.yaml"}}))


def test_swapped_cameras_are_found_and_cured():
    source = tactus.open_scene_source(tactus.Scene({"source": {"kind": "synthetic", "figure": "hand"}}))
    frame = source.next_frame()
    masks = [frame.mask(k) for k in range(len(source.rig.cameras))]
    well = tactus.doctor(source.rig, [tactus.Frame(masks)])
    assert well.verdict == "well" and min(well.recall_before) > 0.96 and not [f for f in well.findings if f.is_fault]
    assert tactus.examine_rig is tactus.doctor, "its name in C++"
    masks[2], masks[5] = masks[5], masks[2]
    faulty = tactus.doctor(source.rig, [tactus.Frame(masks)])
    assert faulty.verdict == "faulty" and {(f.camera, f.other) for f in faulty.findings} == {(2, 5)}
    assert min(faulty.recall_before) < 0.9 < 0.96 < min(faulty.recall_after)
    with pytest.raises(tactus.Error, match="frames is empty"):
        tactus.doctor(source.rig, [])
    with pytest.raises(tactus.Error, match=r"frames\[0\] has 7 masks, expected one for each of the 8 cameras"):
        tactus.doctor(source.rig, [tactus.Frame(masks[:7])])


def test_import_is_quick():
    """At most 60 ms of the processor, beside numpy's: a busy machine takes longer on the clock."""
    script = ("import numpy, time\nbegin = time.process_time()\nimport tactus\nprint(time.process_time() - begin)")
    times_s = [float(subprocess.run([sys.executable, "-c", script], capture_output=True, check=True).stdout) for _ in range(5)]
    assert min(times_s) < 0.060


def test_ctrl_c_ends_a_run(tmp_path):
    script = ("import tactus\nprint('begun', flush=True)\n"
              f"tactus.run(tactus.Scene({{**{{'source': {{'kind': 'none', 'frames': '0-99999', 'fps': 60}}}}, 'bodies': "
              f"[{{'name': 'b', 'shape': {{'kind': 'box', 'size_m': [0.1, 0.1, 0.1]}}, 'spacing_m': 0.01}}]}}), 'cpu', "
              f"lambda *frame: None)")
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        assert run.stdout.readline() == "begun\n"
        time.sleep(0.5)
        run.send_signal(signal.SIGINT)
        _, errors = run.communicate(timeout=30)
    assert run.returncode == -signal.SIGINT or run.returncode == 130, errors
    assert "KeyboardInterrupt" in errors


def test_a_world_shows_itself():
    world = tactus.World("cpu", tactus.Scene(SOURCE / "scenes/touch.yaml"))
    try:
        picture = world.show((320, 240))
    except tactus.Error as error:
        pytest.skip(str(error))
    assert picture.shape == (240, 320, 3) and picture.dtype == np.uint8
    red, green = picture[..., 0].astype(int), picture[..., 1].astype(int)
    # The slab is red, and nothing else is; it fills a tenth of the picture or more.
    assert 0.05 < (red - green > 40).mean() < 0.6
    with pytest.raises(tactus.Error, match="width"):
        world.show((3, 3))
