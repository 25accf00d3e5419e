#!/usr/bin/env python3
"""Reads the web stream of a run, by docs/web.md alone.

usage: tests/web/read_stream.py HOST:PORT [--token WORD] [--frames N] [--send JSON]
  prints one line of JSON for each message; with --send, sends that text first
"""
import argparse
import base64
import json
import math
import os
import socket
import struct


class Stream:
    """A WebSocket: as little of RFC 6455 as a reader needs."""

    def __init__(self, address: str, token: str | None) -> None:
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=20)
        path = "/stream" + (f"?token={token}" if token else "")
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.read(1)
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise SystemExit(f"refused: {head.splitlines()[0].decode()}")

    def read(self, count: int) -> bytes:
        data = bytearray()
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                raise EOFError
            data += part
        return bytes(data)

    def message(self) -> bytes | str:
        """The next message: bytes, or text."""
        while True:
            first, size = self.read(2)
            if size == 126:
                size, = struct.unpack(">H", self.read(2))
            elif size == 127:
                size, = struct.unpack(">Q", self.read(8))
            data = self.read(size)
            if first & 15 == 8:
                raise EOFError
            if first & 15 == 1:
                return data.decode()
            if first & 15 == 2:
                return data

    def send(self, text: str) -> None:
        data, mask = text.encode(), os.urandom(4)
        size = bytes([0x80 | len(data)]) if len(data) < 126 else b"\xfe" + struct.pack(">H", len(data))
        self.socket.sendall(b"\x81" + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(data)))


def normal(a: int, b: int) -> tuple[float, float, float]:
    x, y = a / 127, b / 127
    z = 1 - abs(x) - abs(y)
    t = max(-z, 0)
    x += -t if x >= 0 else t
    y += -t if y >= 0 else t
    n = math.sqrt(x * x + y * y + z * z) or 1
    return x / n, y / n, z / n


def decode(data: bytes) -> dict:
    magic, version, kind, blocks, number, _, time_s, captured_s = struct.unpack_from("<4s5I2d", data)
    assert magic == b"TCTW" and version == 1, (magic, version)
    message = {"kind": {1: "setting", 2: "frame"}[kind], "frame": number, "time_s": time_s, "captured_s": captured_s, "blocks": []}
    at = 40
    for _ in range(blocks):
        kind, role, size, name_bytes, count, triangles = struct.unpack_from("<6I", data, at)
        flags, x, y, z, step = struct.unpack_from("<I4f", data, at + 28)
        name = data[at + 48:at + 48 + name_bytes].decode()
        begin = at + 48 + (name_bytes + 3) // 4 * 4
        block = {"kind": kind, "role": role, "name": name, "count": count, "triangles": triangles, "rgba": list(data[at + 24:at + 28])}
        if kind == 4:
            block["json"] = json.loads(data[begin:begin + count])
        elif kind <= 3:
            rows = [struct.unpack_from("<3H2b", data, begin + 8 * i) for i in range(count)]
            block["positions_m"] = [(x + step * r[0], y + step * r[1], z + step * r[2]) for r in rows]
            if flags & 2:
                block["normals"] = [normal(r[3], r[4]) for r in rows]
            corners = struct.unpack_from(f"<{3 * triangles}{'I' if flags & 1 else 'H'}", data, begin + 8 * count)
            block["corners"] = [corners[3 * i:3 * i + 3] for i in range(triangles)]
        message["blocks"].append(block)
        at += size
    assert at == len(data), (at, len(data))
    return message


def summary(block: dict) -> dict:
    """What a test compares: bounds, and the volume that a closed surface encloses."""
    told = {key: block[key] for key in ("kind", "role", "name", "count", "triangles", "rgba") if key in block}
    if "json" in block:
        return told | {"json": block["json"]}
    p = block.get("positions_m", [])
    if p:
        told |= {"min_m": [min(c) for c in zip(*p)], "max_m": [max(c) for c in zip(*p)]}
    told["volume_m3"] = sum(p[a][0] * (p[b][1] * p[c][2] - p[b][2] * p[c][1]) + p[a][1] * (p[b][2] * p[c][0] - p[b][0] * p[c][2])
                            + p[a][2] * (p[b][0] * p[c][1] - p[b][1] * p[c][0]) for a, b, c in block.get("corners", [])) / 6
    return told


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("address")
    parser.add_argument("--token")
    parser.add_argument("--frames", type=int, default=1)
    parser.add_argument("--send", action="append", default=[])
    options = parser.parse_args()
    stream = Stream(options.address, options.token)
    for text in options.send:
        stream.send(text)
    frames = 0
    while frames < options.frames:
        try:
            data = stream.message()
        except EOFError:
            break
        if isinstance(data, str):
            print(json.dumps({"text": json.loads(data)}))
            continue
        message = decode(data)
        frames += message["kind"] == "frame"
        print(json.dumps(message | {"blocks": [summary(b) for b in message["blocks"]]}))


if __name__ == "__main__":
    main()
