#!/usr/bin/env python3
"""Writes one rig of eight distorted cameras in every format that Tactus reads, and where 1,000 points land.

An independent witness: nothing but the standard library, and formulas written down from each tool's own documents.
Usage: write_calibrations.py FOLDER
manifest.txt: format, file, camera in it, file of points, unit_m or -, WxH or -, lens or -
A file of points: X Y Z [m, in the world of the file] u v [px, first pixel at (0, 0)].
"""
import json
import math
import os
import random
import struct
import sys

OUT = sys.argv[1]
SIZE = (1280, 720)
rng = random.Random(7)
manifest = []


def mul(A, B):
    return [[sum(A[i][k] * B[k][j] for k in range(len(B))) for j in range(len(B[0]))] for i in range(len(A))]


def apply(A, v):
    return [sum(a * b for a, b in zip(row, v)) for row in A]


def transposed(A):
    return [list(c) for c in zip(*A)]


def unit(v):
    n = math.sqrt(sum(x * x for x in v))
    return [x / n for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


class Camera:
    """R, t: world to camera [m]; K as fx fy cx cy; lens: 'none', 'brown' or 'fisheye' with coefficients d."""

    def __init__(self, i):
        a = 2 * math.pi * i / 8 + 0.1
        eye = [2.2 * math.cos(a), 1.1 + 0.3 * math.sin(3 * a), 2.2 * math.sin(a)]
        z = unit([-e + o for e, o in zip(eye, (0.05, 0.4, -0.02))])
        x = unit(cross(z, [0.1, 1, 0.05]))
        self.R = [x, cross(z, x), z]
        self.t = [-v for v in apply(self.R, eye)]
        self.eye = eye
        self.name = f"view{i}"
        self.K = [900 + 13.7 * i, 903 + 11.1 * i, 640.3 + 4.1 * i, 355.8 - 3.3 * i]

    def with_lens(self, lens, d):
        self.lens, self.d = lens, d
        return self

    def matrix(self):
        fx, fy, cx, cy = self.K
        return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]

    def project(self, p):
        x, y, z = (a + b for a, b in zip(apply(self.R, p), self.t))
        if z < 0.1:
            return None
        x, y = x / z, y / z
        r2 = x * x + y * y
        if self.lens == "brown":
            k1, k2, p1, p2, k3, k4, k5, k6 = (list(self.d) + [0.0] * 8)[:8]
            s = (1 + k1 * r2 + k2 * r2 ** 2 + k3 * r2 ** 3) / (1 + k4 * r2 + k5 * r2 ** 2 + k6 * r2 ** 3)
            x, y = (x * s + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * s + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)
        elif self.lens == "fisheye":
            r = math.sqrt(r2)
            th = math.atan(r)
            k = self.d
            s = th * (1 + k[0] * th ** 2 + k[1] * th ** 4 + k[2] * th ** 6 + k[3] * th ** 8) / r
            x, y = x * s, y * s
        elif self.lens in ("omni", "eucm", "ds"):
            return self.project_sphere(x * z, y * z, z)
        fx, fy, cx, cy = self.K
        return fx * x + cx, fy * y + cy

    def project_sphere(self, x, y, z):
        """Mei's unified model with radtan, the enhanced unified model, the double sphere: as their papers have them."""
        d = math.sqrt(x * x + y * y + z * z)
        if self.lens == "omni":  # onto the unit sphere, then from a point xi behind its centre
            xi, k1, k2, p1, p2 = self.d
            x, y = x / d / (z / d + xi), y / d / (z / d + xi)
            r2 = x * x + y * y
            s = 1 + k1 * r2 + k2 * r2 ** 2
            x, y = x * s + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * s + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        elif self.lens == "eucm":
            alpha, beta = self.d
            w = alpha * math.sqrt(beta * (x * x + y * y) + z * z) + (1 - alpha) * z
            x, y = x / w, y / w
        else:
            xi, alpha = self.d
            w = alpha * math.sqrt(x * x + y * y + (xi * d + z) ** 2) + (1 - alpha) * (xi * d + z)
            x, y = x / w, y / w
        fx, fy, cx, cy = self.K
        return fx * x + cx, fy * y + cy


def rig(kind):
    cams = []
    for i in range(8):
        c = Camera(i)
        brown = [-0.21 + 0.02 * i, 0.06 - 0.01 * i, 1e-3 * (i - 3), -7e-4 * i, 0.011 * i - 0.03, 0.02 * i, -0.01, 3e-3]
        fish = [0.03 - 0.01 * i, -0.012 + 2e-3 * i, 4e-3, -1e-3]
        if kind == "none":
            c.with_lens("none", [])
        elif kind == "fisheye" or (kind == "mixed" and i % 2):
            c.with_lens("fisheye", fish)
        else:
            c.with_lens("brown", brown[:{"brown4": 4, "mixed": 4, "brown5": 5, "brown8": 8}[kind]])
        cams.append(c)
    return cams


def points_file(stem, cam, world=None):
    """1,000 points per rig; `world` takes points of the common world to that of the file."""
    name = f"{stem}_{cam.name}.points"
    own = random.Random(11)
    with open(os.path.join(OUT, name), "w") as f:
        for _ in range(1000):
            p = [own.uniform(-0.5, 0.5), own.uniform(0, 1), own.uniform(-0.5, 0.5)]
            uv = cam.project(p)
            if uv:
                q = world(p) if world else p
                f.write(" ".join(repr(v) for v in [*q, *uv]) + "\n")
    return name


def row(fmt, path, camera, points, unit_m="-", size="-", lens="-"):
    manifest.append(" ".join([fmt, path, camera, points, str(unit_m), size, lens]))


def put(path, text):
    full = os.path.join(OUT, path)
    os.makedirs(os.path.dirname(full), exist_ok=True)
    with open(full, "wb" if isinstance(text, bytes) else "w") as f:
        f.write(text)


def cv_matrix(name, rows, cols, values, indent=""):
    data = ",\n       ".join(", ".join(repr(float(v)) for v in values[i:i + 4]) for i in range(0, len(values), 4))
    return (f"{indent}{name}: !!opencv-matrix\n{indent}   rows: {rows}\n{indent}   cols: {cols}\n{indent}   dt: d\n"
            f"{indent}   data: [ {data} ]\n")


def flat(M):
    return [v for r in M for v in r]


def rodrigues(R):
    angle = math.acos(max(-1, min(1, (R[0][0] + R[1][1] + R[2][2] - 1) / 2)))
    s = 2 * math.sin(angle)
    return [angle * (R[2][1] - R[1][2]) / s, angle * (R[0][2] - R[2][0]) / s, angle * (R[1][0] - R[0][1]) / s]


def quaternion(R):
    """w first, by half the rotation vector."""
    v = rodrigues(R)
    a = math.sqrt(sum(x * x for x in v))
    return [math.cos(a / 2)] + [math.sin(a / 2) * x / a for x in v]


def opencv():
    for c in rig("brown8"):  # millimetres, Rodrigues vector
        put(f"opencv/{c.name}.yml", "%YAML:1.0\n---\nimage_width: 1280\nimage_height: 720\n"
            + cv_matrix("camera_matrix", 3, 3, flat(c.matrix())) + cv_matrix("distortion_coefficients", 8, 1, c.d)
            + cv_matrix("rvec", 3, 1, rodrigues(c.R)) + cv_matrix("tvec", 3, 1, [1000 * v for v in c.t]))
        row("opencv", f"opencv/{c.name}.yml", c.name, points_file("brown8", c), 0.001)
    for c in rig("fisheye"):  # no size, a 3x4 matrix, nothing that tells a fisheye lens
        node = lambda name, r, k, v: (f'<{name} type_id="opencv-matrix">\n<rows>{r}</rows>\n<cols>{k}</cols>\n<dt>d</dt>\n'
                                      f"<data>\n{' '.join(repr(float(x)) for x in v)}</data></{name}>\n")
        rt = flat([r + [t] for r, t in zip(c.R, c.t)])
        put(f"opencv_xml/{c.name}.xml", '<?xml version="1.0"?>\n<opencv_storage>\n' + node("mtx", 3, 3, flat(c.matrix()))
            + node("dist", 4, 1, c.d) + node("Rt", 3, 4, rt) + "</opencv_storage>\n")
        row("opencv", f"opencv_xml/{c.name}.xml", c.name, points_file("fisheye", c), 1, "1280x720", "fisheye")
    a, b = rig("brown5")[:2]
    R = mul(b.R, transposed(a.R))
    T = [x - y for x, y in zip(b.t, apply(R, a.t))]
    to_a = lambda p: [x + y for x, y in zip(apply(a.R, p), a.t)]
    put("stereo/intrinsics.yml", "%YAML:1.0\n---\n" + cv_matrix("M1", 3, 3, flat(a.matrix())) + cv_matrix("D1", 1, 5, a.d)
        + cv_matrix("M2", 3, 3, flat(b.matrix())) + cv_matrix("D2", 1, 5, b.d))
    put("stereo/extrinsics.yml", "%YAML:1.0\n---\n" + cv_matrix("R", 3, 3, flat(R)) + cv_matrix("T", 3, 1, T))
    put("stereo_k.yml", "%YAML:1.0\n---\n" + cv_matrix("K1", 3, 3, flat(a.matrix())) + cv_matrix("D1", 1, 5, a.d)
        + cv_matrix("K2", 3, 3, flat(b.matrix())) + cv_matrix("D2", 1, 5, b.d) + cv_matrix("R", 3, 3, flat(R)) + cv_matrix("T", 3, 1, T))
    for path in ("stereo/intrinsics.yml", "stereo/extrinsics.yml", "stereo_k.yml"):
        for name, c in (("cam1", a), ("cam2", b)):
            row("opencv", path, name, points_file("stereo", c, to_a), 1, "1280x720")


def easymocap():
    cams = rig("brown5")
    names = "names:\n" + "".join(f'  - "{c.name}"\n' for c in cams)
    put("easymocap/intri.yml", "%YAML:1.0\n---\n" + names + '  - "never_placed"\n' + cv_matrix(
        "K_never_placed", 3, 3, flat(cams[0].matrix())) + "".join(
        cv_matrix(f"K_{c.name}", 3, 3, flat(c.matrix())) + cv_matrix(f"dist_{c.name}", 1, 5, c.d) for c in cams))
    put("easymocap/extri.yml", "%YAML:1.0\n---\n" + names + "".join(
        cv_matrix(f"R_{c.name}", 3, 1, rodrigues(c.R)) + cv_matrix(f"Rot_{c.name}", 3, 3, flat(c.R))
        + cv_matrix(f"T_{c.name}", 3, 1, c.t) for c in cams))
    for c in cams:
        row("easymocap", "easymocap/intri.yml", c.name, points_file("brown5", c), 1, "1280x720")


def mc_calib():
    cams = rig("mixed")
    text = "%YAML:1.0\n---\nnb_camera: 8\n"
    for i, c in enumerate(cams):  # centimetres; camera to world
        pose = flat([r + [100 * e] for r, e in zip(transposed(c.R), c.eye)]) + [0, 0, 0, 1]
        text += (f"camera_{i}:\n" + cv_matrix("camera_matrix", 3, 3, flat(c.matrix()), "   ")
                 + cv_matrix("distortion_vector", 1, 4, c.d, "   ")
                 + f"   distortion_type: {int(c.lens == 'fisheye')}\n   camera_group: 0\n   img_width: 1280\n   img_height: 720\n"
                 + cv_matrix("camera_pose_matrix", 4, 4, pose, "   "))
        row("mc-calib", "mc_calib.yml", f"camera_{i}", points_file("mixed", c), 0.01)
    put("mc_calib.yml", text)


def kalibr():
    cams = rig("mixed")
    first = cams[0]
    world = lambda p: [x + y for x, y in zip(apply(first.R, p), first.t)]
    text = ""
    for i, c in enumerate(cams):
        text += (f"cam{i}:\n  camera_model: pinhole\n  distortion_coeffs: {c.d}\n"
                 f"  distortion_model: {'equidistant' if c.lens == 'fisheye' else 'radtan'}\n  intrinsics: {c.K}\n"
                 f"  resolution: [1280, 720]\n  rostopic: /cam{i}/image_raw\n")
        if i:
            R = mul(c.R, transposed(cams[i - 1].R))
            T = [x - y for x, y in zip(c.t, apply(R, cams[i - 1].t))]
            text += "  T_cn_cnm1:\n" + "".join(f"  - {r + [t]}\n" for r, t in zip(R, T)) + "  - [0.0, 0.0, 0.0, 1.0]\n"
        row("kalibr", "camchain.yaml", f"cam{i}", points_file("kalibr", c, world))
    put("camchain.yaml", text)


def sphere_lenses():
    """Kalibr's omni, eucm and ds: projections of whole spheres."""
    lenses = (("omni", "radtan", [1.2, -0.05, 0.02, 1e-3, -5e-4]), ("omni", "none", [0.8, 0, 0, 0, 0]),
              ("eucm", "none", [0.62, 1.1]), ("ds", "none", [-0.21, 0.59]), ("ds", "none", [0.3, 0.4]))
    cams = [c.with_lens(lens, d) for c, (lens, _, d) in zip(rig("none"), lenses)]
    first, text = cams[0], ""
    world = lambda p: [x + y for x, y in zip(apply(first.R, p), first.t)]
    for i, (c, (lens, distortion, d)) in enumerate(zip(cams, lenses)):
        c.name = f"sphere{i}"
        own = d[:1] if lens == "omni" else d
        text += (f"cam{i}:\n  camera_model: {lens}\n  distortion_coeffs: {d[1:] if distortion == 'radtan' else []}\n"
                 f"  distortion_model: {distortion}\n  intrinsics: {own + c.K}\n  resolution: [1280, 720]\n")
        if i:
            R = mul(c.R, transposed(cams[i - 1].R))
            T = [x - y for x, y in zip(c.t, apply(R, cams[i - 1].t))]
            text += "  T_cn_cnm1:\n" + "".join(f"  - {r + [t]}\n" for r, t in zip(R, T)) + "  - [0.0, 0.0, 0.0, 1.0]\n"
        row("kalibr", "camchain_sphere.yaml", f"cam{i}", points_file("sphere", c, world))
    put("camchain_sphere.yaml", text)


def splatting():
    """cameras.json: camera to world, the principal point in the picture's middle; unit 0.5 m."""
    cams, entries = rig("none"), []
    for i, c in enumerate(cams):
        c.K[2:] = [639.5, 359.5]
        c.name = f"splat{i}"
        entries.append({"id": i, "img_name": f"{c.name}.png", "width": 1280, "height": 720, "position": [2 * v for v in c.eye],
                        "rotation": transposed(c.R), "fy": c.K[1], "fx": c.K[0]})
        row("3dgs", "cameras.json", c.name, points_file("splat", c), 0.5)
    put("cameras.json", "[ " + json.dumps(entries)[1:])


def vicon():
    """A pixel of the photo, moved by a polynomial of its distance from a centre, is the pinhole's."""
    text = '<?xml version="1.0" encoding="UTF-8" standalone="no" ?>\n<Cameras NAME="" VERSION="1.0">\n'
    for i, c in enumerate(rig("none")):
        c.K[1] = c.K[0]
        center, k = ([c.K[2] + 2, c.K[3] - 1], [1.2e-8, -1e-15, 1e-22]) if i % 2 else (c.K[2:], [-1.5e-8, 4e-15, 0.0])

        def seen(p, project=c.project, center=center, k=k):
            uv = project(p)
            if uv is None:
                return None
            x, y = uv[0] - center[0], uv[1] - center[1]
            far, r = math.hypot(x, y), math.hypot(x, y)
            for _ in range(50):  # Newton
                r -= (r * (1 + k[0] * r ** 2 + k[1] * r ** 4 + k[2] * r ** 6) - far) / (1 + 3 * k[0] * r ** 2 + 5 * k[1] * r ** 4 + 7 * k[2] * r ** 6)
            return center[0] + x * r / far, center[1] + y * r / far

        c.project = seen
        c.name = f"vicon{i}"
        w, x, y, z = quaternion(c.R)
        lens = (f'VICON_RADIAL2="Vicon3Parameter {center[0]!r} {center[1]!r} {k[0]!r} {k[1]!r} {k[2]!r}"' if i % 2
                else f'VICON_RADIAL="{k[0]!r} {k[1]!r}"')
        text += (f'  <Camera DEVICEID="{c.name}" DISPLAY_TYPE="Vue" PIXEL_ASPECT_RATIO="1" SENSOR_SIZE="1280 720" SKEW="0" USERID="{i}">\n'
                 f'    <KeyFrames>\n      <KeyFrame FOCAL_LENGTH="{c.K[0]!r}" FRAME="0" ORIENTATION="{x!r} {y!r} {z!r} {w!r}"'
                 f' POSITION="{1000 * c.eye[0]!r} {1000 * c.eye[1]!r} {1000 * c.eye[2]!r}" PRINCIPAL_POINT="{c.K[2]!r} {c.K[3]!r}" {lens}/>\n'
                 f"    </KeyFrames>\n  </Camera>\n")
        row("vicon", "rig.xcp", c.name, points_file("vicon", c))
    put("rig.xcp", text + '  <Camera DEVICEID="not_calibrated" SENSOR_SIZE="1280 720"><KeyFrames/></Camera>\n</Cameras>\n')


def multical():
    cams = rig("brown5")
    head = {c.name: {"model": "standard", "image_size": SIZE, "K": c.matrix(), "dist": [c.d]} for c in cams}
    put("multical.json", json.dumps({"cameras": head, "camera_poses": {c.name: {"R": c.R, "T": c.t} for c in cams}}))
    first = cams[0]
    world = lambda p: [x + y for x, y in zip(apply(first.R, p), first.t)]
    poses = {first.name: {"R": [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]], "T": [0.0, 0, 0]}}
    for a, b in zip(cams, cams[1:]):
        R = mul(b.R, transposed(a.R))
        poses[f"{b.name}_to_{a.name}"] = {"R": R, "T": [x - y for x, y in zip(b.t, apply(R, a.t))]}
    put("multical_chain.json", json.dumps({"cameras": head, "camera_poses": poses}, indent=1))
    for c in cams:
        row("multical", "multical.json", c.name, points_file("brown5", c), 1)
        row("multical", "multical_chain.json", c.name, points_file("chain", c, world), 1)


def colmap():
    """Unit: 0.37 m. Pixel centres at one half."""
    for fmt, kind, model, number in (("colmap", "brown8", "FULL_OPENCV", 6), ("colmap-binary", "mixed", None, None)):
        lenses, images = "# comment\n", "# comment\n"
        lens_bin, image_bin = struct.pack("<Q", 8), struct.pack("<Q", 8)
        for i, c in enumerate(rig(kind)):
            K = [c.K[0], c.K[1], c.K[2] + 0.5, c.K[3] + 0.5]
            name, number = (model, number) if model else (("OPENCV_FISHEYE", 5) if c.lens == "fisheye" else ("OPENCV", 4))
            q, t = quaternion(c.R), [v / 0.37 for v in c.t]
            lenses += f"{i + 1} {name} 1280 720 " + " ".join(map(repr, K + c.d)) + "\n"
            images += f"{i + 1} " + " ".join(map(repr, q + t)) + f" {i + 1} {c.name}.jpg\n" + ("1.5 2.5 -1\n" if i % 2 else "\n")
            lens_bin += struct.pack("<IiQQ", i + 1, number, 1280, 720) + struct.pack(f"<{4 + len(c.d)}d", *K, *c.d)
            image_bin += (struct.pack("<I7dI", i + 1, *q, *t, i + 1) + f"{c.name}.jpg".encode() + b"\0"
                          + struct.pack("<Q", i) + struct.pack("<ddq", 1.5, 2.5, -1) * i)
            folder = "colmap_text" if model else "colmap_bin"
            row(fmt, folder, c.name, points_file(kind, c), 0.37)
        if model:
            put("colmap_text/cameras.txt", lenses)
            put("colmap_text/images.txt", images)
        else:
            put("colmap_bin/cameras.bin", lens_bin)
            put("colmap_bin/images.bin", image_bin)


def toml():
    fmt = lambda v: "[ " + ", ".join(fmt(x) if isinstance(x, list) else repr(x) for x in v) + ",]"
    cams = rig("brown5")
    arrays, config, anipose = "", "CreationDate = 2023-03-31T09:56:43.193358\n\n", ""
    for i, c in enumerate(cams):
        body = (f"cam_id = {i}\nsize = [ 1280, 720,]\nrotation_count = 0\nerror = 0.5\nmatrix = {fmt(c.matrix())}\n"
                f"distortions = {fmt(c.d)}\nexposure = -7\nignore = false\ntranslation = {fmt(c.t)}\nrotation = {fmt(c.R)}\n\n")
        arrays += f"[cameras.{i}]\n" + body
        config += f"[cam_{i}]\n" + body
        for path in ("camera_array.toml", "config.toml"):
            row("caliscope", path, str(i), points_file("brown5", c))
    for i, c in enumerate(rig("mixed")):  # FreeMoCap: millimetres
        anipose += (f'[cam_{i}]\nname = "{c.name}"\nsize = [ 1280, 720,]\nmatrix = {fmt(c.matrix())}\n'
                    f"distortions = {fmt(c.d)}\nrotation = {fmt(rodrigues(c.R))}\ntranslation = {fmt([1000 * v for v in c.t])}\n"
                    f"fisheye = {'true' if c.lens == 'fisheye' else 'false'}\n\n")
        row("pose2sim", "anipose.toml", c.name, points_file("mixed", c), 0.001)
    put("camera_array.toml", arrays)
    put("config.toml", config)
    put("anipose.toml", anipose + "[metadata]\nadjusted = false\nerror = 0.0\n")


def qualisys():
    """The picture is a crop that begins at (32, 16); axes of the camera: right, up, backwards."""
    text = '<?xml version="1.0" encoding="UTF-8"?>\n<calibration source="x" qtm-version="2021.2">\n <cameras>\n'
    for c in rig("brown5"):
        r = [c.R[0], [-v for v in c.R[1]], [-v for v in c.R[2]]]
        axes = " ".join(f'r{i + 1}{j + 1}="{r[i][j]!r}"' for i in range(3) for j in range(3))
        k1, k2, p1, p2, k3 = c.d
        text += (f'  <camera active="1" serial="{c.name}" model="Miqus Video">\n'
                 f'   <fov_video left="32" top="16" right="1311" bottom="735"/>\n'
                 f'   <transform x="{1000 * c.eye[0]!r}" y="{1000 * c.eye[1]!r}" z="{1000 * c.eye[2]!r}" {axes}/>\n'
                 f'   <intrinsic sensorMinU="0" sensorMaxU="{64 * 1344 - 1}" focalLengthU="{64 * c.K[0]!r}" focalLengthV="{64 * c.K[1]!r}" centerPointU="{64 * (c.K[2] + 32)!r}"'
                 f' centerPointV="{64 * (c.K[3] + 16)!r}" skew="0" radialDistortion1="{k1!r}" radialDistortion2="{k2!r}"'
                 f' radialDistortion3="{k3!r}" tangentalDistortion1="{p1!r}" tangentalDistortion2="{p2!r}"/>\n  </camera>\n')
        row("qualisys", "calib.qca.txt", c.name, points_file("brown5", c))
    put("calib.qca.txt", text + " </cameras>\n</calibration>\n")


def nerfstudio():
    """Camera to world, OpenGL; what is the same for all stands once."""
    for kind, model in (("brown5", "OPENCV"), ("fisheye", "OPENCV_FISHEYE")):
        frames = []
        for c in rig(kind):
            R = transposed([c.R[0], [-v for v in c.R[1]], [-v for v in c.R[2]]])
            keys = dict(zip(("k1", "k2", "p1", "p2", "k3") if kind == "brown5" else ("k1", "k2", "k3", "k4"), c.d))
            frames.append({"file_path": f"images/{c.name}.png", "fl_x": c.K[0], "fl_y": c.K[1], "cx": c.K[2] + 0.5,
                           "cy": c.K[3] + 0.5, **keys,
                           "transform_matrix": [r + [2 * e] for r, e in zip(R, c.eye)] + [[0, 0, 0, 1]]})
            row("nerfstudio", f"transforms_{kind}.json", f"images/{c.name}", points_file(kind, c), 0.5)
        put(f"transforms_{kind}.json", json.dumps({"camera_model": model, "w": 1280, "h": 720, "frames": frames}, indent=1))


def ros():
    """A lens alone: points in the camera's frame."""
    for c, model in ((rig("brown8")[3], "rational_polynomial"), (rig("brown5")[5], "plumb_bob"), (rig("fisheye")[1], "equidistant")):
        world = lambda p, c=c: [x + y for x, y in zip(apply(c.R, p), c.t)]
        body = lambda name, r, k, v: f"{name}:\n  rows: {r}\n  cols: {k}\n  data: {[float(x) for x in v]}\n"
        P = flat([r + [0.0] for r in c.matrix()])
        put(f"ros_{model}.yaml", f"image_width: 1280\nimage_height: 720\ncamera_name: {c.name}\n" + body("camera_matrix", 3, 3, flat(c.matrix()))
            + f"distortion_model: {model}\n" + body("distortion_coefficients", 1, len(c.d), c.d)
            + body("rectification_matrix", 3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1]) + body("projection_matrix", 3, 4, P))
        row("ros", f"ros_{model}.yaml", c.name, points_file(f"ros_{model}", c, world))


def pinholes():
    cams = rig("none")
    P = lambda c: mul(c.matrix(), [r + [t] for r, t in zip(c.R, c.t)])
    text = ""
    for i, c in enumerate(cams):  # any scale and sign, as estimated matrices have
        text += c.name + "\n" + "\n".join(" ".join(repr(-0.013 * (i + 1) * v) for v in r) for r in P(c)) + "\n"
        row("projections", "matrices.txt", c.name, points_file("none", c), 1, "1280x720")
        row("middlebury", "x_par.txt", c.name, points_file("none", c), "-", "1280x720")
    put("matrices.txt", text)
    put("x_par.txt", "8\n" + "".join(
        f"{c.name} " + " ".join(map(repr, flat(c.matrix()) + flat(c.R) + c.t)) + "\n" for c in cams))


def matlab():
    """First pixel (1, 1); matrices of row vectors; inches."""
    cams = []
    for c in rig("brown5"):
        K = [[c.K[0], 0, c.K[2] + 1], [0, c.K[1], c.K[3] + 1], [0, 0, 1]]
        cams.append({"name": c.name, "ImageSize": [720, 1280], "IntrinsicMatrix": transposed(K),
                     "RadialDistortion": [c.d[0], c.d[1], c.d[4]], "TangentialDistortion": [c.d[2], c.d[3]],
                     "RotationMatrix": transposed(c.R), "TranslationVector": [v / 0.0254 for v in c.t], "WorldUnits": "inches"})
        row("matlab", "matlab.json", c.name, points_file("brown5", c))
    put("matlab.json", json.dumps({"cameras": cams}))


os.makedirs(OUT, exist_ok=True)
for write in (opencv, easymocap, mc_calib, kalibr, sphere_lenses, splatting, vicon, multical, colmap, toml, qualisys, nerfstudio, ros, pinholes, matlab):
    write()
put("manifest.txt", "\n".join(manifest) + "\n")
