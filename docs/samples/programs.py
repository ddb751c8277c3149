"""Two frames of a block that is hot on its left side, as files of other programs.

Lengths are in mm and temperatures in °C where the program has no units.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

COLUMNS, ROWS = 51, 41
STEP: Final = 4e-3
"""Displacement of the block to the left from frame to frame, in mm."""
MICROSECOND: Final = 1e-6


def nodes(frame: int) -> NDArray[np.float64]:
    """Positions in mm, shape (node, 2)."""
    x, y = np.meshgrid(np.linspace(1.2, 1.7, COLUMNS), np.linspace(0.3, 0.7, ROWS))
    return np.stack((x.ravel() - STEP * frame, y.ravel()), axis=-1)


def quads() -> NDArray[np.int64]:
    """Nodes of each element, counter-clockwise, shape (element, 4)."""
    number = np.arange(COLUMNS * ROWS).reshape(ROWS, COLUMNS)
    corners = (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    return np.stack(corners, axis=-1).reshape(-1, 4)


def temperature() -> NDArray[np.float64]:
    """At the nodes, in °C."""
    return np.asarray(100 + 500 * np.exp((1.2 - nodes(0)[:, 0]) / 0.1))


def strain() -> NDArray[np.float64]:
    """Plastic strain at the nodes."""
    return np.asarray(5 * (nodes(0)[:, 1] - 0.3))


def abaqus(folder: Path) -> None:
    """Write an input file, and tables of nodes and elements for each frame."""
    lines = ["*HEADING", "a block", "*NODE"]
    lines += [f"{label}, {x:.6g}, {y:.6g}" for label, (x, y) in enumerate(nodes(0), 1)]
    lines.append("*ELEMENT, TYPE=CPE4RT, ELSET=CHIP")
    lines += [
        f"{label}, " + ", ".join(map(str, corners + 1)) for label, corners in enumerate(quads(), 1)
    ]
    (folder / "chip.inp").write_text("\n".join(lines) + "\n", encoding="utf-8")
    of_elements = strain()[quads()].mean(axis=1)
    for frame in (0, 1):
        rows = [
            f"{label},{value:.6g},{-STEP * frame:.6g},0"
            for label, value in enumerate(temperature(), 1)
        ]
        write_lines(folder / f"chip_{frame + 1}_nodes.csv", "node,NT11,U1,U2", rows)
        rows = [f"{label},{value:.6g}" for label, value in enumerate(of_elements, 1)]
        write_lines(folder / f"chip_{frame + 1}_elements.csv", "element,PEEQ", rows)


def write_lines(path: Path, first: str, rows: list[str]) -> None:
    """Write a table."""
    path.write_text("\n".join([first, *rows]) + "\n", encoding="utf-8")


def advantedge(folder: Path) -> None:
    """Write both frames as zones of one Tecplot file in text."""
    lines = ['TITLE = "chip"', 'VARIABLES = "X" "Y" "Temperature" "Plastic Strain"']
    for frame in (0, 1):
        lines.append(
            f'ZONE T="workpiece", ZONETYPE=FEQUADRILATERAL, NODES={COLUMNS * ROWS}, '
            f"ELEMENTS={len(quads())}, DATAPACKING=POINT, SOLUTIONTIME={frame * MICROSECOND:g}"
        )
        values = np.column_stack((nodes(frame), temperature(), strain()))
        lines += [" ".join(f"{value:.6g}" for value in row) for row in values]
        lines += [" ".join(map(str, corners + 1)) for corners in quads()]
    (folder / "chip.dat").write_text("\n".join(lines) + "\n", encoding="utf-8")


def deform(folder: Path) -> None:
    """Write a table of nodes for each frame."""
    for frame in (0, 1):
        speed = -STEP * 1e-3 / MICROSECOND
        rows = [
            f"{x:.6g},{y:.6g},{celsius:.6g},{plastic:.6g},{1e3 * speed:.6g},0"
            for (x, y), celsius, plastic in zip(nodes(frame), temperature(), strain(), strict=True)
        ]
        first = "x,y,temperature,effective_strain,velocity_x,velocity_y"
        write_lines(folder / f"chip_{frame + 1}.csv", first, rows)


def ansys(folder: Path) -> None:
    """Write a file of VTK for each frame, with the names that a script gives."""
    write_vtk(folder, "temperature", "plastic_strain")


def meshes(folder: Path) -> None:
    """Return the same with Abaqus's names."""
    write_vtk(folder, "NT11", "PEEQ")


def write_vtk(folder: Path, of_temperature: str, of_strain: str) -> None:
    """Write a file of VTK for each frame."""
    import pyvista

    cells = np.insert(quads(), 0, 4, axis=1)
    kinds = np.full(len(cells), pyvista.CellType.QUAD)
    for frame in (0, 1):
        points = np.insert(nodes(frame), 2, 0.0, axis=1)
        grid = pyvista.UnstructuredGrid(cells.ravel(), kinds, points)
        grid[of_temperature] = temperature()
        grid[of_strain] = strain()
        grid.save(folder / f"chip_{frame + 1}.vtu")


def ls_dyna(folder: Path) -> None:
    """Write a d3plot with shells in mm, s and K."""
    from lasso.dyna import D3plot

    plot, arrays = D3plot(), {}
    places = [np.insert(nodes(frame), 2, 0.0, axis=1) for frame in (0, 1)]
    arrays["node_coordinates"] = places[0]
    arrays["node_displacement"] = np.stack(places)
    arrays["node_velocity"] = np.tile([-STEP / MICROSECOND, 0.0, 0.0], (2, COLUMNS * ROWS, 1))
    arrays["node_temperature"] = np.tile(temperature() + 273.15, (2, 1))
    arrays["timesteps"] = np.array([0.0, MICROSECOND])
    of_elements = np.repeat(strain()[quads()].mean(axis=1)[:, None], 3, axis=1)
    arrays["element_shell_effective_plastic_strain"] = np.tile(of_elements, (2, 1, 1))
    for name, values in arrays.items():
        plot.arrays[name] = values.astype(np.float32)
    plot.arrays["element_shell_node_indexes"] = quads()
    plot.arrays["element_shell_part_indexes"] = np.zeros(len(quads()), np.int32)
    plot.write_d3plot(str(folder / "d3plot"))


def openfoam(folder: Path) -> None:
    """Write a case of one layer of cells, 0.1 mm deep, with two times; SI."""
    mesh = folder / "constant" / "polyMesh"
    mesh.mkdir(parents=True)
    flat = 1e-3 * nodes(0)
    points = [f"({x:.9g} {y:.9g} {z})" for z in (0, 1e-4) for x, y in flat]
    inner, outer = faces()
    owners = [owner for owner, *_ in inner] + [owner for owner, *_ in outer]
    rows = [f"4({' '.join(map(str, corners))})" for *_, corners in inner + outer]
    write_foam(mesh / "points", "vectorField", listed(points))
    write_foam(mesh / "faces", "faceList", listed(rows))
    write_foam(mesh / "owner", "labelList", listed(map(str, owners)))
    write_foam(mesh / "neighbour", "labelList", listed(str(other) for _, other, _ in inner))
    patch = f"sides {{ type patch; nFaces {len(outer)}; startFace {len(inner)}; }}"
    write_foam(mesh / "boundary", "polyBoundaryMesh", listed([patch]))
    control = "application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1e-6;\n"
    control += "deltaT 1e-6; writeControl runTime; writeInterval 1e-6;\n"
    (folder / "system").mkdir()
    write_foam(folder / "system" / "controlDict", "dictionary", control)
    kelvins = temperature()[quads()].mean(axis=1) + 273.15
    for time, cooler in (("0", 0.0), ("1e-06", 1.0)):
        values = listed(f"{value:.6g}" for value in kelvins - cooler)
        field = "dimensions [0 0 0 1 0 0 0];\ninternalField nonuniform List<scalar> "
        field += f"{values};\nboundaryField {{ sides {{ type zeroGradient; }} }}\n"
        (folder / time).mkdir()
        write_foam(folder / time / "T", "volScalarField", field)
        field = "dimensions [0 1 -1 0 0 0 0];\ninternalField uniform (-4 0 0);\n"
        field += "boundaryField { sides { type zeroGradient; } }\n"
        write_foam(folder / time / "U", "volVectorField", field)
    (folder / "case.foam").touch()


def faces() -> tuple[list[tuple[int, int, list[int]]], list[tuple[int, int, list[int]]]]:
    """Owner, neighbour (-1: none) and corners of faces between cells, and of those outside."""
    layer, corners = COLUMNS * ROWS, quads()
    of_edge: dict[tuple[int, int], tuple[int, int, int]] = {}
    inner, outer = [], []
    for cell, quad in enumerate(corners.tolist()):
        for a, b in zip(quad, [*quad[1:], quad[0]], strict=True):
            edge = (min(a, b), max(a, b))
            if edge in of_edge:
                owner, first, second = of_edge.pop(edge)
                inner.append((owner, cell, [first, second, second + layer, first + layer]))
            else:
                of_edge[edge] = (cell, a, b)
        outer.append((cell, -1, quad[::-1]))
        outer.append((cell, -1, [node + layer for node in quad]))
    for owner, a, b in of_edge.values():
        outer.append((owner, -1, [a, b, b + layer, a + layer]))
    return sorted(inner, key=lambda face: face[:2]), outer


def listed(rows: Iterable[str]) -> str:
    """Return a list as OpenFOAM writes it."""
    lines = list(rows)
    return f"{len(lines)}\n(\n" + "\n".join(lines) + "\n)\n"


def write_foam(path: Path, kind: str, body: str) -> None:
    """Write a file of a case."""
    head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {path.name}; }}\n"
    path.write_text(head + body, encoding="utf-8")


def all_programs(folder: Path) -> None:
    """Write the files of each program into a folder of its name."""
    for write in (abaqus, advantedge, ansys, deform, ls_dyna, openfoam):
        files = folder / write.__name__.replace("_", "-")
        files.mkdir()
        write(files)
