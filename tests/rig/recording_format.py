#!/usr/bin/env python3
"""A reader and a writer of recordings in Python, from docs/recording.md alone: the page is enough, and true.

usage: recording_format.py TACTUS FOLDER   records a scene in FOLDER, reads the file, writes another one without LZ4, and replays it.
Exits 0 when the state is the same to the last bit and frames take the bytes that the page says, else 1.
"""
import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys

SET, END = 2, 5


def fnv1a(data: bytes) -> int:
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 & (1 << 64) - 1
    return value


def lz4_block(data: bytes) -> bytes:
    """Literals, then a copy of what came before; lengths of 15 go on while bytes are 255."""
    out, at = bytearray(), 0

    def length(nibble: int) -> int:
        nonlocal at
        total = nibble
        while nibble == 15:
            byte = data[at]
            at += 1
            total += byte
            if byte != 255:
                break
        return total

    while at < len(data):
        token = data[at]
        at += 1
        literals = length(token >> 4)
        out += data[at:at + literals]
        at += literals
        if at == len(data):
            break
        offset = data[at] | data[at + 1] << 8
        at += 2
        for _ in range(length(token & 15) + 4):
            out.append(out[-offset])
    return bytes(out)


class Reader:
    def __init__(self, data: bytes):
        self.data, self.at = data, 0

    def take(self, form: str):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values[0] if len(values) == 1 else values

    def bytes(self, n: int) -> bytes:
        self.at += n
        assert self.at <= len(self.data)
        return self.data[self.at - n:self.at]


def chunks(data: bytes):
    reader = Reader(data)
    assert reader.bytes(8) == b"TACTUSRC" and reader.take("I") == 1
    while reader.at < len(data):
        head = reader.bytes(24)
        magic, kind, size, of_payload = struct.unpack("<4sIQQ", head)
        assert magic == b"TCHK" and reader.take("Q") == fnv1a(head)
        payload = reader.bytes(size)
        assert of_payload == fnv1a(payload)
        yield kind, payload


def chunk(kind: int, payload: bytes) -> bytes:
    head = struct.pack("<4sIQQ", b"TCHK", kind, len(payload), fnv1a(payload))
    return head + struct.pack("<Q", fnv1a(head)) + payload


def cameras(rig: Reader) -> list:
    found = []
    for _ in range(rig.take("I")):
        name = rig.bytes(rig.take("I")).decode()
        width, height = rig.take("2i")
        rig.take("5d9d3d")
        found.append((name, width, height))
    return found


def without_lz4(payload: bytes, sizes: list) -> bytes:
    """@param sizes of each list's images when they are unpacked, in bytes of a pixel and a row."""
    frame = Reader(payload)
    tick, time, _, volume = frame.take("q3d")
    assert tick >= 0 and math.isfinite(time) and (math.isnan(volume) or volume > 0)
    frame.bytes(frame.take("I"))
    out = bytearray(payload[:frame.at])
    for bytes_of in sizes:
        count = frame.take("I")
        out += struct.pack("<I", count)
        for _ in range(count):
            width, height, coding, stored = frame.take("IIBI")
            image = frame.bytes(stored)
            image = lz4_block(image) if coding == 1 else image
            assert len(image) == bytes_of(width) * height
            out += struct.pack("<IIBI", width, height, 0, len(image)) + image
    assert frame.at == len(payload)
    return bytes(out)


def main() -> int:
    tactus, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    subprocess.run([tactus, "synth", "hand", "--moving", "--frames", "4", "--cameras", "8", "--depth-cameras", "1", "--no-colors", "--out",
                    folder / "film"], check=True, stdout=subprocess.DEVNULL)
    scene = folder / "scene.yaml"
    scene.write_text("source: {kind: masks, path: film/rig.yaml}\nreconstruction: {resolution: 24}\nbodies:\n  - name: block\n"
                     "    shape: {kind: box, size_m: [0.3, 0.3, 0.3]}\n    placement: {position_m: [0, 0.2, 0]}\n    spacing_m: 0.05\n"
                     "    fixed: [{kind: half_space, point_m: [0, -0.14, 0]}]\n")

    def state(*arguments) -> str:
        subprocess.run([tactus, "run", scene, "--view", "none", "--devices", "cpu", "--json", folder / "run.json", *arguments], check=True,
                       stdout=subprocess.DEVNULL)
        return json.loads((folder / "run.json").read_text())["state_hash"]

    first = state("--record", folder / "first.rec")
    kinds, sizes, own = [], [0, 0], bytearray(b"TACTUSRC" + struct.pack("<I", 1))
    optical, depth = [], []
    for kind, payload in chunks((folder / "first.rec").read_bytes()):
        if not kinds:
            rig = Reader(payload)
            assert rig.take("d") == 30 and rig.take("6fi")[6] >= 0
            optical, depth = cameras(rig), cameras(rig)
            assert rig.at == len(payload)
        kinds.append(kind)
        if kind == SET:
            of = [lambda w: (w + 31) // 32 * 4, lambda w: w, lambda w: 3 * w, lambda w: 4 * w]
            # Bytes of the lists of silhouettes and distances: what is stored, and heads.
            lists = Reader(payload)
            lists.take("q3d")
            lists.bytes(lists.take("I"))
            for which in range(4):
                begin = lists.at
                for _ in range(lists.take("I")):
                    lists.bytes(lists.take("IIBI")[3])
                sizes[0] += lists.at - begin if which == 0 else 0
                sizes[1] += lists.at - begin if which == 3 else 0
            payload = without_lz4(payload, of)
        own += chunk(kind, payload)
    (folder / "own.rec").write_bytes(own)
    silhouettes, distances = (size / kinds.count(SET) / 1000 for size in sizes)
    again = state("--source", folder / "own.rec")
    print(f"{[name for name, *_ in optical + depth]}, chunks {kinds}: {silhouettes:.1f} kB of silhouettes a frame, {distances:.1f} of depth")
    print(f"state {first}, replayed without LZ4 {again}")
    ok = first == again and kinds == [1] + [SET] * 4 + [END] and len(optical) == 8 and len(depth) == 1
    # The page says 13 kB and 8 kB, rounded.
    return 0 if ok and 12.5 <= silhouettes < 13.5 and 7.5 <= distances < 8.5 else 1


if __name__ == "__main__":
    sys.exit(main())
