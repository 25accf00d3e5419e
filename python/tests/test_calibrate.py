"""Cameras from pictures of a board that are drawn here."""
import os
import re
import subprocess

import numpy as np
import pytest
import tactus

SIZE_PX, SQUARE_M, COLUMNS, ROWS = (640, 480), 0.03, 7, 5
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")
PROGRAM = os.environ.get("TACTUS_PROGRAM", "")


def camera(angle, focal_px):
    """At 0.6 m from the middle, that it looks at."""
    z = -np.array([np.sin(angle), -0.5, -np.cos(angle)])
    z /= np.linalg.norm(z)
    x = np.cross([0, 1, 0], z)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = [x, np.cross(z, x), z]
    T[2, 3] = 0.6
    return np.array([[focal_px, 0, 322.5], [0, focal_px, 238.0], [0, 0, 1]]), T


def turn(axis, angle):
    k = np.cross(np.eye(3), axis)
    return np.eye(3) - np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def picture(K, T_cam_board):
    """A chessboard with a white margin on grey; each pixel is the mean of nine points in it."""
    at = (np.arange(3) + 0.5) / 3 - 0.5
    v, u = np.mgrid[0:SIZE_PX[1], 0:SIZE_PX[0]].astype(float)
    total = np.zeros_like(u)
    # (x, y, 1) of the board goes to the picture by a homography.
    H = np.linalg.inv(K @ T_cam_board[:3, [0, 1, 3]])
    for dv in at:
        for du in at:
            p = np.tensordot(H, np.stack([u + du, v + dv, np.ones_like(u)]), 1)
            x, y = p[:2] / p[2] / SQUARE_M
            inside = (x > -1) & (x < COLUMNS) & (y > -1) & (y < ROWS)
            near = (x > -1.5) & (x < COLUMNS + 0.5) & (y > -1.5) & (y < ROWS + 0.5)
            black = (np.floor(x) + np.floor(y)) % 2 == 0
            total += np.where(inside, np.where(black, 20, 230), np.where(near, 230, 120))
    return (total / 9).round().astype(np.uint8)


def sweep(cameras, instants=12, seed=3):
    rng = np.random.default_rng(seed)
    middle = np.array([(COLUMNS - 1) / 2 * SQUARE_M, (ROWS - 1) / 2 * SQUARE_M, 0])
    boards = []
    for _ in range(instants):
        T = np.eye(4)
        # It faces the cameras, which are before and above it, tilted by up to 25 degrees either way.
        T[:3, :3] = turn([1, 0, 0], 2.7 + rng.uniform(-0.4, 0.4)) @ turn([0, 1, 0], rng.uniform(-0.4, 0.4)) \
            @ turn([0, 0, 1], rng.uniform(-0.3, 0.3))
        T[:3, 3] = rng.uniform(-0.06, 0.06, 3) - T[:3, :3] @ middle
        boards.append(T)
    return {name: [picture(K, T @ board) for board in boards] for name, (K, T) in cameras.items()}, boards


CAMERAS = {"left": camera(-0.25, 600.0), "right": camera(0.25, 620.0)}


@pytest.fixture(scope="module")
def seen():
    return sweep(CAMERAS)[0]


def need(call):
    try:
        return call()
    except tactus.Error as error:
        if "built without" in str(error) or "Ceres" in str(error):
            pytest.skip(str(error))
        raise


def test_a_rig_is_found(seen):
    found = need(lambda: tactus.calibrate(seen, f"chessboard:{COLUMNS}x{ROWS}", square_m=SQUARE_M, coefficients=2, floor=0))
    assert [c.name for c in found.cameras] == ["left", "right"] and found.rms_px < 0.15 and found.left_out == []
    for c, (K, _) in zip(found.cameras, CAMERAS.values()):
        # Corners are found within 0.1 px: a hundred views of 35 of them leave a thousandth of the focal length; ten times that is asked.
        assert abs(c.K[0, 0] / K[0, 0] - 1) < 0.01 and abs(c.K[1, 1] / K[1, 1] - 1) < 0.01
    left, right = (T for _, T in CAMERAS.values())
    found_left, found_right = (c.T_cam_world for c in found.cameras)
    off = found_right @ np.linalg.inv(found_left) @ np.linalg.inv(right @ np.linalg.inv(left))
    assert np.linalg.norm(off[:3, 3]) < 3e-3 and np.arccos(np.clip((np.trace(off[:3, :3]) - 1) / 2, -1, 1)) < 5e-3
    # The first picture's board is the floor: corner 0 is the origin, and the cameras are above it.
    assert np.abs(found.board_poses[0][:3, 3]).max() < 1e-9
    assert all(np.linalg.inv(c.T_cam_world)[1, 3] > 0 for c in found.cameras)
    lens = found.lens(0)
    assert lens["model"] == "brown" and np.abs(lens["coefficients"]).max() < 0.2 and len(found.advice) == 2


def test_files_and_arrays_give_the_same(seen, tmp_path):
    """Up to the order in which two threads of the solver add, 1e-12 of a value; and the program's file has the same numbers."""
    names = {}
    for name, pictures in seen.items():
        for k, grey in enumerate(pictures):
            (tmp_path / f"{name}{k}.pgm").write_bytes(b"P5 %d %d 255\n" % grey.shape[::-1] + grey.tobytes())
        names[name] = str(tmp_path / f"{name}%d.pgm")
    board = {"board": f"chessboard:{COLUMNS}x{ROWS}", "square_m": SQUARE_M, "coefficients": 2, "floor": 0}
    arrays = need(lambda: tactus.calibrate(seen, **board))
    files = tactus.calibrate(names, **board)
    for a, b in zip(arrays.cameras, files.cameras):
        assert np.allclose(a.K, b.K, 1e-9) and np.allclose(a.T_cam_world, b.T_cam_world, 1e-9, 1e-9)
    colors = tactus.calibrate({n: [np.repeat(p[..., None], 3, axis=2) for p in all] for n, all in seen.items()}, **board)
    assert np.allclose(colors.cameras[1].T_cam_world, arrays.cameras[1].T_cam_world, 1e-9, 1e-9)
    arrays.write(str(tmp_path / "rig"))
    assert len(tactus.Rig(str(tmp_path / "rig/rig.yaml")).cameras) == 2
    if not PROGRAM:
        return
    subprocess.run([PROGRAM, "calibrate", "rig", "--board", board["board"], "--square-mm", "30", "--coefficients", "2", "--floor", "0",
                    *(f"--camera={n}={p}" for n, p in names.items()), "--out", tmp_path / "program"], check=True, stdout=subprocess.DEVNULL)
    ours, theirs = ([float(x) for x in NUMBER.findall((tmp_path / folder / "cameras.json").read_text())] for folder in ("rig", "program"))
    assert len(ours) == len(theirs) > 40 and np.allclose(ours, theirs, 1e-9, 1e-9)


def test_one_camera_and_its_lens_in_a_rig(seen, tmp_path):
    alone = need(lambda: tactus.calibrate({"left": seen["left"]}, f"chessboard:{COLUMNS}x{ROWS}", square_m=SQUARE_M, coefficients=2))
    assert len(alone.cameras) == 1 and abs(alone.cameras[0].K[0, 0] / 600 - 1) < 0.02
    alone.write(str(tmp_path / "lens"))
    assert (tmp_path / "lens/left.yaml").exists() and (tmp_path / "lens/report.html").exists()
    rig = tactus.calibrate(seen, f"chessboard:{COLUMNS}x{ROWS}", square_m=SQUARE_M, coefficients=2)
    kept = tactus.calibrate(seen, f"chessboard:{COLUMNS}x{ROWS}", square_m=SQUARE_M, lenses=rig)
    for a, b in zip(kept.cameras, rig.cameras):
        assert (a.K == b.K).all(), "lenses that are given stay"


@pytest.mark.parametrize("change, message", [
    ({"pictures": {}}, r"pictures is empty, expected a dict of cameras' names"),
    ({"pictures": {3: []}}, r"pictures has a int for a key, expected a camera's name"),
    ({"pictures": {"a": 3}}, r"pictures\['a'\] is a int, expected a film, a pattern of files with one %d, or a list of arrays"),
    ({"pictures": {"a": []}}, r"pictures\['a'\] has no picture, expected one or more"),
    ({"pictures": {"a": [np.zeros((4, 4))]}}, r"pictures\['a'\]\[0\] is a float64 array of shape \(4, 4\), expected"),
    ({"pictures": {"a": [np.zeros((40, 40), np.uint8), np.zeros((40, 41), np.uint8)]}}, r"\[1\] has 41x40 pixels, expected 40x40"),
    ({"pictures": {"a": "nowhere%d.png"}}, r"nowhere"),
    ({"pictures": {"a": "x.mp4", "b": [np.zeros((40, 40), np.uint8)]}}, r"files and arrays, expected one or the other"),
    ({"pictures": {"a": [np.zeros((40, 40), np.uint8)]}}, r"a"),
    ({"board": "chess:9x6"}, r"chess"), ({"square_m": float("nan")}, r"nan"), ({"square_m": -1}, r"-1"),
    ({"lens": "fish"}, r"lens 'fish': expected brown or fisheye"), ({"coefficients": 3}, r"coefficients 3: expected 2, 4, 5 or 8"),
    ({"every": 0}, r"every is 0, expected"), ({"floor": -1}, r"floor is -1, expected the number of a picture"),
])
def test_mistakes_are_named(change, message):
    good = {"pictures": {"a": [np.zeros((40, 40), np.uint8)]}, "board": "chessboard:9x6", "square_m": 0.03}
    with pytest.raises(tactus.Error, match=message):
        need(lambda: tactus.calibrate(**good | change))
