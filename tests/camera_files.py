"""Files of cameras, byte by byte as their formats are described, of pictures that are known."""

import struct
from functools import partial
from io import BytesIO

import numpy as np
from PIL import Image

ROWS, COLUMNS, FRAMES = 48, 64, 5

PLANCK = {"r1": 16125.79, "b": 1420.1, "f": 1.0, "o": -5588, "r2": 0.0109034}
OBJECT = {"emissivity": 0.95, "reflected": 295.15, "atmosphere": 292.15, "window": 0.9}
START = 1_700_000_000
STAMPS = 0.033 * np.arange(FRAMES)

CALIBRATION = """\
model: linear
band: 3.8-5.1 um
lowest: 50 degC
highest: 1500 degC
parameters: {offset: 500.0, gain: 10.0}
covariance: [[25.0, 0.0], [0.0, 1.0e-4]]
"""
"""A linear calibration of counts in YAML."""


def pictures(frames=FRAMES, bits=14):
    """Smooth pictures with noise in which each pixel and frame differs."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    base = 0.3 + 0.4 * np.exp(-((x - 30.0) ** 2 + (y - 20.0) ** 2) / 300)
    noise = np.random.default_rng(7).normal(0, 0.002, (frames, ROWS, COLUMNS))
    level = base + noise + 0.01 * np.arange(frames)[:, None, None]
    return np.round(level * (2**bits - 1)).astype(np.uint16)


def writer(raw, order="<"):
    """Function that puts values of a kind at a place."""
    return lambda place, kind, *values: struct.pack_into(order + kind, raw, place, *values)


# FLIR


def png(image, swapped=True):
    stream = BytesIO()
    Image.fromarray(image.byteswap() if swapped else image).save(stream, "PNG")
    return stream.getvalue()


def plain(image):
    return image.astype("<u2").tobytes()


def flir_camera(order, stamp, planck=PLANCK, told=OBJECT, rate=30, counts=(7481, 59029)):
    raw = bytearray(2476)
    put = writer(raw, order)
    put(0, "HHH", 2, COLUMNS, ROWS)
    put(0x20, "fffff", told["emissivity"], 2.0, told["reflected"], told["atmosphere"], 293.15)
    put(0x34, "f", told["window"])
    put(0x3C, "f", 0.5)
    put(0x58, "fff", planck["r1"], planck["b"], planck["f"])
    put(0x70, "fffff", 0.006569, 0.01262, -0.002276, -0.00667, 1.9)
    put(0x90, "ff", 393.15, 253.15)
    raw[0xD4:0xE8] = b"FLIR T420".ljust(20, b"\0")
    raw[0x104:0x10C] = b"62109905"
    put(0x308, "if", planck["o"], planck["r2"])
    put(0x310, "HH", *counts)
    seconds, rest = divmod(stamp, 1)
    put(0x384, "IIh", START + int(seconds), round(1000 * rest), -60)
    put(0x464, "H", rate)
    return bytes(raw)


def fff(image, stamp=0.0, pack=plain, order="<", sort=2, camera_first=False, **camera):
    """One frame: header, list of two records, counts and what the camera says, in either order."""
    counts = struct.pack("<HHH", 2, image.shape[1], image.shape[0]).ljust(32, b"\0") + pack(image)
    said = flir_camera(order, stamp, **camera)
    start = 64 + 2 * 32
    header = b"FFF\0" + b"FLIR".ljust(16, b"\0") + struct.pack(order + "III", 100, 64, 2)
    places = (start + len(said), start) if camera_first else (start, start + len(counts))
    entries = [(1, sort, places[0], len(counts)), (32, 1, places[1], len(said))]
    table = b"".join(
        struct.pack(order + "HHIIIIIII", kind, how, 100, 1, place, length, 0, 0, 0)
        for kind, how, place, length in entries
    )
    return header.ljust(64, b"\0") + table + (said + counts if camera_first else counts + said)


def seq(images, stamps=STAMPS, **options):
    frames = zip(images, stamps, strict=True)
    return b"".join(fff(image, stamp, **options) for image, stamp in frames)


def flir_jpeg(image, part=1000, behind=b"", exif=b"", **options):
    """A JPEG with FLIR's records in several segments, with bytes behind the last record."""
    stream = BytesIO()
    Image.new("L", (8, 8), 99).save(stream, "JPEG", exif=exif)
    visible, inside = stream.getvalue(), fff(image, **options) + behind
    parts = [inside[i : i + part] for i in range(0, len(inside), part)]
    segments = b"".join(
        struct.pack(">HH6sBB", 0xFFE1, len(one) + 10, b"FLIR\0\x01", number, len(parts) - 1) + one
        for number, one in enumerate(parts)
    )
    return visible[:2] + segments + visible[2:]


# PTW


def ptw(images, period=1 / 600, stamps=None, lock_in=False, words=False):
    """A recording as Altair 5.60 writes it, with sizes in words of 16 bits, or in bytes."""
    count, rows, columns = images.shape
    extra = 2 * columns if lock_in else 0
    frame = 1016 + extra + 2 * rows * columns
    header = bytearray(3476)
    put = writer(header)
    header[0:10] = b"CED\0\x005.60\0" if words else b"CEDIP05.60"
    size = 2 if words else 1
    put(11, "IIIII", len(header), 1016, frame // size, (frame - 1016) // size, count)
    put(35, "HBBBBBB", 2009, 17, 6, 42, 15, 7, 31)
    header[44:51] = b"JADE MW"
    header[64:70] = b"G1 1:1"
    put(141, "fff", 0.8, 296.15, 0.3)
    put(170, "f", 0.98)
    put(184, "f", 295.15)
    put(188, "ff", 3.8, 5.1)
    header[220:226] = b"J-1234"
    put(377, "HHH", columns, rows, 14)
    put(403, "ff", period, 30e-6)
    header[563:572] = b"AISI 1045"
    frames = []
    for number, image in enumerate(images):
        own = bytearray(1016)
        when = number / 600 if stamps is None else stamps[number]
        milliseconds = round(1000 * when)
        own[80:84] = bytes([59, 23, milliseconds // 10 % 100, 58 + milliseconds // 1000])
        own[160] = milliseconds % 10
        line = np.zeros(columns, "<u2")
        line[:4] = 1220, 3907, 1204, 2382
        frames.append(bytes(own) + (line.tobytes() if lock_in else b"") + plain(image))
    return bytes(header) + b"".join(frames)


# CINE


def _packed(counts, bits):
    """Counts one after another in bits, from the highest on."""
    shifts = np.arange(bits)[::-1]
    return np.packbits((counts.reshape(-1, 1) >> shifts & 1).astype(np.uint8)).tobytes()


def cine(images, kind="16", rate=30_000, exposures=None, times=True, viewer=(0, 0, 0)):
    """A recording; 8 and 16 bits lie upside down, as bitmaps do."""
    count, rows, columns = images.shape
    bits, packing, real, pack = {
        "8": (8, 0, 8, lambda image: image[::-1].astype("u1").tobytes()),
        "16": (16, 0, 12, lambda image: plain(image[::-1])),
        "10p": (16, 256, 10, partial(_packed, bits=10)),
        "12p": (16, 1024, 12, partial(_packed, bits=12)),
    }[kind]
    setup = bytearray(12432)
    put = writer(setup)
    setup[140:142] = b"ST"
    put(142, "H", len(setup))
    put(743, "I", 12345)
    put(756, "II", *viewer[:2])
    put(884, "i", viewer[2])
    put(768, "I", rate)
    put(792, "I", 711)
    put(896, "I", real)
    put(1568, "I", 3000)
    ticks = [(START << 32) + round((0.25 + n / rate) * 2**32) & ~3 | 1 for n in range(count)]
    exposures = [3e-6] * count if exposures is None else exposures
    tagged = struct.pack(f"<IHH{count}Q", 8 + 8 * count, 1002, 1, *ticks) if times else b""
    lengths = [round(one * 2**32) for one in exposures]
    tagged += struct.pack(f"<IHH{count}I", 8 + 4 * count, 1003, 0, *lengths)
    picture = struct.pack("<IiiHHIIiiII", 40, columns, rows, 1, bits, packing, 0, 0, 0, 0, 0)
    places_at = 44 + 40 + len(setup) + len(tagged)
    header = struct.pack(
        "<2sHHHiIiIIII", b"CI", 44, 0, 1, -100, count, -3, count, 44, 84, places_at
    ) + struct.pack("<Q", ticks[1] if count > 1 else ticks[0])
    frames, places, place = [], [], places_at + 8 * count
    for image in images:
        raw = pack(image)
        one = struct.pack("<II", 8, len(raw)) + raw
        places.append(place)
        place += len(one)
        frames.append(one)
    table = struct.pack(f"<{count}q", *places)
    return b"".join([header, picture, setup, tagged, table, *frames])
