"""Files of Exodus II by hand, in NetCDF-3 as finite-element programs write them."""

import numpy as np
from scipy.io import netcdf_file

_TEXT = 33


def write_exodus(path, points, blocks, times, fields, side_sets=None):
    """Write blocks of hexahedra, by the numbers of their nodes, and fields (times, nodes).

    A side set is numbers of elements and of their sides, from 1.
    """
    side_sets = side_sets or {}
    with netcdf_file(path, "w", version=2) as file:
        file.api_version, file.version = np.float32(5.1), np.float32(5.1)
        file.floating_point_word_size, file.file_size = 8, 1
        file.title = "by hand"
        sizes = {
            "time_step": None, "len_string": _TEXT, "len_line": 81, "four": 4, "num_dim": 3,
            "num_nodes": len(points), "num_elem": sum(map(len, blocks.values())),
            "num_el_blk": len(blocks), "num_nod_var": len(fields),
        }  # fmt: skip
        if side_sets:
            sizes["num_side_sets"] = len(side_sets)
        for name, size in sizes.items():
            file.createDimension(name, size)
        _put_texts(file, "coor_names", "num_dim", "xyz")
        for axis, values in zip("xyz", points.T, strict=True):
            _put(file, f"coord{axis}", "d", ("num_nodes",), values)
        _put_parts(file, "eb", "num_el_blk", blocks)
        for number, elements in enumerate(blocks.values(), 1):
            shape = {f"num_el_in_blk{number}": len(elements), f"num_nod_per_el{number}": 8}
            for name, size in shape.items():
                file.createDimension(name, size)
            _put(file, f"connect{number}", "i", tuple(shape), elements + 1).elem_type = "HEX8"
        if side_sets:
            _put_parts(file, "ss", "num_side_sets", side_sets)
        for number, (elements, sides) in enumerate(side_sets.values(), 1):
            file.createDimension(f"num_side_ss{number}", len(elements))
            _put(file, f"elem_ss{number}", "i", (f"num_side_ss{number}",), elements)
            _put(file, f"side_ss{number}", "i", (f"num_side_ss{number}",), sides)
        _put(file, "time_whole", "d", ("time_step",), np.asarray(times))
        _put_texts(file, "name_nod_var", "num_nod_var", fields)
        for number, values in enumerate(fields.values(), 1):
            _put(file, f"vals_nod_var{number}", "d", ("time_step", "num_nodes"), values)
    return path


def _put_parts(file, prefix, dimension, names):
    """Status, number and name of blocks or side sets."""
    numbers = np.arange(1, len(names) + 1, dtype=np.int32)
    _put(file, f"{prefix}_status", "i", (dimension,), np.ones_like(numbers))
    _put(file, f"{prefix}_prop1", "i", (dimension,), numbers).name = "ID"
    _put_texts(file, f"{prefix}_names", dimension, names)


def _put_texts(file, name, dimension, texts):
    padded = b"".join(text.ljust(_TEXT, "\0").encode() for text in texts)
    _put(file, name, "c", (dimension, "len_string"), np.frombuffer(padded, "S1").reshape(-1, _TEXT))


def _put(file, name, kind, dimensions, values):
    variable = file.createVariable(name, kind, dimensions)
    variable[:] = values
    return variable
