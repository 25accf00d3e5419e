#!/usr/bin/env python3
"""The stream as tests/web/read_stream.py reads it, and the page in Debian's Chromium, on a run of the program.

usage: tests/web/page_test.py PROGRAM [--reader | --page]
  77 where Python's part needs what isn't there: the server, the page, node, chromium, or playwright-core. That is looked for in
  $TACTUS_NPM and in node_modules of the folder it runs in: npm install --prefix FOLDER playwright-core iwer; TACTUS_NPM=FOLDER/node_modules
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
SCENE = """
name: "<script>alert(1)</script>"
source: {kind: none, frames: 0-29999, fps: 30}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.16, 0.06, 0.16]}
    placement: {position_m: [0, 0.03, 0]}
    spacing_m: 0.01
    cuttable: true
    material: {model: tled, young_modulus_pa: 12000}
    fixed:
      - {kind: half_space, frame: world, point_m: [0, 0.001, 0], normal: [0, 1, 0]}
obstacles:
  - {name: ball, kind: sphere, radius_m: 0.025, placement: {position_m: [0, 0.1, 0]}, held: true}
blades:
  - {name: knife, held: true, from_m: [0.3, 0.3, 0], to_m: [0.3, 0.36, 0]}
gravity_m_s2: [0, 0, 0]
view:
  show_frusta: false
  camera: {target_m: [0, 0.05, 0], distance_m: 0.45, azimuth_deg: 30, elevation_deg: 25}
"""


def skip(why: str) -> None:
    print(f"skipped: {why}")
    sys.exit(77)


class Run:
    """The program with --web on a free port."""

    def __init__(self, program: str, folder: pathlib.Path) -> None:
        scene = folder / "scene.yaml"
        scene.write_text(SCENE)
        self.process = subprocess.Popen([program, "run", str(scene), "--view", "none", "--web", "0", "--web-control"],
                                        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.address = ""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if found := re.search(r"http://([\d.]+:\d+)/", line):
                self.address = found.group(1)
                return
            print(line, end="")

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        self.process.wait(20)


def check_reader(run: Run) -> None:
    """What the page of the format says is enough to find the scene again."""
    quaternion = [0, 0, 0, 1]
    grab = json.dumps({"do": "grab", "body": "block", "point_m": [0.07, 0.06, 0.07], "target_m": [0.07, 0.08, 0.07]})
    pose = json.dumps({"do": "pose", "obstacle": "ball", "position_m": [0.01, 0.2, 0], "quaternion": quaternion})
    out = subprocess.run([sys.executable, str(HERE / "read_stream.py"), run.address, "--frames", "12", "--send", pose, "--send", grab, "--send", '{"do": "jump"}'],
                         stdout=subprocess.PIPE, text=True, timeout=60, check=True).stdout
    messages = [json.loads(line) for line in out.splitlines()]
    setting = messages[0]["blocks"][0]["json"]
    assert setting["scene"] == "<script>alert(1)</script>" and setting["held"] == ["ball", "knife"] and setting["grabbed"] == ["block"] and setting["control"], setting
    assert any(p["name"] == "gravity_m_s2.y" and p["value"] == 0 and p["unit"] for p in setting["parameters"]), setting["parameters"]
    texts = [m["text"] for m in messages if "text" in m]
    assert any("'jump'" in t.get("error", "") for t in texts), texts
    frames = [m for m in messages if m.get("kind") == "frame"]
    assert [f["frame"] for f in frames] == sorted({f["frame"] for f in frames}), "frames go back"
    assert all("knife" in [b["name"] for b in f["blocks"]] for f in frames), "a held blade has no name of its own"
    blocks = {b["name"]: b for b in frames[-1]["blocks"]}
    # Nothing loads the block in its first frame. Its surface is as large as the box, to half a step of 0.16 m / 65535. Then its corner is pulled up.
    block = {b["name"]: b for b in frames[0]["blocks"]}["block"]
    for axis, (low, high) in enumerate([(-0.08, 0.08), (0, 0.06), (-0.08, 0.08)]):
        assert abs(block["min_m"][axis] - low) < 1e-4 and abs(block["max_m"][axis] - high) < 1e-4, block
    assert abs(block["volume_m3"] / (0.16 * 0.06 * 0.16) - 1) < 0.01, block["volume_m3"]
    assert blocks["block"]["max_m"][1] > 0.062, blocks["block"]
    # The ball of flat triangles has the sphere's volume; it went where it was sent.
    ball = blocks["ball"]
    assert abs(ball["volume_m3"] / 6.545e-5 - 1) < 0.01, ball["volume_m3"]
    middle = [(a + b) / 2 for a, b in zip(ball["min_m"], ball["max_m"])]
    assert max(abs(a - b) for a, b in zip(middle, [0.01, 0.2, 0])) < 1e-4, middle
    assert blocks["status"]["json"]["stages"], "no stages"


def node_modules() -> str:
    for folder in (os.environ.get("TACTUS_NPM", ""), "node_modules"):
        if folder and (pathlib.Path(folder) / "playwright-core").exists():
            return str(pathlib.Path(folder).resolve())
    return ""


def main() -> None:
    program, part = sys.argv[1], sys.argv[2]
    missing = json.loads(subprocess.run([program, "info", "--json", "-"], capture_output=True, text=True, check=True).stdout).get("missing", [])
    for word in ("civetweb",) + (("three",) if part == "--page" else ()):
        if any(m.startswith(word) for m in missing):
            skip(f"the program was built without {word}")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if part == "--reader":
            with Run(program, folder) as run:
                check_reader(run)
            return
        chromium, modules = shutil.which("chromium"), node_modules()
        if not (chromium and shutil.which("node") and modules):
            skip("node, chromium or playwright-core is not here")
        (folder / "scene.yaml").write_text(SCENE)
        report = folder / "report.html"
        subprocess.run([program, "run", str(folder / "scene.yaml"), "--frames", "20", "--view", "none", "--report", str(report)],
                       check=True, stdout=subprocess.DEVNULL)
        with Run(program, folder) as run:
            environment = dict(os.environ, TACTUS_NPM=modules)
            code = subprocess.run(["node", str(HERE / "page_test.mjs"), chromium, f"http://{run.address}/", report.as_uri()],
                                  env=environment, timeout=480, check=False).returncode
        sys.exit(code)


if __name__ == "__main__":
    main()
