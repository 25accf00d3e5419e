#!/usr/bin/python3
"""Random faults around a live rig of eight cameras, from a seed.

usage: tools/live_chaos.py chaos|pauses TACTUS [--seconds 600] [--seed 1] [--deadline 0.033] [--folder DIR]

chaos   Six cameras are left alone. Another one's client is killed, stopped, and its cable cut; with the key of the last, bad
        packets, packets twice and times that jump are sent. Strangers connect and talk nonsense. Expected: the server never
        ends, 99 % of the ticks have the six cameras' images, and it takes less than 5 MB more after the first minute.
pauses  Everybody is stopped for up to ten seconds, or killed: clients (and started again), the process of the sockets, the
        server (stopped only). Expected: the server never ends, and two seconds after each fault 27 sets a second or more come
        again, with every camera in 20 of them or more. (How many are complete at their deadline depends on what else the computer
        does.)

Prints a line per fault and, at the end, what was measured; exits 1 where that is not as expected, 77 without pyzmq.
"""
import argparse
import contextlib
import json
import os
import pathlib
import random
import re
import selectors
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

try:
    import zmq
except ImportError:
    print("python3-zmq is not installed")
    sys.exit(77)

CAMERAS, FPS = 8, 30
VICTIM, MAD = "cam6", "cam7"
PORT = 20000 + os.getpid() % 20000


class Cable:
    """A proxy of TCP between clients and the server that can be cut: connections end, or say nothing more."""

    def __init__(self, port: int, server_port: int):
        self.listener = socket.create_server(("127.0.0.1", port), backlog=64)
        self.server_port, self.pairs, self.is_silent, self.stops = server_port, {}, False, False
        self.selector = selectors.DefaultSelector()
        self.selector.register(self.listener, selectors.EVENT_READ)
        self.lock = threading.Lock()
        threading.Thread(target=self.work, daemon=True).start()

    def work(self):
        while not self.stops:
            for key, _ in self.selector.select(0.1):
                with self.lock:
                    if key.fileobj is self.listener:
                        self.accept()
                    elif not self.is_silent:
                        self.hand_on(key.fileobj)
            if self.is_silent:
                time.sleep(0.02)

    def accept(self):
        client, _ = self.listener.accept()
        try:
            server = socket.create_connection(("127.0.0.1", self.server_port), timeout=1)
        except OSError:
            client.close()
            return
        for a, b in ((client, server), (server, client)):
            a.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.pairs[a] = b
            self.selector.register(a, selectors.EVENT_READ)

    def hand_on(self, of):
        if of not in self.pairs:
            return
        try:
            data = of.recv(1 << 16)
            if data:
                self.pairs[of].sendall(data)
                return
        except OSError:
            pass
        self.end(of)

    def end(self, of):
        other = self.pairs.pop(of)
        self.pairs.pop(other, None)
        for s in (of, other):
            with contextlib.suppress(KeyError, ValueError):
                self.selector.unregister(s)
            s.close()

    def cut(self):
        with self.lock:
            for s in list(self.pairs):
                if s in self.pairs:
                    self.end(s)


class Mad:
    """Whoever has a camera's key and means no good: docs/wire.md's packets, and others."""

    def __init__(self, key: pathlib.Path, address: str, size, rng: random.Random):
        words = dict(line.split(" ", 1) for line in key.read_text().splitlines())
        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.DEALER)
        self.socket.linger = 0
        self.socket.sndhwm = 100
        self.socket.curve_serverkey = words["server"].encode()
        self.socket.curve_publickey = words["public"].encode()
        self.socket.curve_secretkey = words["secret"].encode()
        self.socket.heartbeat_ivl = 500  # libzmq 4.3.4 has faults in them
        self.socket.connect(address)
        self.size, self.rng, self.sequence, self.boot = size, rng, 0, rng.getrandbits(64)

    def send(self, data: bytes):
        with contextlib.suppress(zmq.Again):
            self.socket.send(data, zmq.DONTWAIT)

    def packet(self, calibration: int, captured: float, trigger=-1, payload=b"") -> bytes:
        self.sequence += 1
        width, height = self.size
        return struct.pack("<IHHB3xI32sQQQqdd2i4HI12x", 0x50544354, 1, 128, 1, len(payload), MAD.encode(), calibration,
                           self.boot, self.sequence, trigger, captured, captured, width, height, 0, 0, 0, 0, 0) + payload

    def do_something(self) -> str:
        what = self.rng.choice(["noise", "far times", "clock jumps", "twice", "flood", "bits", "hellos"])
        now = time.monotonic()
        if what == "noise":
            for _ in range(50):
                self.send(self.rng.randbytes(self.rng.randrange(0, 4000)))
        elif what == "far times":
            for t in (-1e300, 1e300, float("nan"), float("inf"), 1e10, -1e10):
                self.send(self.packet(0, t))
        elif what == "clock jumps":
            for k in range(60):
                self.send(self.packet(self.rng.getrandbits(64), now + self.rng.uniform(-1e6, 1e6), k))
        elif what == "twice":
            good = self.packet(0, now)
            for _ in range(20):
                self.send(good)
        elif what == "flood":
            for _ in range(2000):
                self.send(self.packet(0, now))
        elif what == "bits":
            good = bytearray(self.packet(0, now, payload=bytes(64)))
            for _ in range(50):
                good[self.rng.randrange(len(good))] ^= 1 << self.rng.randrange(8)
                self.send(bytes(good))
        else:
            for _ in range(1000):
                self.send(struct.pack("<IIIIQ32s", 0x4D544354, 1, 1, 0, self.rng.getrandbits(64), MAD.encode()))
        return "mad camera: " + what


class Rig:
    """Server and clients as processes, and what the server says of itself."""

    def __init__(self, tactus: str, folder: pathlib.Path, deadline_s: float):
        self.tactus, self.folder, self.rig = tactus, folder, folder / "rig.yaml"
        subprocess.run([tactus, "synth", "hand", "--moving", "--frames", "30", "--cameras", str(CAMERAS), "--depth-cameras", "0",
                        "--no-colors", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        self.rig.write_text(self.rig.read_text() + f"live: {{address: 'tcp://127.0.0.1:{PORT}', deadline_s: {deadline_s}}}\n")
        subprocess.run([tactus, "keys", self.rig], check=True, stdout=subprocess.DEVNULL)
        self.size = [int(v) for v in re.search(r"image_size_px: \[(\d+), (\d+)\]", self.rig.read_text()).groups()]
        self.log = (folder / "log").open("w")
        self.server = subprocess.Popen([tactus, "serve", self.rig, "--record", folder / "chaos.rec"],
                                       stdout=subprocess.DEVNULL, stderr=self.log)
        self.cable = Cable(PORT + 1, PORT)
        self.clients: dict[str, subprocess.Popen] = {}
        for c in range(CAMERAS):
            self.start(f"cam{c}")
        self.context = zmq.Context()
        self.ask_socket = None

    def start(self, name: str):
        port = PORT + 1 if name == VICTIM else PORT
        self.clients[name] = subprocess.Popen([self.tactus, "client", name, self.rig, "--server", f"tcp://127.0.0.1:{port}"],
                                              stdout=subprocess.DEVNULL, stderr=self.log)

    def sockets(self) -> int | None:
        """The process that holds the server's sockets."""
        for task in pathlib.Path(f"/proc/{self.server.pid}/task").iterdir():
            with contextlib.suppress(OSError):
                for pid in (task / "children").read_text().split():
                    return int(pid)
        return None

    def status(self, wait_s=1.0) -> dict | None:
        if self.ask_socket is None:
            words = dict(line.split(" ", 1) for line in (self.folder / "keys" / "status.key").read_text().splitlines())
            s = self.context.socket(zmq.DEALER)
            s.linger = 0
            s.curve_serverkey, s.curve_publickey, s.curve_secretkey = (words[k].encode() for k in ("server", "public", "secret"))
            s.reconnect_ivl, s.reconnect_ivl_max = 50, 200
            s.connect(f"tcp://127.0.0.1:{PORT}")
            self.ask_socket = s
        while self.ask_socket.poll(0):
            self.ask_socket.recv()
        until = time.monotonic() + wait_s
        while time.monotonic() < until:
            self.ask_socket.send(struct.pack("<IIIIQ32s", 0x4D544354, 1, 2, 0, 0, b""))
            if self.ask_socket.poll(200):
                return json.loads(self.ask_socket.recv())
        return None

    def resident_mb(self) -> float:
        return int(pathlib.Path(f"/proc/{self.server.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6

    def end(self):
        for process in [*self.clients.values(), self.server]:
            with contextlib.suppress(OSError):
                process.send_signal(signal.SIGCONT)
                process.terminate()
        for process in [*self.clients.values(), self.server]:
            process.wait(20)
        self.log.close()


def pause(pid: int, seconds: float):
    with contextlib.suppress(OSError):
        os.kill(pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(pid, signal.SIGCONT)


def wait_for_all(rig: Rig):
    for _ in range(60):
        status = rig.status()
        if status and all(c["present"] for c in status["cameras"]):
            return
        time.sleep(0.5)
    raise RuntimeError("the cameras never came")


def end_client(rig: Rig, name: str, kill: bool):
    rig.clients[name].send_signal(signal.SIGKILL if kill else signal.SIGTERM)
    rig.clients[name].wait()
    rig.start(name)


def chaos(rig: Rig, rng: random.Random, seconds: float) -> list[str]:
    rig.clients.pop(MAD).terminate()
    mad = Mad(rig.folder / "keys" / f"{MAD}.key", f"tcp://127.0.0.1:{PORT}", rig.size, rng)

    def stranger():
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", PORT), timeout=1) as s:
            s.sendall(rng.randbytes(500))
        return "a stranger talks nonsense"

    def silent_cable():
        rig.cable.is_silent = True
        time.sleep(rng.uniform(0.1, 5))
        rig.cable.is_silent = False
        return "the victim's cable was silent"

    faults = [
        lambda: end_client(rig, VICTIM, True) or "the victim was killed",
        lambda: end_client(rig, VICTIM, False) or "the victim was ended",
        lambda: pause(rig.clients[VICTIM].pid, rng.uniform(0.1, 10)) or "the victim was stopped",
        lambda: rig.cable.cut() or "the victim's cable was cut", silent_cable, stranger, mad.do_something, mad.do_something,
        mad.do_something
    ]
    before, begin = rig.status(), time.monotonic()
    minute_mb = 0.0
    count = 0
    while time.monotonic() - begin < seconds:
        if minute_mb == 0 and time.monotonic() - begin > 60:
            minute_mb = rig.resident_mb()
        told = rng.choice(faults)()
        count += 1
        print(f"{time.monotonic() - begin:7.1f} s  {told}", flush=True)
        if rig.server.poll() is not None:
            return [f"the server ended with {rig.server.returncode}"]
        time.sleep(rng.uniform(0.1, 1.5))
    after, lasted = rig.status(5), time.monotonic() - begin
    if after is None:
        return ["the server does not answer"]
    shares = []
    for a, b in zip(after["cameras"], before["cameras"]):
        if a["name"] not in (VICTIM, MAD):
            shares.append((a["in_sets"] - b["in_sets"]) / (lasted * FPS))
    grown = rig.resident_mb() - minute_mb if minute_mb else 0
    print(f"{count} faults in {lasted:.0f} s: {after['sets'] - before['sets']} sets; of the ticks, honest cameras are in "
          f"{100 * min(shares):.2f} to {100 * max(shares):.2f} %; {grown:+.2f} MB after the first minute; sockets started again: "
          f"{after['socket_restarts']}; refused of the mad one: {after['cameras'][-1]['refused']}")
    honest = [(a, b) for a, b in zip(after["cameras"], before["cameras"]) if a["name"] not in (VICTIM, MAD)]
    for key in ("packets", "lost", "replaced", "copies"):
        print(f"honest cameras, {key}: {[a[key] - b[key] for a, b in honest]}")
    print(f"honest cameras, refused: {[a['refused'] for a, _ in honest]}")
    wrong = []
    if min(shares) < 0.99:
        wrong.append(f"an honest camera is in {100 * min(shares):.2f} % of the ticks")
    if grown >= 5:
        wrong.append(f"{grown:.1f} MB more")
    return wrong


def pauses(rig: Rig, rng: random.Random, seconds: float) -> list[str]:
    wrong, count, slow = [], 0, 0
    begin = time.monotonic()
    while time.monotonic() - begin < seconds:
        name = f"cam{rng.randrange(CAMERAS)}"
        long = rng.choice([0.2, 1, 3, 10]) * rng.uniform(0.3, 1)
        whom = rng.choice(["client", "sockets", "server"])
        sockets = rig.sockets()
        if whom == "client" and rng.random() < 0.5:
            end_client(rig, name, rng.random() < 0.5)
            told = f"{name} was ended"
        elif whom == "client":
            pause(rig.clients[name].pid, long)
            told = f"{name} was stopped for {long:.1f} s"
        elif whom == "sockets" and sockets and rng.random() < 0.5:
            os.kill(sockets, rng.choice([signal.SIGKILL, signal.SIGABRT]))
            told = "the sockets were killed"
        elif whom == "sockets" and sockets:
            pause(sockets, long)
            told = f"the sockets were stopped for {long:.1f} s"
        else:
            pause(rig.server.pid, long)
            told = f"the server was stopped for {long:.1f} s"
        count += 1
        time.sleep(2)
        if rig.server.poll() is not None:
            return [f"{told}: the server ended with {rig.server.returncode}"]
        first, at = rig.status(), time.monotonic()
        time.sleep(1)
        second = rig.status()
        lasted = time.monotonic() - at
        if first is None or second is None:
            wrong.append(f"{told}: no answer two seconds later")
            continue
        rate, whole = ((second[key] - first[key]) / lasted for key in ("sets", "complete_sets"))
        least = min(b["in_sets"] - a["in_sets"] for a, b in zip(first["cameras"], second["cameras"])) / lasted
        line = f"{told}: {rate:.1f} sets a second, {whole:.1f} complete, two seconds later; the last camera is in {least:.1f}"
        print(f"{time.monotonic() - begin:7.1f} s  {line}", flush=True)
        if rate < 27 or least < 20:
            slow += 1
            wrong.append(line)
    status = rig.status(5)
    print(f"{count} faults, {slow} with fewer than 27 sets a second, or a camera in fewer than 20, two seconds later; sockets started again: "
          f"{status['socket_restarts'] if status else '?'}")
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["chaos", "pauses"])
    parser.add_argument("tactus")
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--deadline", type=float, default=0.033, help="more on a computer that is busy with other things")
    parser.add_argument("--folder")
    arguments = parser.parse_args()
    folder = pathlib.Path(arguments.folder or tempfile.mkdtemp(prefix="tactus-chaos-"))
    rig = Rig(arguments.tactus, folder, arguments.deadline)
    try:
        wait_for_all(rig)
        wrong = (chaos if arguments.what == "chaos" else pauses)(rig, random.Random(arguments.seed), arguments.seconds)
    finally:
        rig.end()
    if rig.server.returncode not in (0, 130):
        wrong.append(f"the server ended with {rig.server.returncode}")
    for line in wrong:
        print("WRONG: " + line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
