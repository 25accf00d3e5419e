"""Things that are held and pulled, and what else of World and Perception Python has."""
import os

import numpy as np
import pytest
import tactus

SOURCE = os.environ["TACTUS_SOURCE_DIR"]
HAND = {"source": {"kind": "synthetic", "figure": "hand"}}
BLOCK = {
    "gravity_m_s2": [0, -9.81, 0],
    "bodies": [{"name": "block", "shape": {"kind": "box", "size_m": [0.04, 0.04, 0.04]}, "spacing_m": 0.005,
                "material": {"young_modulus_pa": 20000, "drag_per_s": 10}}]}
WEIGHT_N = 9.81 * 0.064  # of 1000 kg/m^3


def grab(target_y_m=0.02, **of):
    return tactus.Grab("block", (0, 0.02, 0), (0, target_y_m, 0), **of)


def test_a_grab_bears_a_block():
    """After 4 s, drag of 10 / s leaves e^-20 of the motion. It acts after gravity: of each substep's g dt a share of
    10 / s dt is gone, 1 % and less."""
    world = tactus.World("cpu", tactus.Scene(BLOCK))
    world.set_grab(grab(stiffness_N_m=60.0, max_force_N=10.0))
    for _ in range(200):
        report = world.step(1 / 50)
    assert report.grab_N[1] == pytest.approx(WEIGHT_N * (1 - 10 / 50 / report.substeps), rel=1e-3)
    assert np.abs(report.grab_N[[0, 2]]).max() < 1e-3 * WEIGHT_N
    world.set_grab(None)
    report = world.step(1 / 50)
    assert (report.grab_N == 0).all() and world.velocities("block")[:, 1].mean() < 0, "it falls"


def test_a_grab_says_what_it_was_given():
    g = tactus.Grab("block", point_m=[0, 0.02, 0], target_m=np.array([0.01, 0.02, 0]), radius_m=0.01)
    assert g.body == "block" and (g.target_m == (0.01, 0.02, 0)).all() and (g.point_m == (0, 0.02, 0)).all()
    assert (g.radius_m, g.stiffness_N_m, g.max_force_N) == (0.01, None, None) and repr(g) == "tactus.Grab('block')"


@pytest.mark.parametrize("call, message", [
    (lambda w: w.set_grab(tactus.Grab("blok", (0, 0.02, 0), (0, 0, 0))), r"'blok'.*did you mean 'block'"),
    (lambda w: w.set_grab(tactus.Grab("block", (0, 3, 0), (0, 0, 0))), r"point_m"),
    (lambda w: w.set_grab(grab(stiffness_N_m=-1.0)), r"stiffness_N_m.*-1"),
    (lambda w: grab(float("nan")), r"target_m is not finite, expected \(x, y, z\) \[m\]"),
    (lambda w: tactus.Grab("block", (0, 0), (0, 0, 0)), r"point_m is a tuple, expected \(x, y, z\) \[m\]"),
    (lambda w: w.reduce_quality(["hul"]), r"reductions has 'hul', expected 'photographs', 'hull', 'liquid' or 'samples'"),
    (lambda w: w.set_pose("slicer", np.eye(4)), r"'slicer' is no obstacle or blade with 'held: true'; the scene has none"),
])
def test_mistakes_are_named(call, message):
    world = tactus.World("cpu", tactus.Scene(BLOCK))
    with pytest.raises(tactus.Error, match=message):
        call(world)
    world.step(1 / 60)


def test_a_held_blade_cuts_where_it_is_led():
    """Through a block of 8 cm, 2 cm deep: the incision's area is that of its wall, at rest, up to a cube's sides on each
    of its three edges: (8 +- 1 cm) x (2 +- 1 cm)."""
    scene = {"gravity_m_s2": [0, 0, 0],
             "bodies": [{"name": "block", "cuttable": True, "shape": {"kind": "box", "size_m": [0.08, 0.08, 0.08]},
                         "spacing_m": 0.01, "material": {"model": "tled", "young_modulus_pa": 20000},
                         "fixed": [{"kind": "half_space", "point_m": [0, -0.039, 0], "normal": [0, 1, 0]}]}],
             "blades": [{"name": "slicer", "held": True, "from_m": [0, 0.02, -0.1], "to_m": [0, 0.02, 0.1]}]}
    scene["blades"][0] |= {"from_m": [0, 0.02, -0.06], "to_m": [0, 0.1, -0.06]}
    world = tactus.World("cpu", tactus.Scene(scene))
    pose = world.pose("slicer")
    assert (pose == np.eye(4)).all()
    faces = len(world.snapshot().bodies[0].triangles)
    for _ in range(30):
        pose[2, 3] += 0.12 / 30
        world.set_pose("slicer", pose)
        world.step(1 / 60)
    assert (world.pose("slicer") == pose).all()
    [stroke] = world.stroke_results()
    assert (stroke.blade, stroke.body, stroke.stroke, stroke.plan, stroke.deviation) == ("slicer", "block", 0, "", None)
    assert 0.07 * 0.01 < stroke.area_m2 < 0.09 * 0.03 and 0.01 < stroke.depth_m < 0.03
    assert stroke.cut_cubes > 0 and 0 < stroke.begin_s < stroke.end_s and stroke.peak_force_N is None
    assert 0.06 < stroke.skin_length_m < 0.14, "over the top, and down both sides of 2 cm"
    assert len(world.snapshot().bodies[0].triangles) > faces and len(world.snapshot().blades) == 1
    assert repr(stroke) == "tactus.StrokeResult('slicer' in 'block')"
    pose[:3, 3] += 1
    world.set_pose("slicer", pose, at_once=True)
    world.step(1 / 60)
    assert (world.pose("slicer") == pose).all() and len(world.stroke_results()) == 1, "put down elsewhere, it cut nothing"


def test_moved_regions_feel_their_body():
    world = tactus.World("cpu", tactus.Scene(os.path.join(SOURCE, "scenes/moved.yaml")))
    for _ in range(10):
        world.step(1 / 30)
    forces = world.motion_forces()
    assert set(forces) == set(world.bodies) and len(forces["bar"]) == 1
    force_N, torque_N_m = forces["bar"][0]
    assert force_N.shape == torque_N_m.shape == (3,) and force_N[0] > 1, "it pulls the bar along x"
    times = world.timings_ms()
    assert times["frame"] > 0 and all(ms >= 0 for ms in times.values())


def test_liquids_are_counted():
    world = tactus.World("cpu", tactus.Scene(os.path.join(SOURCE, "scenes/dam.yaml")))
    report = world.step(1 / 60)
    assert report.liquid["here"] == report.liquid["placed"] == len(world.snapshot().liquid) > 0
    assert report.liquid["taken"] == 0 and report.liquid["film_m3"] == 0
    forces = dict(report.liquid_forces)
    assert forces and all(force_N.shape == (3,) for force_N in forces.values())


def test_a_perception_is_reduced_on_demand():
    scene = tactus.Scene(HAND | {"reconstruction": {"resolution": 40}})
    source = tactus.open_scene_source(scene)
    seen = tactus.Perception("cpu", scene, source.rig, can_reduce=True)
    world = tactus.World(seen.devices, scene, seen)
    low_m, high_m = seen.workspace_m
    assert seen.voxel_size_m == pytest.approx((high_m - low_m).max() / 40, rel=1e-6)
    assert world.quality_reductions() == ["hull", "samples"]

    def vertices(frame):
        world.set_surface(seen.observe(frame, 1 / 30))
        return world.step(1 / 30).hull

    frame = source.next_frame()
    fine = vertices(frame)
    world.reduce_quality(["hull"])
    coarse = vertices(frame)
    assert 0.15 < coarse["vertices"] / fine["vertices"] < 0.35, "a quarter: they cover an area"
    assert fine["overflow"] == coarse["overflow"] == "" and fine["triangles"] > fine["vertices"]
    world.reduce_quality([])
    assert vertices(frame) == fine and isinstance(seen.last_notices(), list)
    plain = tactus.Perception("cpu", scene, source.rig)
    assert tactus.World(plain.devices, scene, plain).quality_reductions() == []
