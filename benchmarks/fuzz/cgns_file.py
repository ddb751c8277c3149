"""A CGNS file by hand, after the standard's mapping to HDF5: one zone of quadrilaterals."""

import h5py
import numpy as np

_TYPES = {"float32": "R4", "float64": "R8", "int32": "I4", "int8": "C1"}
_QUAD_4 = 7


def write_cgns(path, points, quads, of_nodes, of_elements, times=()):
    """Write points (n, 3), quadrilaterals (m, 4), and fields of nodes and of elements.

    With times, fields are those of nodes, with a row for each.
    """
    with h5py.File(path, "w", track_order=True) as file:
        _mark(file, "HDF5 MotherNode", "Root Node of HDF5 File")
        file.create_dataset(" format", data=_text("IEEE_LITTLE_32\0"))
        file.create_dataset(" hdf5version", data=_text("HDF5 Version 1.10.0".ljust(33, "\0")))
        _node(file, "CGNSLibraryVersion", "CGNSLibraryVersion_t", np.float32([3.2]))
        base = _node(file, "Base", "CGNSBase_t", np.int32([2, 3]))
        zone = _node(base, "Chip", "Zone_t", np.int32([[len(points)], [len(quads)], [0]]))
        _node(zone, "ZoneType", "ZoneType_t", _text("Unstructured"))
        coordinates = _node(zone, "GridCoordinates", "GridCoordinates_t")
        for axis, values in zip("XYZ", np.transpose(points), strict=True):
            _node(coordinates, f"Coordinate{axis}", "DataArray_t", np.array(values, np.float64))
        elements = _node(zone, "Quads", "Elements_t", np.int32([_QUAD_4, 0]))
        _node(elements, "ElementRange", "IndexRange_t", np.int32([1, len(quads)]))
        connectivity = np.int32(quads).ravel() + np.int32(1)
        _node(elements, "ElementConnectivity", "DataArray_t", connectivity)
        if times:
            _over_time(base, zone, of_nodes, times)
        else:
            _solution(zone, "AtVertex", "Vertex", of_nodes)
            _solution(zone, "AtCellCenter", "CellCenter", of_elements)


def _over_time(base, zone, of_nodes, times):
    """A solution for each time, as Sandia's programs name them."""
    names = [f"VertexSolutionAtStep{step:05}" for step in range(1, len(times) + 1)]
    for number, name in enumerate(names):
        fields = {field: values[number] for field, values in of_nodes.items()}
        _solution(zone, name, "Vertex", fields)
    of_zone = _node(zone, "ZoneIterativeData", "ZoneIterativeData_t")
    pointers = np.stack([_text(name.ljust(32)) for name in names])
    _node(of_zone, "FlowSolutionPointers", "DataArray_t", pointers)
    steps = _node(base, "TimeIterValues", "BaseIterativeData_t", np.int32([len(times)]))
    _node(steps, "TimeValues", "DataArray_t", np.asarray(times, np.float64))


def _solution(zone, name, place, fields):
    solution = _node(zone, name, "FlowSolution_t")
    _node(solution, "GridLocation", "GridLocation_t", _text(place))
    for field, values in fields.items():
        _node(solution, field, "DataArray_t", np.asarray(values, np.float64))


def _text(text):
    return np.frombuffer(text.encode(), np.int8)


def _node(parent, name, label, data=None):
    # Nodes are found in the order in which they were made.
    return _mark(parent.create_group(name, track_order=True), name, label, data)


def _mark(group, name, label, data=None):
    kind = "MT" if data is None else _TYPES[data.dtype.name]
    for key, value, length in (("name", name, 33), ("label", label, 33), ("type", kind, 3)):
        group.attrs.create(key, np.bytes_(value), dtype=h5py.string_dtype("ascii", length))
    group.attrs.create("flags", np.int32([1]))
    if data is not None:
        group.create_dataset(" data", data=data)
    return group
