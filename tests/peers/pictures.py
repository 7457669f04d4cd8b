"""Whether the pictures of a page can be drawn by themselves, and are not blank: each SVG file becomes a PNG by the one
line that the documents give, and its pixels are counted.

    pictures.py CHROMIUM

In: a line with the path of an SVG file for each. Out: for each one line of JSON: the width and height that the file
states and those of the PNG, its ground (the colour of its first pixel), how many colours it has, and which share of its
pixels is not of the ground.
"""

import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import zlib
from collections import Counter
from pathlib import Path

PATIENCE_S = 100
SIGNATURE = b"\x89PNG\r\n\x1a\n"
# Bytes of a pixel, by the colour type of PNG (RFC 2083): true colour without and with transparency.
DEPTHS = {2: 3, 6: 4}


def drawn(program, path, folder):
    """The PNG file that Chromium makes of an SVG file."""
    text = path.read_text(encoding="utf-8")
    width, height = (int(re.search(rf'<svg [^>]*\b{it}="(\d+)"', text)[1]) for it in ("width", "height"))
    png = folder / "plot.png"
    words = [program, "--headless", f"--screenshot={png}", f"--window-size={width},{height}", "--hide-scrollbars"]
    # As root it needs this.
    words += ["--no-sandbox"] if os.geteuid() == 0 else []
    words += [f"--user-data-dir={folder / 'profile'}", str(path)]
    subprocess.run(words, check=True, timeout=PATIENCE_S, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return (width, height), png.read_bytes()


def predicted(left, up, corner):
    """The Paeth predictor."""
    at = left + up - corner
    off = (abs(at - left), abs(at - up), abs(at - corner))
    return left if off[0] <= off[1] and off[0] <= off[2] else up if off[1] <= off[2] else corner


def rows(data, width, depth):
    """The rows of a PNG without interlacing, by its five filters."""
    stride = width * depth
    before = bytearray(stride)
    for at in range(0, len(data), stride + 1):
        kind, row = data[at], bytearray(data[at + 1 : at + 1 + stride])
        if kind == 2:
            row = bytearray((it + up) & 0xFF for it, up in zip(row, before))
        elif kind:
            for place in range(stride):
                left = row[place - depth] if place >= depth else 0
                corner = before[place - depth] if place >= depth else 0
                up = before[place]
                add = left if kind == 1 else (left + up) // 2 if kind == 3 else predicted(left, up, corner)
                row[place] = (row[place] + add) & 0xFF
        yield row
        before = row


def pixels(png):
    """Width, height, and how often each colour is there."""
    if png[:8] != SIGNATURE:
        raise ValueError("this is no PNG")
    at, data = 8, b""
    while at < len(png):
        (length,), kind = struct.unpack(">I", png[at : at + 4]), png[at + 4 : at + 8]
        chunk = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, _, colours = struct.unpack(">IIBB", chunk[:10])
        data += chunk if kind == b"IDAT" else b""
        at += length + 12
    depth = DEPTHS[colours]
    count = Counter()
    first = None
    for row in rows(zlib.decompress(data), width, depth):
        each = [bytes(row[it : it + 3]) for it in range(0, len(row), depth)]
        first = first or each[0]
        count.update(each)
    return width, height, first, count


def main():
    for line in sys.stdin:
        with tempfile.TemporaryDirectory(prefix="picture-") as folder:
            stated, png = drawn(sys.argv[1], Path(line.strip()), Path(folder))
        width, height, first, count = pixels(png)
        report = {
            "stated": stated,
            "drawn": (width, height),
            "ground": first.hex(),
            "colours": len(count),
            "inked": 1 - count[first] / (width * height),
        }
        print(json.dumps(report), flush=True)


main()
