"""A case of OpenFOAM by hand: two cells of 1 mm, as blockMesh writes them, with two times."""

from pathlib import Path

PARTS = (
    "constant/polyMesh/points", "constant/polyMesh/faces", "constant/polyMesh/owner",
    "constant/polyMesh/neighbour", "constant/polyMesh/boundary", "system/controlDict", "0/T",
    "0.5/T",
)  # fmt: skip
"""The files of a case."""


def write(path, kind, content):
    head = f"FoamFile {{ version 2.0; format ascii; class {kind}; object {path.name}; }}\n"
    path.write_text(head + content)


def write_foam(folder: Path, sides: str = "type zeroGradient;", velocity: str = "") -> Path:
    """Write the case into a folder; temperatures are 300 and 400, the first 305 at 0.5 s.

    With the condition of temperature on all sides, and a velocity in all cells such as (3 1 0).
    """
    mesh = folder / "constant" / "polyMesh"
    mesh.mkdir(parents=True)
    (folder / "system").mkdir()
    points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)]
    corner = {point: number for number, point in enumerate(points)}
    faces, owner = [], []

    def face(of_cell, *of):
        faces.append(f"4({' '.join(str(corner[point]) for point in of)})")
        owner.append(of_cell)

    face(0, (1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))
    face(0, (0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0))
    face(1, (2, 0, 0), (2, 1, 0), (2, 1, 1), (2, 0, 1))
    for cell in (0, 1):
        a, b = cell, cell + 1
        face(cell, (a, 0, 0), (b, 0, 0), (b, 0, 1), (a, 0, 1))
        face(cell, (a, 1, 0), (a, 1, 1), (b, 1, 1), (b, 1, 0))
        face(cell, (a, 0, 0), (a, 1, 0), (b, 1, 0), (b, 0, 0))
        face(cell, (a, 0, 1), (b, 0, 1), (b, 1, 1), (a, 1, 1))
    tables = {
        "points": ("vectorField", [f"({x} {y} {z})" for x, y, z in points]),
        "faces": ("faceList", faces),
        "owner": ("labelList", owner),
        "neighbour": ("labelList", [1]),
    }
    for name, (kind, rows) in tables.items():
        write(mesh / name, kind, f"{len(rows)}\n(\n" + "\n".join(map(str, rows)) + "\n)\n")
    boundary = "1\n(\nsides { type patch; nFaces 10; startFace 1; }\n)\n"
    write(mesh / "boundary", "polyBoundaryMesh", boundary)
    control = "application none; startFrom startTime; startTime 0; stopAt endTime; endTime 1;\n"
    control += "deltaT 0.5; writeControl runTime; writeInterval 0.5;\n"
    write(folder / "system" / "controlDict", "dictionary", control)
    for time in ("0", "0.5"):
        (folder / time).mkdir()
        values = f"nonuniform List<scalar> 2({300 + 10 * float(time)} 400)"
        field = f"dimensions [0 0 0 1 0 0 0];\ninternalField {values};\n"
        field += f"boundaryField {{ sides {{ {sides} }} }}\n"
        write(folder / time / "T", "volScalarField", field)
        if velocity:
            field = f"dimensions [0 1 -1 0 0 0 0];\ninternalField uniform {velocity};\n"
            field += "boundaryField { sides { type zeroGradient; } }\n"
            write(folder / time / "U", "volVectorField", field)
    (folder / "case.foam").touch()
    return folder / "case.foam"
