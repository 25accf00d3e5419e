#!/usr/bin/python3
"""Random faults around a live rig of eight cameras, from a seed.

chaos   Six cameras are left alone. Another one's client is killed, stopped, started twice, and its cable cut; with the key of the
        last, good packets, bad packets, packets twice and times that jump are sent. Strangers connect and talk nonsense.
pauses  Everybody is killed (and started again, as a service manager would) or stopped for up to ten seconds: clients, the server
        and the process of its sockets.
both    One after the other.

Needs Linux, Python 3.9 and a program `tactus` that was built with live cameras; ZeroMQ is the program's own. Takes 300 MB of the
folder for a recording. Prints a line per fault to stderr. Then one JSON object says what was measured, and of each limit whether
it holds. Exits 1 when one does not, 77 when the program has no live cameras or the machine was too busy to tell.

--quick takes less than 30 s. On a machine that other programs keep busy, --realtime puts everything that is measured before them
(SCHED_RR; root, or whoever may).
"""
import argparse
import contextlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

import live_chaos_parts
from live_chaos_parts import FPS, MAD, VICTIM, Cable, Dealer, Witness

CAMERAS = 8
SKIP = 77


def two_free_ports() -> int:
    """The first of two neighbours that nobody listens on: of the server, and of the cable to it."""
    for port in random.sample(range(20000, 32000), 100):
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)), socket.create_server(("127.0.0.1", port + 1)):
            return port
    raise RuntimeError("no free port")


PORT = two_free_ports()

# What is demanded, and what a fault excuses.
#
# The machine. A witness does what the packet of a camera needs of the system, and nothing else: it wakes at the tick, and five
# processes or threads wake one another (the client, its ZeroMQ thread, that of the sockets' process, that process, the server). A
# tick at which this took longer than the deadline is the machine's: it excuses one image of each camera. When more than 5 % of the
# ticks are so, nothing can be told.
MOST_LATE = 0.05
# chaos: no fault is of an honest camera, so none excuses it. The counters are read twice, each time up to a tick off: two images.
HONEST_SHARE, READINGS = 0.99, 2
# A server's memory is steady after a minute: all buffers have been as large as they get.
MOST_GROWN_MB, STEADY_S = 5, 60
# pauses: a fault excuses what misses while it lasts, and two seconds after its end: sockets that say nothing are noticed after 1 s,
# started again after 0.25 s at the latest, and clients connect again within 0.5 s. From then on there are 30 sets a second, and
# every camera is in 30. They are counted over a second or little more between two answers. Each counter is up to a tick off, and an
# answer takes up to 0.05 s (1.5 ticks): 30 - 1 - 1.5 is more than 27.
RATE_1_S, RECOVERY_S, SAMPLE_S = 27, 2, 0.05


def tell(text: str):
    print(text, file=sys.stderr, flush=True)


class Other:
    """The process of Mad, for the one who asks it."""

    def __init__(self, rig):
        self.rig, self.process = rig, None

    def do_something(self) -> str:
        if self.process is None or self.process.poll() is not None:
            self.process = subprocess.Popen([sys.executable, live_chaos_parts.__file__, "mad", self.rig.tactus, self.rig.folder, str(PORT),
                                             str(self.rig.rng.getrandbits(32))], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        with contextlib.suppress(BrokenPipeError):
            print("go", file=self.process.stdin, flush=True)
        return "the mad camera: " + (self.process.stdout.readline().strip() or "its ZeroMQ ended it")


class Rig:
    """Server and clients as processes, and what the server says of itself."""

    def __init__(self, tactus: str, folder: pathlib.Path, deadline_s: float, rng: random.Random, longest_s: float):
        self.tactus, self.folder, self.rig, self.rng = tactus, folder, folder / "rig.yaml", rng
        self.longest_s = longest_s  # that a fault lasts
        subprocess.run([tactus, "synth", "hand", "--moving", "--frames", "30", "--cameras", str(CAMERAS), "--depth-cameras", "0",
                        "--no-colors", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        self.rig.write_text(self.rig.read_text() + f"live: {{address: 'tcp://127.0.0.1:{PORT}', deadline_s: {deadline_s}}}\n")
        subprocess.run([tactus, "keys", self.rig], check=True, stdout=subprocess.DEVNULL)
        self.log = (folder / "log").open("w")
        self.server = None
        self.start_server()
        self.cable = Cable(PORT + 1, PORT)
        self.clients: dict[str, subprocess.Popen] = {}
        for c in range(CAMERAS):
            self.start(f"cam{c}")
        self.asks = Dealer(folder / "keys" / "status.key", f"tcp://127.0.0.1:{PORT}")

    def wait_for_all(self):
        for _ in range(60):
            status = self.status()
            if status and all(c["present"] for c in status["cameras"]):
                return
            time.sleep(0.5)
        raise RuntimeError("the cameras never came")

    def start_server(self):
        recording = self.folder / "chaos.rec"
        recording.unlink(missing_ok=True)
        self.server = subprocess.Popen([self.tactus, "serve", self.rig, "--record", recording], stdout=subprocess.DEVNULL, stderr=self.log)

    def start(self, name: str) -> subprocess.Popen:
        port = PORT + 1 if name == VICTIM else PORT
        self.clients[name] = subprocess.Popen([self.tactus, "client", name, self.rig, "--server", f"tcp://127.0.0.1:{port}"],
                                              stdout=subprocess.DEVNULL, stderr=self.log)
        return self.clients[name]

    def end_client(self, name: str, kill: bool):
        self.clients[name].send_signal(signal.SIGKILL if kill else signal.SIGTERM)
        self.clients[name].wait()
        self.start(name)

    def sockets(self):
        """The process that holds the server's sockets."""
        with contextlib.suppress(OSError):
            for task in pathlib.Path(f"/proc/{self.server.pid}/task").iterdir():
                for pid in (task / "children").read_text().split():
                    return int(pid)
        return None

    def status(self, wait_s=1.0):
        while self.asks.receive() is not None:
            continue
        until = time.monotonic() + wait_s
        while time.monotonic() < until:
            self.asks.send(struct.pack("<IIIIQ32s", 0x4D544354, 1, 2, 0, 0, b""))
            if answer := self.asks.receive(0.2):
                return json.loads(answer)
        return None

    def resident_mb(self) -> float:
        pids = [pid for pid in (self.server.pid, self.sockets()) if pid]
        return sum(int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1]) for pid in pids) * os.sysconf("SC_PAGESIZE") / 1e6

    def end(self):
        for process in [*self.clients.values(), self.server]:
            with contextlib.suppress(OSError):
                process.send_signal(signal.SIGCONT)
                process.terminate()
        for process in [*self.clients.values(), self.server]:
            process.wait(20)
        self.log.close()


class Report:
    def __init__(self):
        self.measured, self.limits = {}, []

    def limit(self, what: str, value, limit, holds: bool, timed=False):
        """timed: a busy machine may miss it."""
        self.limits.append({"what": what, "value": value, "limit": limit, "ok": bool(holds), "timed": timed})


def pause(pid: int, seconds: float):
    with contextlib.suppress(OSError):
        os.kill(pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(pid, signal.SIGCONT)


def chaos_faults(rig: Rig) -> list:
    rng, other = rig.rng, Other(rig)

    def strangers():
        connections = []
        for _ in range(rng.choice([1, 50])):
            with contextlib.suppress(OSError):
                connections.append(socket.create_connection(("127.0.0.1", PORT), timeout=1))
                connections[-1].sendall(rng.randbytes(500))
        for s in connections:
            s.close()
        return "strangers talk nonsense"

    def silent_cable():
        rig.cable.is_silent = True
        time.sleep(rng.uniform(0.1, 0.5 * rig.longest_s))
        rig.cable.is_silent = False
        return "the victim's cable was silent"

    def second_client():
        first, second = rig.clients[VICTIM], rig.start(VICTIM)
        time.sleep(rng.uniform(0.1, 0.3) * rig.longest_s)
        second.kill()
        second.wait()
        rig.clients[VICTIM] = first
        return "the victim had a second client"

    return [lambda: rig.end_client(VICTIM, True) or "the victim was killed", lambda: rig.end_client(VICTIM, False) or "the victim was ended",
            lambda: pause(rig.clients[VICTIM].pid, rng.uniform(0.1, rig.longest_s)) or "the victim was stopped",
            lambda: rig.cable.cut() or "the victim's cable was cut", silent_cable, second_client, strangers, *[other.do_something] * 6]


def chaos(rig: Rig, witness: Witness, seconds: float, deadline_s: float, report: Report):
    rig.clients.pop(MAD).terminate()
    faults = chaos_faults(rig)
    before, begin, minute_mb, count = rig.status(), time.monotonic(), 0.0, 0
    while time.monotonic() - begin < seconds and rig.server.poll() is None:
        if minute_mb == 0 and time.monotonic() - begin > STEADY_S:
            minute_mb = rig.resident_mb()
        told = rig.rng.choice(faults)()
        count += 1
        tell(f"{time.monotonic() - begin:7.1f} s  {told}")
        time.sleep(rig.rng.uniform(0.1, 1.5))
    after, end = rig.status(5), time.monotonic()
    report.limit("chaos: the server goes on", rig.server.poll(), None, rig.server.poll() is None and after is not None)
    if after is None:
        return
    ticks, late = (end - begin) * FPS, witness.late(begin, end, deadline_s)
    honest = [(a, b) for a, b in zip(after["cameras"], before["cameras"]) if a["name"] not in (VICTIM, MAD)]
    shares = [min(1.0, (a["in_sets"] - b["in_sets"] + late + READINGS) / ticks) for a, b in honest]
    raw = [(a["in_sets"] - b["in_sets"]) / ticks for a, b in honest]
    report.limit("chaos: share of the ticks with an honest camera, the worst", round(min(shares), 5), f">= {HONEST_SHARE}",
                 min(shares) >= HONEST_SHARE, timed=True)
    if minute_mb:
        grown = rig.resident_mb() - minute_mb
        report.limit("chaos: MB of server and sockets after the first minute", round(grown, 2), f"< {MOST_GROWN_MB}", grown < MOST_GROWN_MB)
    refused = {a["name"]: a["refused"] for a in after["cameras"]}
    report.measured["chaos"] = {
        "seconds": round(end - begin, 1), "faults": count, "sets": after["sets"] - before["sets"], "ticks_excused": late,
        "shares_without_excuses": [round(s, 5) for s in raw], "socket_restarts": after["socket_restarts"], "release_ms": after["release_ms"],
        **{key: [a[key] - b[key] for a, b in honest] for key in ("lost", "replaced", "copies")}, "refused": refused}


def make_pause(rig: Rig, whom: str, seconds: float) -> str:
    """Who is away for so long; 0: killed, and started again."""
    name, sockets = f"cam{rig.rng.randrange(CAMERAS)}", rig.sockets()
    if whom == "client" and seconds == 0:
        rig.end_client(name, rig.rng.random() < 0.5)
    elif whom == "sockets" and sockets and seconds == 0:
        os.kill(sockets, rig.rng.choice([signal.SIGKILL, signal.SIGABRT, signal.SIGSEGV]))
    elif whom == "server" and seconds == 0:
        rig.server.kill()
        rig.server.wait()
        rig.start_server()
    else:
        pause({"client": rig.clients[name].pid, "sockets": sockets or 0, "server": rig.server.pid}[whom] or rig.server.pid, seconds)
    what = "killed" if seconds == 0 else f"stopped for {seconds:.1f} s"
    return f"{name if whom == 'client' else 'the ' + whom}: {what}"


def recovery_s(rig: Rig, witness: Witness, deadline_s: float):
    """From now until a second in which sets and every camera come as they should; None: not in ten seconds."""
    begin, samples = time.monotonic(), []
    while time.monotonic() < begin + 10:
        status, at = rig.status(0.3), time.monotonic()
        if status is None:
            continue
        samples.append((at, [status["sets"], *[c["in_sets"] for c in status["cameras"]]]))
        for t, counts in samples:
            if at - t < 1:
                break
            least = min(b - a for a, b in zip(counts, samples[-1][1]))
            if (least + witness.late(t, at, deadline_s)) / (at - t) >= RATE_1_S:
                return t - begin
        while len(samples) > 1 and at - samples[1][0] >= 1:
            samples.pop(0)
        time.sleep(SAMPLE_S)
    return None


def pauses(rig: Rig, witness: Witness, faults: int, deadline_s: float, report: Report):
    kinds = [(whom, pause) for whom in ("client", "sockets", "server") for pause in (0, 0, 0.2, 1, 3, 10) if pause <= rig.longest_s]
    order = []
    while len(order) < faults:  # every kind as often as the others
        order += rig.rng.sample(kinds, len(kinds))
    recoveries, slow = [], []
    for count, (whom, seconds) in enumerate(order[:faults]):
        told = make_pause(rig, whom, seconds * rig.rng.uniform(0.3, 1))
        took = recovery_s(rig, witness, deadline_s)
        recoveries.append(10.0 if took is None else took)
        tell(f"{count + 1:4d}  {told}: {f'well again after {took:.2f} s' if took is not None else 'not well in 10 s'}")
        if recoveries[-1] > RECOVERY_S:
            slow.append(f"{told}: {recoveries[-1]:.2f} s")
        if rig.server.poll() is not None:
            break
        time.sleep(rig.rng.uniform(0, 0.5))
    status = rig.status(5)
    report.limit("pauses: the server goes on", rig.server.poll(), None, rig.server.poll() is None and status is not None)
    report.limit("pauses: faults", len(recoveries), f">= {faults}", len(recoveries) >= faults)
    report.limit(f"pauses: s until {RATE_1_S} sets a second with every camera, the worst", round(max(recoveries), 2), f"<= {RECOVERY_S}",
                 not slow, timed=True)
    recoveries.sort()
    report.measured["pauses"] = {"faults": len(recoveries), "socket_restarts": status["socket_restarts"] if status else None, "recovery_s_p50": round(recoveries[len(recoveries) // 2], 2),
                                 "recovery_s_worst": round(recoveries[-1], 2), "slow": slow}


def parsed():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["chaos", "pauses", "both"])
    parser.add_argument("tactus")
    parser.add_argument("--quick", action="store_true", help="8 s of chaos and 5 pauses, all in less than 30 s")
    parser.add_argument("--seconds", type=float, default=600, help="of chaos")
    parser.add_argument("--faults", type=int, default=200, help="of pauses")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--deadline", type=float, default=0.033, help="live.deadline_s of the rig")
    parser.add_argument("--realtime", action="store_true", help="before other programs, where the system allows it")
    parser.add_argument("--folder", help="is kept")
    return parser.parse_args()


def set_realtime(wanted: bool) -> bool:
    with contextlib.suppress(OSError):
        if wanted:
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))  # children inherit it
            return True
    return False


def main() -> int:
    a = parsed()
    if Dealer.zeromq(a.tactus) is None:
        tell(f"skipped: '{a.tactus}' is not linked to ZeroMQ, so it was built without live cameras")
        return SKIP
    realtime = set_realtime(a.realtime)
    folder = pathlib.Path(a.folder or tempfile.mkdtemp(prefix="tactus-chaos-"))
    report, witness = Report(), Witness()
    rig = Rig(a.tactus, folder, a.deadline, random.Random(a.seed), 1 if a.quick else 10)
    try:
        rig.wait_for_all()
        witness.seen.clear()  # of the start
        if a.what != "chaos":
            pauses(rig, witness, 5 if a.quick else a.faults, a.deadline, report)
        if a.what != "pauses" and rig.server.poll() is None:
            chaos(rig, witness, 8 if a.quick else a.seconds, a.deadline, report)
    finally:
        rig.end()
        witness.process.terminate()
    report.limit("the server ends as it is told", rig.server.returncode, "0 or 130", rig.server.returncode in (0, 130))
    seen, ok = witness.summary(a.deadline), all(limit["ok"] for limit in report.limits)
    busy = seen["late"] > MOST_LATE * seen["ticks"]
    told = {"what": a.what, "seed": a.seed, "deadline_s": a.deadline, "cores": os.cpu_count(), "load": [round(v, 1) for v in os.getloadavg()],
            "realtime": realtime, "machine": seen, "too_busy": busy, **report.measured, "limits": report.limits, "ok": ok}
    print("{" + ",\n ".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in told.items()) + "}")
    if not a.folder:
        shutil.rmtree(folder)
    if busy and not ok and all(limit["ok"] or limit["timed"] for limit in report.limits):
        tell("skipped: other programs kept the machine busy, so nothing can be told; --realtime may help")
        return SKIP
    return 0 if ok else 1


if __name__ == "__main__":
    sys.exit(main())
