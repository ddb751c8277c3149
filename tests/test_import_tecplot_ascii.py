"""ASCII files of Tecplot that mean the same mesh in other words, or are refused."""

import numpy as np
import pytest

from chipglow.io.sources import SourceError
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.scene import Material, Raster

pytest.importorskip("pyvista")

RASTER = Raster(0.0, 1.0, 0.1, 10, 20)
EXPECTED = 300.0 + 100.0 * RASTER.x[None] + 10.0 * RASTER.y[:, None]

HEAD = 'TITLE="a"\nVARIABLES="X" "Y" "Temperature"\n'
ROWS = "0 0 300\n1 0 400\n2 0 500\n0 1 310\n1 1 410\n2 1 510\n"
COLUMNS = "0 1 2 0 1 2\n0 0 0 1 1 1\n300 400 500 310 410 510\n"
CELLS = "1 2 5 4\n2 3 6 5\n"
QUADS = "ZONE NODES=6, ELEMENTS=2, ZONETYPE=FEQUADRILATERAL, DATAPACKING="
POINTS, BLOCKS = f"{HEAD}{QUADS}POINT\n{ROWS}{CELLS}", f"{HEAD}{QUADS}BLOCK\n{COLUMNS}{CELLS}"
OLD = f"{HEAD}ZONE N=6, E=2, F=FEPOINT, ET=QUADRILATERAL\n{ROWS}{CELLS}"
TRIANGLES = "1 2 5\n1 5 4\n2 3 6\n2 6 5\n"
GRID = f"{HEAD}ZONE I=3, J=2, F=POINT\n{ROWS}"
TEXT = 'TEXT X=3, Y=4, T="a text with N=9"\n'
GEOMETRY = "GEOMETRY X=0, Y=0, T=LINE\n1\n2\n0 0\n1 1\n"
LABELS = 'CUSTOMLABELS "a", "b"\n'
STRAIN = BLOCKS.replace('"Temperature"', '"Temperature", "Strain", "Rate"').replace(
    CELLS, f"1 2\n3 4\n{CELLS}"
)


def located(text, deck=STRAIN):
    return deck.replace("=BLOCK", f"=BLOCK, VARLOCATION={text}")


READ = {
    "points": POINTS,
    "blocks": BLOCKS,
    "old words": OLD,
    "lower case": POINTS.replace("ZONE NODES", "zone nodes").replace("=POINT", "=point"),
    "windows": POINTS.replace("\n", "\r\n"),
    "in order": GRID,
    "in order, new words": GRID.replace("F=", "ZONETYPE=ORDERED, DATAPACKING="),
    "in order, blocks": f"{HEAD}ZONE I=3, J=2, K=1, F=BLOCK\n{COLUMNS}",
    "triangles": f"{HEAD}ZONE N=6, E=4, F=FEPOINT, ET=TRIANGLE\n{ROWS}{TRIANGLES}",
    "repeats": BLOCKS.replace("0 0 0 1 1 1", "3*0 3*1.0"),
    "repeats across lines": BLOCKS.replace("0 1 2 0 1 2\n0 0 0", "0 1 2 0 1\n2 3*0"),
    "repeated elements": f"{HEAD}ZONE N=6, E=3, F=FEPOINT, ET=QUADRILATERAL\n{ROWS}{CELLS}"
    "2 2*3 2\n",
    "exponents of Fortran": POINTS.replace("300", "0.300D+03").replace("510", ".51d3"),
    "exponents without a letter": POINTS.replace("300", "0.3+03").replace("510", "5100.-001"),
    "repeated exponents": BLOCKS.replace("1 1 1", "3*0.1D1"),
    "commas": POINTS.replace("0 0 300", "0, 0, 300"),
    "comments": POINTS.replace("1 0 400\n", "1 0 400 # a corner\n# 7 7 7\n").replace(
        "VARIABLES", "# VARIABLES = Z\nVARIABLES"
    ),
    "number sign in a name": POINTS.replace('TITLE="a"', 'TITLE="a # 1"'),
    "auxiliary data of the file": OLD.replace("ZONE", 'DATASETAUXDATA Common.T="1"\nZONE'),
    "auxiliary data of a variable": OLD.replace("ZONE", 'VARAUXDATA 1 Unit="mm"\nZONE'),
    "auxiliary data of a zone": OLD.replace("\n0 0 300", '\nAUXDATA N="7"\nAUXDATA E="3"\n0 0 300'),
    "auxiliary data at the end": OLD + 'DATASETAUXDATA N="1"\n',
    "text, geometry and labels before": OLD.replace("ZONE", TEXT + GEOMETRY + LABELS + "ZONE"),
    "text, geometry and labels behind": OLD + TEXT + GEOMETRY + LABELS,
    "type of the file": OLD.replace("VARIABLES", "FILETYPE = FULL\nVARIABLES"),
    "types of numbers": POINTS.replace("=POINT", "=POINT, DT=(SINGLE SINGLE\n DOUBLE)"),
    "names on lines": POINTS.replace('"X" "Y" "Temp', '"X"\n"Y"\n"Temp'),
    "names without quotes": POINTS.replace('"X" "Y" "Temperature"', "X, Y, Temperature"),
    "name with a comma": POINTS.replace("Temperature", "Temperature (K, mean)"),
    "zone's name": OLD.replace("ZONE N", 'ZONE T="N=1, E=1, chip", N'),
    "elements by a list": located("([4-5]=CELLCENTERED)"),
    "elements by numbers": located("([4,5]=CELLCENTERED)"),
    "elements by two lists": located("([1-3]=NODAL, [4]=CELLCENTERED, [5]=CELLCENTERED)"),
    "elements by places": located("(NODAL, NODAL, NODAL, CELLCENTERED, CELLCENTERED)"),
    "elements in lower case": located("([4 - 5] = CellCentered)"),
    "passive words": OLD.replace("N=6", "C=RED, STRANDID=0, PARENTZONE=0, N=6"),
}  # fmt: skip

REFUSED = {
    "zone 1: 24 numbers, expected 26": (BLOCKS, "2 3 6 5\n", "2 3\n"),
    "zone 1: 27 numbers, expected 26": (BLOCKS, CELLS, CELLS + "1\n"),
    "zone 1: 19 numbers, expected 18": (GRID, ROWS, ROWS + "7\n"),
    "27 numbers, expected 26": (BLOCKS, "0 0 0 1 1 1", "3*0 4*1"),
    r"expected 26\Z": (BLOCKS, "0 0 0 1 1 1", "999999999999999999*0"),
    "'x' is not a number": (BLOCKS, "300", "x"),
    "'x' before . is not": (BLOCKS, "300", "x*300"),
    "'AUXDATA' is not a number": (BLOCKS, "300", "AUXDATA"),
    "DATAPACKING is not stated": (BLOCKS, ", DATAPACKING=BLOCK", ""),
    "DATAPACKING is mixed": (BLOCKS, "=BLOCK", "=MIXED"),
    "ET is not stated": (OLD, ", ET=QUADRILATERAL", ""),
    "the type POLYGON are not read": (BLOCKS, "FEQUADRILATERAL", "FEPOLYGON"),
    "ELEMENTS is not stated": (OLD, ", E=2", ""),
    "I is not stated": (GRID, "I=3, ", ""),
    "I is 0, expected 1": (GRID, "I=3", "I=0"),
    "VARSHARELIST is not read": (BLOCKS, "=BLOCK", "=BLOCK, VARSHARELIST=([1-2]=1)"),
    "CONNECTIVITYSHAREZONE is not": (BLOCKS, "=BLOCK", "=BLOCK, CONNECTIVITYSHAREZONE=1"),
    "PASSIVEVARLIST is not read": (BLOCKS, "=BLOCK", "=BLOCK, PASSIVEVARLIST=[3]"),
    "zone 1: NV is not read": (BLOCKS, "=BLOCK", "=BLOCK, NV=1"),
    "zone 1: D is not read": (OLD, "F=", "D=(1,2), F="),
    "no variable 4-6, expected 1 to 5": (STRAIN, "NODES", "VARLOCATION=([4-6]=CELLCENTERED) NODES"),
    "VARLOCATION=.* is not read": (STRAIN, "=BLOCK", "=BLOCK VARLOCATION=([4-5]=FACECENTERED)"),
    r"VARLOCATION=\(NODAL\) is not read": (STRAIN, "=BLOCK", "=BLOCK, VARLOCATION=(NODAL)"),
    "expected DATAPACKING=BLOCK": (OLD, "F=", "VARLOCATION=([3]=CELLCENTERED), F="),
    "'X' is repeated": (OLD, '"Y"', '"X"'),
    "'B=' is not a name": (OLD, "ZONE", "B= 3\nZONE"),
    "VARIABLES: there are several": (OLD, CELLS, CELLS + HEAD),
    "there is no Y": (OLD, '"Y"', '"Z"'),
    "not whole numbers": (OLD, "1 2 5 4", "1 2 5 4.5"),
    "SOLUTIONTIME: 'now' is not": (OLD, "F=", "SOLUTIONTIME=now, F="),
    "has no VARIABLES and ZONE": (OLD, "VARIABLES", "NAMES"),
}  # fmt: skip


def source_of(folder, text):
    (folder / "chip.dat").write_bytes(text.encode())
    return MeshSource(folder / "chip.dat")


@pytest.mark.parametrize("text", READ.values(), ids=READ)
def test_files_of_one_mesh_are_read_alike(tmp_path, text):
    (frame,) = source_of(tmp_path, text).frames(RASTER)
    # float32: 24 bits of 510 K.
    np.testing.assert_allclose(frame.fields["temperature"], EXPECTED, atol=1e-4)
    assert (frame.material == Material.WORKPIECE).all()
    if "VARLOCATION" in text:
        strain = np.broadcast_to(np.where(RASTER.x < 1.0, 1.0, 2.0), RASTER.shape)
        np.testing.assert_array_equal(frame.fields["plastic_strain"], strain)


@pytest.mark.parametrize("said", REFUSED)
def test_files_that_are_not_read_are_refused_with_the_word(tmp_path, said):
    text, old, new = REFUSED[said]
    assert old in text
    with pytest.raises(SourceError, match=f"chip.dat: .*{said}"):
        source_of(tmp_path, text.replace(old, new, 1)).survey()


def test_zones_without_times_are_parts_of_one_mesh_which_is_said(tmp_path):
    text = OLD + OLD.removeprefix(HEAD)
    said = source_of(tmp_path, text).survey().notes.remarks
    assert said == ["The 2 zones state no SOLUTIONTIME: they are parts of one mesh."]
    later = text.replace("ZONE", "ZONE SOLUTIONTIME=0.1D1,").replace("0.1D1", "0.2-03", 1)
    survey = source_of(tmp_path, later).survey()
    assert survey.times == pytest.approx([2e-4, 1.0])
    assert not survey.notes.remarks
