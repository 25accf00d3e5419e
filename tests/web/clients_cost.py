#!/usr/bin/env python3
"""How much viewers of --web cost the physics: frames with one viewer against frames with another that stalls, others that are killed, and twenty.

usage: tests/web/clients_cost.py PROGRAM [--scene FILE] [--devices LIST] [--block SECONDS] [--turns N]
  The conditions take turns in one run, in another order each time, so that other work of the machine meets all of them. Prints one line of JSON: per
  condition the frames, p50 and p99 of the physics (wall time, from the trace), and the processor time of its thread per frame, each also relative to one viewer.
"""
import argparse
import json
import os
import pathlib
import random
import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

from read_stream import Stream

SCENE = """
source: {kind: none, frames: 0-999999, fps: 60}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.4, 0.1, 0.4]}
    placement: {position_m: [0, 0.3, 0]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 12000}
    fixed: [{kind: half_space, frame: world, point_m: [-0.19, 0, 0], normal: [1, 0, 0]}]
gravity_m_s2: [0, -9.81, 0]
output: {trace: true}
"""


class Reader(threading.Thread):
    """Takes all that comes, until it is stopped."""

    def __init__(self, address: str) -> None:
        super().__init__(daemon=True)
        self.stream = Stream(address, None)
        self.stops = False
        self.anchor: tuple | None = None  # number of a frame, and when it began [s since 1970]
        self.start()

    def run(self) -> None:
        try:
            while not self.stops:
                data = self.stream.message()
                if self.anchor is None and isinstance(data, bytes) and struct.unpack_from("<I", data, 8)[0] == 2:
                    self.anchor = struct.unpack_from("<I", data, 16)[0], struct.unpack_from("<d", data, 32)[0]
        except (OSError, EOFError):
            pass
        self.stream.socket.close()


def nothing(_: str) -> list:
    return []


def stalled(address: str) -> list:
    """Reads nothing after the head. Its small buffer fills with the first frame."""
    stream = Stream.__new__(Stream)
    stream.socket = socket.socket()
    stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    host, port = address.rsplit(":", 1)
    stream.socket.connect((host, int(port)))
    stream.socket.sendall(f"GET /stream HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                          "Sec-WebSocket-Version: 13\r\n\r\n".encode())
    return [stream.socket]


class Killed(threading.Thread):
    """A viewer whose connection is reset in the middle of a frame, and the next, ten times a second."""

    def __init__(self, address: str) -> None:
        super().__init__(daemon=True)
        self.address, self.stops, self.count = address, False, 0
        self.start()

    def run(self) -> None:
        while not self.stops:
            [one] = stalled(self.address)
            time.sleep(0.1)
            one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")  # closing resets
            one.close()
            self.count += 1


# "same" says how far two equal conditions are apart here.
CONDITIONS = {"one": nothing, "same": nothing, "stalled": stalled, "killed": lambda a: [Killed(a)], "twenty": lambda a: [Reader(a) for _ in range(19)]}


def leave(others: list) -> None:
    for other in others:
        if isinstance(other, socket.socket):
            other.close()
        else:
            other.stops = True
    for other in others:
        if isinstance(other, threading.Thread):
            other.join(5)


def cpu_s(pid: int) -> float:
    """Of the main thread, which is that of the physics."""
    try:
        return int(pathlib.Path(f"/proc/{pid}/task/{pid}/schedstat").read_text().split()[0]) / 1e9
    except OSError:
        fields = pathlib.Path(f"/proc/{pid}/task/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def percentile(values: list, p: float) -> float:
    values = sorted(values)
    return values[min(len(values) - 1, int(p / 100 * len(values)))] if values else float("nan")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--scene")
    parser.add_argument("--devices", default="cpu")
    parser.add_argument("--block", type=float, default=2)
    parser.add_argument("--turns", type=int, default=8)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scene = folder / "scene.yaml"
        scene.write_text(SCENE if options.scene is None else pathlib.Path(options.scene).read_text())
        process = subprocess.Popen([options.program, "run", str(scene), "--view", "none", "--out", str(folder), "--devices", options.devices, "--web", "0"],
                                   stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        assert process.stderr is not None
        address = next(found.group(1) for line in process.stderr if (found := re.search(r"http://([\d.]+:\d+)/", line)))
        threading.Thread(target=process.stderr.read, daemon=True).start()
        first = Reader(address)
        time.sleep(3)
        spans: dict[str, list] = {c: [] for c in CONDITIONS}
        for turn in range(options.turns):
            for condition in random.Random(turn).sample(list(CONDITIONS), len(CONDITIONS)):
                others = CONDITIONS[condition](address)
                time.sleep(0.3)
                begin, used = time.time(), cpu_s(process.pid)
                time.sleep(options.block)
                spans[condition].append((begin, time.time(), cpu_s(process.pid) - used))
                leave(others)
                time.sleep(0.3)
        process.send_signal(2)
        process.wait(60)
        first.stops = True
        [trace] = folder.glob("*trace*.json")
        events = json.loads(trace.read_text())
    frames = [(e["ts"] / 1e6, e["dur"] / 1e3) for e in events if e.get("name") == "frame"]
    assert first.anchor is not None
    number, unix_s = first.anchor
    frames = [(t - frames[number - 1][0] + unix_s, ms) for t, ms in frames]
    result: dict = {"load": os.getloadavg()[0], "cores": os.cpu_count()}
    for condition, of in spans.items():
        ms = [d for t, d in frames for a, b, _ in of if a <= t < b]
        result[condition] = {"frames": len(ms), "p50_ms": percentile(ms, 50), "p99_ms": percentile(ms, 99), "cpu_ms": 1e3 * sum(c for *_, c in of) / max(1, len(ms))}
    for condition in list(CONDITIONS)[1:]:
        for key in ("p50_ms", "p99_ms", "cpu_ms"):
            result[condition][key.replace("_ms", "_ratio")] = result[condition][key] / result["one"][key]
    print(json.dumps({k: ({a: round(b, 3) for a, b in v.items()} if isinstance(v, dict) else v) for k, v in result.items()}))


if __name__ == "__main__":
    sys.exit(main())
