#!/usr/bin/python3
"""What tools/live_chaos.py is made of: who speaks ZeroMQ, who watches the machine, a cable that can be cut, a camera gone mad.

It starts two of them as processes: live_chaos_parts.py witness, live_chaos_parts.py mad TACTUS FOLDER PORT SEED.
"""
import contextlib
import ctypes
import os
import pathlib
import random
import re
import selectors
import socket
import struct
import subprocess
import sys
import threading
import time

FPS = 30
VICTIM, MAD = "cam6", "cam7"


class Dealer:
    """A socket of the program's own ZeroMQ, with a key."""
    LIBRARY = None
    DEALER, LINGER, SNDHWM, IMMEDIATE, IVL, IVL_MAX, HEARTBEAT = 5, 17, 23, 39, 18, 21, 75
    PUBLIC, SECRET, SERVER = 48, 49, 50
    DONTWAIT, EVENTS, POLLIN = 1, 15, 1

    def __init__(self, key: pathlib.Path, address: str, heartbeat_ms=0):
        z = self.zeromq()
        words = dict(line.split(" ", 1) for line in key.read_text().splitlines())
        self.context = ctypes.c_void_p(z.zmq_ctx_new())
        self.socket = ctypes.c_void_p(z.zmq_socket(self.context, self.DEALER))
        for option, value in ((self.LINGER, 0), (self.SNDHWM, 100), (self.IMMEDIATE, 1), (self.IVL, 50), (self.IVL_MAX, 200),
                              (self.HEARTBEAT, heartbeat_ms), (self.SERVER, words["server"]), (self.PUBLIC, words["public"]),
                              (self.SECRET, words["secret"])):
            data = struct.pack("i", value) if isinstance(value, int) else value.encode()
            if z.zmq_setsockopt(self.socket, option, data, ctypes.c_size_t(len(data))) != 0:
                raise RuntimeError(f"ZeroMQ refuses option {option}")
        z.zmq_connect(self.socket, address.encode())
        self.room = ctypes.create_string_buffer(1 << 20)

    @classmethod
    def zeromq(cls, tactus: str = ""):
        """The one that the program is linked to; None without."""
        if cls.LIBRARY is None:
            told = subprocess.run(["ldd", tactus], capture_output=True, text=True, check=False).stdout
            found = re.search(r"libzmq\S* => (\S+)", told)
            if found:
                cls.LIBRARY = ctypes.CDLL(found.group(1))
                for name in ("zmq_ctx_new", "zmq_socket"):
                    getattr(cls.LIBRARY, name).restype = ctypes.c_void_p
        return cls.LIBRARY

    def send(self, data: bytes) -> bool:
        return self.zeromq().zmq_send(self.socket, data, ctypes.c_size_t(len(data)), self.DONTWAIT) >= 0

    def receive(self, wait_s=0.0):
        """The next message; None by then."""
        until = time.monotonic() + wait_s
        while True:
            n = self.zeromq().zmq_recv(self.socket, self.room, ctypes.c_size_t(len(self.room)), self.DONTWAIT)
            if n >= 0:
                return self.room.raw[:min(n, len(self.room))]
            if time.monotonic() >= until:
                return None
            time.sleep(0.002)


class Witness:
    """What the system does with a packet's five wake-ups at every tick: a process of its own, which says how late the last was."""
    HOPS = 5

    def __init__(self):
        self.process = subprocess.Popen([sys.executable, __file__, "witness"], stdout=subprocess.PIPE, text=True)
        self.seen: list[tuple[float, float]] = []  # when, how late
        threading.Thread(target=self.read, daemon=True).start()

    def read(self):
        for line in self.process.stdout:
            self.seen.append(tuple(float(v) for v in line.split()))

    def late(self, begin: float, end: float, deadline_s: float) -> int:
        return sum(1 for at, late in list(self.seen) if begin <= at < end and late > deadline_s)

    def summary(self, deadline_s: float) -> dict:
        late = sorted(s for _, s in list(self.seen)) or [0.0]
        return {"ticks": len(late), "late": sum(1 for s in late if s > deadline_s), "p50_ms": round(1e3 * late[len(late) // 2], 2),
                "p99_ms": round(1e3 * late[len(late) * 99 // 100], 2)}

    @classmethod
    def work(cls):
        ends = [os.pipe() for _ in range(cls.HOPS)]
        for hop in range(1, cls.HOPS):  # each wakes the next
            if os.fork() == 0:
                for i, (read, write) in enumerate(ends):
                    if i != hop:
                        os.close(write)
                    if i != hop - 1:
                        os.close(read)
                while data := os.read(ends[hop - 1][0], 8):
                    os.write(ends[hop][1], data)
                os._exit(0)
        parent = os.getppid()
        while os.getppid() == parent:
            beat = (int(time.time() * FPS) + 1) / FPS
            time.sleep(max(0.0, beat - time.time()))
            os.write(ends[0][1], struct.pack("d", beat))
            os.read(ends[-1][0], 8)
            print(f"{time.monotonic():.4f} {time.time() - beat:.5f}", flush=True)
        sys.exit(0)


class Cable:
    """A proxy of TCP between clients and the server that can be cut: connections end, or say nothing more."""

    def __init__(self, port: int, server_port: int):
        self.listener = socket.create_server(("127.0.0.1", port), backlog=64)
        self.server_port, self.pairs, self.is_silent = server_port, {}, False
        self.selector = selectors.DefaultSelector()
        self.selector.register(self.listener, selectors.EVENT_READ)
        self.lock = threading.Lock()
        threading.Thread(target=self.work, daemon=True).start()

    def work(self):
        while True:
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


def calibration_hash(path: pathlib.Path, size) -> int:
    """docs/wire.md: FNV-1a of the calibration that `tactus synth` writes."""
    def numbers(key):
        return [float(v) for v in re.search(key + r".*?data:\s*\[(.*?)\]", path.read_text(), re.S).group(1).replace("\n", " ").split(",")]

    k, lens = numbers("CameraMatrix"), numbers("DistortionCoeffs")
    value = 14695981039346656037
    for byte in struct.pack("<ii5dB14d", *size, k[0], k[4], k[2], k[5], k[1], 1, *lens, *[0.0] * (14 - len(lens))):
        value = (value ^ byte) * 1099511628211 % 2**64
    return value


class Mad:
    """Whoever has a camera's key and means no good: docs/wire.md's packets, and others. A process of its own, as its ZeroMQ may
    end it: its heartbeats are what libzmq 4.3.4 has faults in."""

    def __init__(self, folder: pathlib.Path, port: int, seed: int):
        rig = (folder / "rig.yaml").read_text()
        self.size = [int(v) for v in re.search(r"image_size_px: \[(\d+), (\d+)\]", rig).groups()]
        self.calibration = calibration_hash(folder / "cameras" / f"{MAD}.yaml", self.size)
        self.dealer = Dealer(folder / "keys" / f"{MAD}.key", f"tcp://127.0.0.1:{port}", heartbeat_ms=500)
        self.rng = random.Random(seed)
        self.sequence, self.boot = 0, self.rng.getrandbits(64)

    def mask(self) -> bytes:
        width, height = self.size
        data = bytes((width + 31) // 32 * 4 * height)
        return struct.pack("<IIBI", width, height, 0, len(data)) + data

    def packet(self, captured: float, trigger=-1, payload=b"", calibration=None, sent=None) -> bytes:
        self.sequence += 1
        return struct.pack("<IHHB3xI32sQQQqdd2i4HI12x", 0x50544354, 1, 128, 1, len(payload), MAD.encode(),
                           self.calibration if calibration is None else calibration, self.boot, self.sequence, trigger, captured,
                           captured if sent is None else sent, *self.size, 0, 0, 0, 0, 0) + payload

    def kinds(self) -> dict:
        rng, now, mask = self.rng, time.monotonic(), self.mask()
        far = (-1e300, 1e300, 1.7e308, -1.7e308, float("nan"), float("inf"), 1e10, -1e10)

        def bits():
            good = bytearray(self.packet(now, payload=mask))
            for _ in range(50):
                good[rng.randrange(200)] ^= 1 << rng.randrange(8)
                yield bytes(good)

        def steady(early_s):
            for _ in range(40):
                time.sleep(1 / FPS)
                t = time.monotonic()
                yield self.packet(t - early_s, payload=mask, sent=t)

        return {
            "noise": lambda: (rng.randbytes(rng.randrange(0, 4000)) for _ in range(50)),
            "forty good packets, then far times": lambda: (p for g in (steady(0), (self.packet(t, payload=mask) for t in far)) for p in g),
            "captures of half a period ago": lambda: steady(0.5 / FPS),
            "clock jumps": lambda: (self.packet(now + rng.uniform(-1e6, 1e6), k, mask) for k in range(60)),
            "small clock jumps": lambda: (self.packet(now + rng.uniform(-1, 1), -1, mask, sent=now) for _ in range(60)),
            "twice": lambda: [self.packet(now, payload=mask)] * 20,
            "flood": lambda: (self.packet(now) for _ in range(2000)),
            "flood of good packets": lambda: (self.packet(time.monotonic(), payload=mask) for _ in range(500)),
            "other calibrations": lambda: (self.packet(now, calibration=rng.getrandbits(64)) for _ in range(60)),
            "new boots": lambda: (setattr(self, "boot", rng.getrandbits(64)) or self.packet(now, payload=mask) for _ in range(60)),
            "bits": bits,
            "hellos": lambda: (struct.pack("<IIIIQ32s", 0x4D544354, 1, 1, 0, rng.getrandbits(64), MAD.encode()) for _ in range(1000)),
            "a message of 3 MB": lambda: [bytes(3_000_000)],
        }

    def do_something(self) -> str:
        kinds = self.kinds()
        what = self.rng.choice(list(kinds))
        for data in kinds[what]():
            self.dealer.send(data)
            while self.rng.random() < 0.9 and self.dealer.receive() is not None:
                continue
        return what


def main():
    if sys.argv[1] == "witness":
        Witness.work()
    Dealer.zeromq(sys.argv[2])
    mad = Mad(pathlib.Path(sys.argv[3]), int(sys.argv[4]), int(sys.argv[5]))
    for _ in sys.stdin:
        print(mad.do_something(), flush=True)


if __name__ == "__main__":
    main()
