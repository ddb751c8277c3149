"""Files of Exodus II by hand, in NetCDF-3 as finite-element programs write them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import netcdf_file

_TEXT = 33


@dataclass(frozen=True)
class Exodus:
    """What a file holds.

    Parameters
    ----------
    points : ndarray
        Positions, shape (nodes, dimensions).
    blocks : mapping
        Nodes of the elements of each block, from 0.
    shapes : str
        What all elements are: HEX8, QUAD4.
    times : sequence of float
        Times.
    fields : mapping
        Values of the nodes, shape (times, nodes).
    side_sets : mapping
        Numbers of elements and of their sides, from 1.
    """

    points: Any
    blocks: Mapping[str, Any]
    shapes: str
    times: Sequence[float]
    fields: Mapping[str, Any]
    side_sets: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)


def write_exodus(path: Path, exodus: Exodus) -> Path:
    """Write a file."""
    with netcdf_file(path, "w", version=2) as file:
        file.api_version, file.version = np.float32(5.1), np.float32(5.1)
        file.floating_point_word_size, file.file_size = 8, 1
        file.title = "by hand"
        sizes = {
            "len_string": _TEXT, "len_line": 81, "four": 4, "num_dim": exodus.points.shape[1],
            "num_nodes": len(exodus.points), "num_elem": sum(map(len, exodus.blocks.values())),
            "num_el_blk": len(exodus.blocks), "num_nod_var": len(exodus.fields),
        }  # fmt: skip
        file.createDimension("time_step", None)
        for name, size in sizes.items():
            file.createDimension(name, size)
        _put(file, "coor_names", "c", ("num_dim", "len_string"), _texts("xyz"[: sizes["num_dim"]]))
        for axis, values in zip("xyz", exodus.points.T, strict=False):
            _put(file, f"coord{axis}", "d", ("num_nodes",), values)
        _blocks(file, exodus)
        if exodus.side_sets:
            _side_sets(file, exodus)
        _put(file, "time_whole", "d", ("time_step",), np.asarray(exodus.times))
        _put(file, "name_nod_var", "c", ("num_nod_var", "len_string"), _texts(exodus.fields))
        for number, values in enumerate(exodus.fields.values(), 1):
            _put(file, f"vals_nod_var{number}", "d", ("time_step", "num_nodes"), values)
    return path


def _blocks(file: Any, exodus: Exodus) -> None:
    numbers = np.arange(1, len(exodus.blocks) + 1, dtype=np.int32)
    _put(file, "eb_status", "i", ("num_el_blk",), np.ones_like(numbers))
    _put(file, "eb_prop1", "i", ("num_el_blk",), numbers).name = "ID"
    _put(file, "eb_names", "c", ("num_el_blk", "len_string"), _texts(exodus.blocks))
    for number, elements in enumerate(exodus.blocks.values(), 1):
        sizes = f"num_el_in_blk{number}", f"num_nod_per_el{number}"
        for name, size in zip(sizes, np.shape(elements), strict=True):
            file.createDimension(name, size)
        table = _put(file, f"connect{number}", "i", sizes, np.asarray(elements) + 1)
        table.elem_type = exodus.shapes


def _side_sets(file: Any, exodus: Exodus) -> None:
    numbers = np.arange(1, len(exodus.side_sets) + 1, dtype=np.int32)
    file.createDimension("num_side_sets", len(numbers))
    _put(file, "ss_status", "i", ("num_side_sets",), np.ones_like(numbers))
    _put(file, "ss_prop1", "i", ("num_side_sets",), numbers).name = "ID"
    _put(file, "ss_names", "c", ("num_side_sets", "len_string"), _texts(exodus.side_sets))
    for number, (elements, sides) in enumerate(exodus.side_sets.values(), 1):
        file.createDimension(f"num_side_ss{number}", len(elements))
        _put(file, f"elem_ss{number}", "i", (f"num_side_ss{number}",), elements)
        _put(file, f"side_ss{number}", "i", (f"num_side_ss{number}",), sides)


def _texts(texts: Any) -> Any:
    padded = [text.ljust(_TEXT, "\0").encode() for text in texts]
    return np.frombuffer(b"".join(padded), "S1").reshape(-1, _TEXT)


def _put(file: Any, name: str, kind: str, dimensions: tuple[str, ...], values: Any) -> Any:
    variable = file.createVariable(name, kind, dimensions)
    variable[:] = values
    return variable
