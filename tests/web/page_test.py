#!/usr/bin/env python3
"""The stream as tests/web/read_stream.py reads it, and the page in Debian's Chromium, on a run of the program.

usage: tests/web/page_test.py PROGRAM [--reader | --page | --tls]
  77 where Python's part needs what isn't there: the server, the page, node, chromium, or playwright-core. That is looked for in
  $TACTUS_NPM and in node_modules of the folder it runs in: npm install --prefix FOLDER playwright-core iwer; TACTUS_NPM=FOLDER/node_modules
"""
import json
import os
import pathlib
import re
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import threading

from read_stream import Stream, decode

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
# Cameras see a hand that comes down on a slab.
FILMED = """
source: {kind: synthetic, figure: hand, frames: 0-29999, fps: 30}
reconstruction: {resolution: 24}
bodies:
  - name: slab
    shape: {kind: box, size_m: [0.4, 0.08, 0.4]}
    placement: {position_m: [0, 0.3, 0]}
    spacing_m: 0.04
gravity_m_s2: [0, -9.81, 0]
"""
HULL = """
source: {kind: synthetic, figure: hand, scale: 0.8, frames: 0-29999, fps: 30}
reconstruction: {resolution: 100}
"""


def skip(why: str) -> None:
    print(f"skipped: {why}")
    sys.exit(77)


class Run:
    """The program with --web on a free port."""

    def __init__(self, program: str, folder: pathlib.Path, text: str = SCENE, flags: tuple[str, ...] = ("--web-control",)) -> None:
        scene = folder / "scene.yaml"
        scene.write_text(text)
        self.process = subprocess.Popen([program, "run", str(scene), "--view", "none", "--web", "0", *flags],
                                        stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.address = self.url = ""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            if found := re.search(r"(?:pass viewers on to |http://)([\d.]+:\d+)", line):
                self.address = found.group(1)
            if found := re.search(r"open (https?://\S+)", line):
                self.url = found.group(1)
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


class Steps:
    """A viewer who stops a run, and takes its frames one by one."""

    def __init__(self, run: Run) -> None:
        self.stream = Stream(run.address, None)
        self.past: dict = {}

    def ask(self, message: dict, until: str) -> dict:
        """@param until the first "frame", "state" or "error" that is an answer: others are passed over."""
        self.stream.send(json.dumps(message))
        return self.await_(until)

    def await_(self, until: str) -> dict:
        while True:
            data = self.stream.message()
            if isinstance(data, str):
                text = json.loads(data)
                self.past = text.get("past", self.past)
                if until in text:
                    return text
            elif until == "frame" and (message := decode(data))["kind"] == "frame":
                return {"number": message["frame"], "blocks": [b for b in message["blocks"] if b["kind"] != 4],
                        "hash": next(b for b in message["blocks"] if b["kind"] == 4)["json"].get("state_hash")}

    def step(self, after: dict) -> dict:
        """The first frame that is newer than `after`."""
        self.stream.send('{"do": "step"}')
        while (frame := self.await_("frame"))["number"] <= after["number"]:
            pass
        return frame

    def go_back_to(self, frame: dict) -> dict:
        """Simulates again from there. @returns the state in which it is the newest"""
        while self.ask({"do": "see", "frame": frame["number"]}, "frame")["number"] != frame["number"]:
            pass
        state = self.ask({"do": "again"}, "state")
        while state.get("past", {}).get("last") != frame["number"]:
            state = self.await_("state")
        return state


def check_past(run: Run, is_moving: bool) -> None:
    """A frame of the past is shown again as it was. Simulated again from there, the next ones have the same bits, until something is touched."""
    viewer = Steps(run)
    viewer.await_("frame")
    assert "no frame of the past" in viewer.ask({"do": "again"}, "error")["error"]
    assert "either" in viewer.ask({"do": "see"}, "error")["error"]
    if not is_moving:
        viewer.stream.send(json.dumps({"do": "set", "parameter": "gravity_m_s2.y", "value": -9.81}))
    while viewer.ask({"do": "pause"}, "state")["state"] != "paused":
        pass
    first = viewer.ask({"do": "step"}, "frame")
    while first["hash"] is None:  # those from before the pause have none
        first = viewer.ask({"do": "step"}, "frame")
    # A frame that was being made when the pause came may still be on its way, and each step's frame would be the next one's answer.
    # Once the run went back, none is. One goes back from the frame after it, or a later one.
    viewer.step(after=first)
    viewer.go_back_to(first)
    frames = [first]
    while len(frames) < 12:
        frames.append(viewer.step(after=frames[-1]))
    assert [f["number"] for f in frames] == list(range(first["number"], frames[-1]["number"] + 1)), [f["number"] for f in frames]
    assert len({f["hash"] for f in frames}) == len(frames), "nothing moves, so equal bits would say nothing"
    fifth, sixth = frames[4], frames[5]
    assert viewer.ask({"do": "see", "frame": sixth["number"]}, "frame") == sixth
    assert viewer.ask({"do": "see", "steps": -1}, "frame") == fifth
    assert viewer.ask({"do": "see", "frame": 1_000_000}, "frame") == frames[-1]
    assert viewer.ask({"do": "see", "frame": fifth["number"]}, "frame") == fifth
    while viewer.past.get("seen") != fifth["number"]:
        viewer.await_("state")
    assert viewer.past["again_from"] == fifth["number"] and viewer.past["last"] == frames[-1]["number"], viewer.past
    state = viewer.go_back_to(fifth)
    assert state["state"] == "paused" and "seen" not in state["past"], state
    again = [fifth]
    while again[-1]["number"] < frames[-1]["number"]:
        again.append(viewer.step(after=again[-1]))
    assert again == frames[4:], "simulated again, the bits are others"
    # Touched, they are others.
    viewer.go_back_to(fifth)
    viewer.stream.send('{"do": "set", "parameter": "gravity_m_s2.y", "value": 9.81}')
    other = viewer.step(after=fifth)
    assert other["number"] == sixth["number"] and other["hash"] != sixth["hash"], "a parameter that is set while it is paused isn't the next frame's"


class TlsServer:
    """In front of a run, as stunnel is: ends TLS, and passes bytes on as they are."""

    def __init__(self, folder: pathlib.Path, port: int, to: str) -> None:
        cert, key = folder / "cert.pem", folder / "key.pem"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "1", "-subj", "/CN=lab.example",
                        "-addext", "subjectAltName=DNS:lab.example", "-keyout", key, "-out", cert], check=True, capture_output=True)
        self.context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self.context.load_cert_chain(cert, key)
        self.listens = socket.create_server(("127.0.0.1", port))
        self.to = to
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self) -> None:
        while True:
            threading.Thread(target=self.carry, args=(self.listens.accept()[0],), daemon=True).start()

    def carry(self, client: socket.socket) -> None:
        host, port = self.to.rsplit(":", 1)
        try:
            with self.context.wrap_socket(client, server_side=True) as near, socket.create_connection((host, int(port))) as far:
                near.settimeout(0.02)
                far.settimeout(0.02)
                while True:
                    for one, other in ((near, far), (far, near)):
                        try:
                            data = one.recv(1 << 18)
                        except TimeoutError:
                            continue
                        if not data:
                            return
                        other.settimeout(20)
                        other.sendall(data)
                        other.settimeout(0.02)
        except OSError:
            return


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as it:
        return int(it.getsockname()[1])


def check_tls(program: str, folder: pathlib.Path, chromium: str | None, modules: str) -> None:
    """Behind a server that speaks TLS, Host, Origin and token are checked as without, and browsers call the page secure."""
    port = free_port()
    name = f"lab.example:{port}"
    with Run(program, folder, SCENE, ("--web-control", "--web-name", name)) as run:
        assert run.url.startswith(f"https://{name}/#token="), run.url
        token = run.url.split("=")[1]
        TlsServer(folder, port, run.address)
        context = ssl.create_default_context(cafile=str(folder / "cert.pem"))

        def status(path: str, host: str = name, origin: str | None = f"https://{name}") -> int:
            with context.wrap_socket(socket.create_connection(("127.0.0.1", port), timeout=20), server_hostname="lab.example") as s:
                upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" if path.startswith("/stream") else ""
                s.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n{upgrade}{f'Origin: {origin}' + chr(13) + chr(10) if origin else ''}\r\n".encode())
                return int(s.recv(12).split()[1])

        stream = f"/stream?token={token}"
        got = {text: status(*asked) for text, asked in {
            "page": ("/",), "stream": (stream,), "NAME in capitals": (stream, f"LAB.example:{port}", f"https://LAB.example:{port}"), "a program": (stream, name, None),
            "no token": ("/stream",), "wrong token": (stream[:-1] + ("0" if token[-1] != "0" else "1"),), "another origin": (stream, name, "https://evil.example"),
            "http": (stream, name, f"http://other.example:{port}"), "another host": (stream, "evil.example", "https://evil.example"), "page at another host": ("/", "evil.example"),
            "another port": (stream, "lab.example:1", "https://lab.example:1")}.items()}
        print("behind TLS:", got)
        assert list(got.values()) == [200, 101, 101, 101, 403, 403, 403, 403, 403, 403, 403], got
        if not (chromium and shutil.which("node") and modules):
            print("skipped: the browser behind TLS")
            return
        script = """
const { chromium } = require(process.argv[1] + '/playwright-core');
(async () => {
  const browser = await chromium.launch({ executablePath: process.argv[2], args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--host-resolver-rules=MAP lab.example 127.0.0.1'] });
  const page = await (await browser.newContext({ ignoreHTTPSErrors: true })).newPage();
  await page.goto(process.argv[3]);
  await page.waitForFunction(() => (window.tactus?.frames ?? 0) > 3, null, { timeout: 60000 });
  console.log(JSON.stringify(await page.evaluate(() => ({ secure: isSecureContext, xr: 'xr' in navigator, stream: tactus.socket.url.split('?')[0] }))));
  await browser.close();
})();
"""
        out = subprocess.run(["node", "-e", script, modules, chromium, run.url], stdout=subprocess.PIPE, text=True, timeout=120, check=True).stdout
        print("in the browser:", out.strip())
        assert json.loads(out) == {"secure": True, "xr": True, "stream": f"wss://{name}/stream"}, out


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
            for text, is_moving in ((SCENE, False), (FILMED, True)):
                with Run(program, folder, text) as run:
                    check_past(run, is_moving)
            with Run(program, folder, SCENE, ()) as run:
                viewer = Steps(run)
                assert "--web-control" in viewer.ask({"do": "see", "frame": 1}, "error")["error"]
            return
        chromium, modules = shutil.which("chromium"), node_modules()
        if part == "--tls":
            if not shutil.which("openssl"):
                skip("openssl is not here")
            check_tls(program, folder, chromium, modules)
            return
        if not (chromium and shutil.which("node") and modules):
            skip("node, chromium or playwright-core is not here")
        (folder / "scene.yaml").write_text(SCENE)
        report = folder / "report.html"
        subprocess.run([program, "run", str(folder / "scene.yaml"), "--frames", "20", "--view", "none", "--report", str(report)],
                       check=True, stdout=subprocess.DEVNULL)
        with Run(program, folder) as run, Run(program, folder, HULL, ()) as hull:
            environment = dict(os.environ, TACTUS_NPM=modules)
            code = subprocess.run(["node", str(HERE / "page_test.mjs"), chromium, f"http://{run.address}/", report.as_uri(), f"http://{hull.address}/"],
                                  env=environment, timeout=480, check=False).returncode
        sys.exit(code)


if __name__ == "__main__":
    main()
