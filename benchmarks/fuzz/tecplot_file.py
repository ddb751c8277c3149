"""Binary files of Tecplot by hand, after the appendix of its Data Format Guide."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

KINDS = {
    "ordered": (0, 0), "lines": (1, 2), "triangles": (2, 3), "quads": (3, 4), "tetrahedra": (4, 4),
    "bricks": (5, 8), "polygons": (6, 0),
}  # fmt: skip
"""Number of a kind of zone, and the nodes of its elements."""

_FORMATS = {"f4": 1, "f8": 2, "i4": 3, "i2": 4, "u1": 5}


@dataclass
class ZoneOfFile:
    """A zone to be written.

    A column is an array as it is stored, ``("shared", zone)`` or ``"passive"``. ``cells`` counts
    nodes from 0, or is the number of the zone that they are shared with.
    """

    columns: Sequence[Any]
    shape: tuple[int, ...]
    kind: str = "ordered"
    cells: Any = None
    centred: Sequence[bool] = ()
    name: str = "chip"
    strand: int = -1
    time: float = 0.0
    raw_neighbours: int = 0
    neighbours: Sequence[int] = ()
    remarks: dict[str, str] = field(default_factory=dict)


def write_tecplot(path, names, zones, *, version=112, order="<", extras=b"", file_type=0):
    """Write zones; extras are whole records of the header beside the zones."""
    words = _Words(order)
    words.raw(f"#!TDV{version}".encode())
    words.put("i", 1)
    if version >= 111:
        words.put("i", file_type)
    words.text("chip")
    words.put("i", len(names))
    for name in names:
        words.text(name)
    for zone in zones:
        _header(words, zone, version)
    words.raw(extras)
    words.put("f", 357.0)
    for zone in zones:
        _data(words, zone)
    path.write_bytes(bytes(words.content))
    return path


def extras_of_header(order="<"):
    """A line, a circle, a text, labels, a record and remarks: nothing of zones."""
    words = _Words(order)
    for shape, rest in ((0, ("2i6f", 1, 3, *[0.0] * 6)), (3, ("d", 1.0))):
        words.put("f", 399.0)
        words.put("3i3d6i2d3i2d", 0, 0, 0, 0.0, 0.0, 0.0, 0, 0, 0, 0, shape, 0, 1.0, 1.0, 2, 0, 0,
                  1.0, 30.0)  # fmt: skip
        words.text("")
        words.put("2i", 1 if shape == 0 else 2, 0)
        words.put(*rest)
    words.put("f", 499.0)
    words.put("2i3d2idi2d2i2d3i", 0, 0, 0.0, 0.0, 0.0, 0, 0, 1.0, 0, 1.0, 1.0, 0, 0, 0.0, 1.0, 0, 0,
              0)  # fmt: skip
    words.text("")
    words.put("i", 0)
    words.text("a text")
    words.put("fi", 599.0, 2)
    words.text("one")
    words.text("two")
    words.put("f", 699.0)
    words.text("a record")
    words.put("f", 799.0)
    words.remark("Made.By", "hand")
    words.put("fi", 899.0, 0)
    words.remark("Unit", "m")
    return bytes(words.content)


class _Words:
    def __init__(self, order):
        self.order, self.content = order, bytearray()

    def raw(self, content):
        self.content += content

    def put(self, kinds, *values):
        self.content += struct.pack(self.order + kinds, *values)

    def integers(self, values):
        for value in values:
            self.put("i", value)

    def flagged(self, known, values):
        """A flag, and values if it is set."""
        self.integers([known, *values] if known else [0])

    def text(self, text):
        self.integers([*text.encode(), 0])

    def remark(self, name, value):
        self.text(name)
        self.put("i", 0)
        self.text(value)

    def array(self, values):
        values = np.asarray(values)
        self.content += values.astype(values.dtype.newbyteorder(self.order)).tobytes()


def _header(words, zone, version):
    kind, _ = KINDS[zone.kind]
    words.put("f", 299.0)
    words.text(zone.name)
    words.put("2idii", -1, zone.strand, zone.time, -1, kind)
    if version < 112:
        words.put("i", 0)  # blocks
    words.flagged(any(zone.centred), zone.centred)
    if version >= 108:
        words.put("i", int(zone.raw_neighbours > 0))
    words.put("i", len(zone.neighbours) // 3)
    if zone.neighbours:
        words.put("i", 0)
        if kind and version >= 108:
            words.put("i", 0)
    words.integers(zone.shape)
    if kind:
        words.put("3i", 0, 0, 0)
    for name, value in zone.remarks.items():
        words.put("i", 1)
        words.remark(name, value)
    words.put("i", 0)


def _data(words, zone):
    words.put("f", 299.0)
    stored = [column for column in zone.columns if isinstance(column, np.ndarray)]
    kinds = (getattr(getattr(column, "dtype", None), "str", "<f4") for column in zone.columns)
    words.integers(_FORMATS[kind[1:]] for kind in kinds)
    passive = [isinstance(column, str) for column in zone.columns]
    words.flagged(any(passive), passive)
    shared = [column[1] if isinstance(column, tuple) else -1 for column in zone.columns]
    words.flagged(max(shared) >= 0, shared)
    words.put("i", zone.cells if isinstance(zone.cells, int) else -1)
    for column in stored:
        words.put("2d", float(column.min()), float(column.max()))
    for column in stored:
        words.array(column)
    if isinstance(zone.cells, int):
        return
    if zone.cells is not None:
        words.array(np.asarray(zone.cells, np.int32))
    words.integers([-1] * zone.raw_neighbours)
    words.integers(zone.neighbours)
