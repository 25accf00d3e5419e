#!/usr/bin/env python3
"""A camera's client in Python, written from docs/wire.md alone: what the page says is enough, and true.

usage: wire_client.py TACTUS FOLDER   makes a film of two cameras in FOLDER, serves it, and sends both cameras' masks.
Exits 0 when sets came complete, 1 when not, 77 (skipped) without pyzmq or a program with live cameras.
"""
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import time

try:
    import zmq
except ImportError:
    print("python3-zmq is not installed")
    sys.exit(77)

FPS, FRAMES = 30, 60


def fnv1a(data: bytes) -> int:
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 % 2**64
    return value


def calibration_hash(path: pathlib.Path, width: int, height: int) -> int:
    """Of OpenCV's YAML, as `tactus synth` writes it: five coefficients of a brown lens."""
    text = path.read_text()

    def numbers(key):
        data = re.search(key + r".*?data:\s*\[(.*?)\]", text, re.S).group(1)
        return [float(v) for v in data.replace("\n", " ").split(",")]

    k, lens = numbers("CameraMatrix"), numbers("DistortionCoeffs")
    lens += [0.0] * (14 - len(lens))
    return fnv1a(struct.pack("<ii5dB14d", width, height, k[0], k[4], k[2], k[5], k[1], 1, *lens))


class Camera:
    def __init__(self, context, name: str, key: pathlib.Path, address: str, calibration: int, size):
        words = dict(line.split(" ", 1) for line in key.read_text().splitlines())
        self.socket = context.socket(zmq.DEALER)
        self.socket.linger = 0
        self.socket.curve_serverkey = words["server"].encode()
        self.socket.curve_publickey = words["public"].encode()
        self.socket.curve_secretkey = words["secret"].encode()
        self.socket.connect(address)
        self.name, self.calibration, self.size = name.encode(), calibration, size
        self.boot, self.sequence, self.receipts = int.from_bytes(os.urandom(8), "little"), 0, []
        self.hello()

    def hello(self):
        self.socket.send(struct.pack("<IIIIQ32s", 0x4D544354, 1, 1, 0, self.boot, self.name))

    def send(self, trigger: int):
        """A mask whose left half is set."""
        width, height = self.size
        words = (width + 31) // 32
        row = b"".join(struct.pack("<I", 0xFFFFFFFF if 32 * (w + 1) <= width // 2 else 0) for w in range(words))
        data = row * height
        payload = struct.pack("<IIBI", width, height, 0, len(data)) + data
        self.sequence += 1
        now = time.monotonic()
        head = struct.pack("<IHHB3xI32sQQQqdd2i4HI12x", 0x50544354, 1, 128, 1, len(payload), self.name, self.calibration,
                           self.boot, self.sequence, trigger, now, now, width, height, 0, 0, 0, 0, 0)
        assert len(head) == 128
        self.socket.send(head + payload)

    def read_receipts(self):
        while self.socket.poll(0):
            magic, version, kind, detail, number = struct.unpack("<IIIIQ", self.socket.recv()[:24])
            assert (magic, version) == (0x4D544354, 1)
            if kind == 3:
                self.receipts.append((number, detail))


def status_of_nonsense(tactus: str, rig: pathlib.Path) -> bool:
    """Who answers the question for the status with something else is named, in one line and in no library's words."""
    socket = zmq.Context().socket(zmq.ROUTER)
    socket.linger = 0
    port = socket.bind_to_random_port("tcp://127.0.0.1")
    ok = True
    for answer in (b"nonsense", b"{", b"[]", b'{"sets": "many"}', b'{"cameras": [{}]}', bytes(300)):
        asked = subprocess.Popen([tactus, "rig", "status", rig, "--plain", "--server", f"tcp://127.0.0.1:{port}"],
                                 stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        if socket.poll(20000):
            identity, _ = socket.recv_multipart()
            socket.send_multipart([identity, answer])
        reported = asked.communicate()[1]
        if asked.returncode != 1 or "sends no status" not in reported or "json.exception" in reported or reported.count("\n") != 1:
            print(f"{answer!r}: {asked.returncode}, {reported}")
            ok = False
    return ok


def main() -> int:
    tactus, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)  # of an earlier run
    subprocess.run([tactus, "synth", "hand", "--cameras", "2", "--depth-cameras", "0", "--no-colors", "--out", folder],
                   check=True, stdout=subprocess.DEVNULL)
    rig = folder / "rig.yaml"
    port = 20000 + os.getpid() % 20000
    rig.write_text(rig.read_text() + f"live: {{address: 'tcp://127.0.0.1:{port}', sync: trigger}}\n")
    made = subprocess.run([tactus, "keys", rig], capture_output=True, text=True, check=False)
    if made.returncode != 0 and "ZeroMQ" in made.stderr:
        print("this program was built without live cameras")
        return 77
    server = subprocess.Popen([tactus, "serve", rig, "--seconds", "20"], stdout=subprocess.DEVNULL)
    try:
        context = zmq.Context()
        size = [int(v) for v in re.search(r"image_size_px: \[(\d+), (\d+)\]", rig.read_text()).groups()]
        cameras = [Camera(context, name, folder / "keys" / f"{name}.key", f"tcp://127.0.0.1:{port}",
                          calibration_hash(folder / "cameras" / f"{name}.yaml", *size), size) for name in ("cam0", "cam1")]
        begin = time.monotonic() + 1
        for tick in range(FRAMES):
            time.sleep(max(0.0, begin + tick / FPS - time.monotonic()))
            for camera in cameras:
                if tick % 15 == 0:
                    camera.hello()
                camera.send(tick)
                camera.read_receipts()
        time.sleep(0.3)
        status = json.loads(subprocess.run([tactus, "rig", "status", rig, "--json", "-"], capture_output=True, check=True).stdout)
    finally:
        server.terminate()
        server.wait()
    ok = True
    for camera in cameras:
        camera.read_receipts()
        taken = sum(1 for _, detail in camera.receipts if detail == 0)
        refused = sorted({detail for _, detail in camera.receipts if detail != 0})
        print(f"{camera.name.decode()}: {len(camera.receipts)} receipts, {taken} taken, refused for {refused}")
        ok = ok and taken >= 0.9 * FRAMES
    print(f"{status['sets']} sets, {status['complete_sets']} complete")
    # Sets of the first ticks may miss a camera that was still connecting.
    ok = status_of_nonsense(tactus, rig) and ok
    return 0 if ok and status["complete_sets"] >= 0.9 * FRAMES else 1


if __name__ == "__main__":
    sys.exit(main())
