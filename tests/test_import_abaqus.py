"""Input files of Abaqus that mean the same mesh in other words, or are refused."""

import numpy as np
import pytest

from chipglow.io.sources import SourceError
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.scene import Material, Raster

pytest.importorskip("pyvista")

RASTER = Raster(0.0, 1.0, 0.1, 10, 20)
EXPECTED = 300.0 + 100.0 * RASTER.x[None] + 10.0 * RASTER.y[:, None]
TABLE = "node,NT11\n1,300\n2,400\n3,500\n4,310\n5,410\n6,510\n"

NODES = "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 2., 0.\n4, 0., 1.\n5, 1., 1.\n6, 2., 1.\n"
FIRST = "*ELEMENT, TYPE=CPE4RT, ELSET=chip\n1, 1,2,5,4\n"
MESH = f"{NODES}{FIRST}2, 2,3,6,5\n"
TOOL = "*NODE\n7, 3., 0.\n8, 3., 2.\n9, 3.5, 1.\n"
PART = f"*PART, NAME=Chip\n{MESH}*END PART\n"
RIGID = "*PART, NAME=Tool\n*NODE\n1, 5., 5.\n2, 5., 6.\n*ELEMENT, TYPE=R2D2\n1, 1, 2\n*END PART\n"


def assembly(*instances):
    inside = "".join(f"*INSTANCE, {of}*END INSTANCE\n" for of in instances)
    return f"*ASSEMBLY, NAME=Assembly\n{inside}*NODE\n1, 9., 9.\n*END ASSEMBLY\n"


CHIP, RIGID_TOOL = "NAME=Chip-1, PART=Chip\n", "NAME=Tool-1, PART=Tool\n1., 2., 0.\n"

READ = {
    "plain": MESH,
    "unix, then windows": MESH.replace("\n", "\r\n"),
    "byte-order mark": "\ufeff" + MESH,
    "comments and blank lines": "** a chip\n\n" + MESH.replace("\n3,", "\n** third\n\n3,"),
    "mixed case and blanks": MESH.replace("*NODE", "*Node").replace("TYPE=CPE4RT", "type = cpe4rt"),
    "keyword continued": MESH.replace("CPE4RT, ELSET", "CPE4RT,\n ELSET"),
    "element continued": MESH.replace("1, 1,2,5,4", "1, 1,2,\n5,4"),
    "trailing commas": MESH.replace("0., 0.\n", "0., 0.,\n"),
    "blank field is 0": MESH.replace("1, 0., 0.", "1, , ,").replace("4, 0., 1.", "4, , 1."),
    "exponents of Fortran": MESH.replace("6, 2., 1.", "6, 0.2D+01, .1d1"),
    "direction of the normal": MESH.replace("1, 0., 0.", "1, 0., 0., 0., 0., 0., 1."),
    "rectangular system": MESH.replace("*NODE", "*NODE, SYSTEM=R"),
    "cylindrical system": NODES.replace("4, 0., 1.\n", "")
    + "*NODE, SYSTEM=C\n4, 1., 90.\n"
    + MESH.removeprefix(NODES),
    "system reset": "*SYSTEM\n" + MESH,
    "generated nodes": MESH.replace("2, 1., 0.\n", "").replace("5, 1., 1.\n", "")
    + "*NGEN\n1, 3, 1\n4, 6\n",
    "generated nodes before their ends": "*NGEN\n1, 3\n"
    + MESH.replace("2, 1., 0.\n", ""),
    "generated elements": f"{NODES}{FIRST}*ELGEN\n1, 2, 1, 1\n",
    "generated in the second direction": f"{NODES}{FIRST}*ELGEN, ELSET=all\n1, 1,,, 2, 1, 1\n",
    "rigid line, mass, springs": MESH + TOOL + "*ELEMENT, TYPE=R2D2\n3, 7, 8\n*ELEMENT, TYPE=MASS\n"
    "4, 9\n*ELEMENT, TYPE=SPRINGA\n5, 7, 9\n*ELEMENT, TYPE=CONN2D2\n6, 7, 9\n"
    "*ELEMENT, TYPE=DASHPOTA\n7, 7, 9\n*ELEMENT, TYPE=ROTARYI\n8, 9\n",
    "pore pressure": MESH.replace("CPE4RT", "CPE4P"),
    "cohesive element": NODES + FIRST + "*ELEMENT, TYPE=COH2D4\n2, 2, 3, 6, 5\n",
    "outputs and materials": MESH + "*NODE OUTPUT\nNT\n*ELEMENT OUTPUT\nPEEQ\n*EL PRINT\n"
    "*AMPLITUDE, INPUT=a.txt\n*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\na, b\n",
    "only part": PART,
    "part and instance": PART + assembly(CHIP),
    "mesh in the instance": "*PART, NAME=Chip\n*END PART\n" + assembly(CHIP + MESH),
    "two parts, one instance": PART + PART.replace("Chip", "B").replace("1., ", "7., ")
    + assembly(CHIP),
    "rigid tool beside": PART + RIGID + assembly(CHIP, RIGID_TOOL),
    "instance translated by 0": PART + assembly(CHIP + "0., 0., 0.\n"),
    "instance translated": PART.replace(", 0., ", ", -1., ").replace(", 1., ", ", 0., ")
    .replace(", 2., ", ", 1., ") + assembly(CHIP + "1., 0., 0.\n"),
    "quoted names": PART.replace("Chip", '"A chip, hot"')
    + assembly('NAME="A, 1", PART="A chip, hot"\n'),
}  # fmt: skip

REFUSED = {
    r"line 2: \*NODE: SYSTEM=S is not read": MESH.replace("*NODE", "*NODE, SYSTEM=S"),
    r"line 1: \*SYSTEM: is not read": "*SYSTEM\n1., 0., 0.\n" + MESH,
    r"line 11: \*NCOPY: is not read": MESH + "*NCOPY, OLD SET=a, CHANGE NUMBER=10, SHIFT\n1.,0.\n",
    r"\*ELCOPY: is not read": MESH + "*ELCOPY, OLD SET=chip, SHIFT NODES=1, ELEMENT SHIFT=1\n",
    r"\*NFILL: is not read": MESH + "*NFILL\na, b, 2, 10\n",
    r"\*NMAP: is not read": MESH + "*NMAP, NSET=a\n0., 0., 0.\n",
    r"\*INCLUDE: is not read": "*INCLUDE, INPUT=/etc/passwd\n" + MESH,
    r"\*IMPERFECTION: is not read": MESH + "*IMPERFECTION, FILE=a, STEP=1\n1, 0.1\n",
    r"\*SYMMETRIC MODEL GENERATION: is": MESH + "*SYMMETRIC MODEL GENERATION, REVOLVE\n",
    r"\*MODEL CHANGE: is not read": MESH + "*MODEL CHANGE, REMOVE\nchip\n",
    r"\*NODE: INPUT=nodes.txt is not read": MESH + "*NODE, INPUT=nodes.txt\n",
    r"\*ELEMENT: INPUT=e.txt is not read": MESH + "*ELEMENT, TYPE=CPE4, INPUT=e.txt\n",
    r"\*ELSET: INPUT=s.txt is not read": MESH + "*ELSET, ELSET=a, INPUT=s.txt\n",
    r"\*NGEN: LINE=C is not read": MESH + "*NGEN, LINE=C\n1, 3, 1, 5\n",
    r"line 12: \*NGEN: 1 to 6 is not a multiple of the increment 2": MESH + "*NGEN\n1, 6, 2\n",
    r"\*NGEN: node 77 is not defined": MESH + "*NGEN\n1, 77\n",
    r"\*ELGEN: element with an area 5 is not defined": MESH + "*ELGEN\n5, 2\n",
    r"\*ELGEN: ALL NODES is not read": MESH + "*ELGEN, ALL NODES\n1, 2\n",
    r"\*ELEM: is abbreviated, expected such as \*ELEMENT": NODES + "*ELEM, TYPE=CPE4\n1, 1,2,5,4\n",
    r"line 8: \*ELEMENT: the element type TYPE=EC3D8R is not": NODES
    + "*ELEMENT, TYPE=EC3D8R\n1, 1",
    r"the element type TYPE=PC3D is not read": MESH + "*ELEMENT, TYPE=PC3D\n9, 1\n",
    r"the element type TYPE=COH2D4P is not read": MESH + "*ELEMENT, TYPE=COH2D4P\n9, 1\n",
    r"the element type TYPE=C3D15V is not read": MESH + "*ELEMENT, TYPE=C3D15V\n9, 1\n",
    r"the element type TYPE= is not read": MESH + "*ELEMENT\n9, 1\n",
    r"line 9: .*element 1 has 3 nodes, CPE4 has 4": NODES + "*ELEMENT, TYPE=CPE4\n1, 1, 2, 5",
    r"element 1 has 5 nodes, CPE4 has 4": NODES + "*ELEMENT, TYPE=CPE4\n1, 1, 2, 5, 4, 4",
    r"line 2: \*NODE: '<x>' is not a number": MESH.replace("1, 0., 0.", "1, <x>, 0."),
    r"\*ELSET: the set hard is not defined before": MESH + "*ELSET, ELSET=all\nhard\n",
    r"\*INSTANCE: an instance that is rotated": PART
    + assembly(CHIP + "0., 0., 0.\n0., 0., 0., 0., 0., 1., 90.\n"),
    r"CHIP-1, CHIP-2 have elements .* only one part": PART
    + assembly(CHIP, CHIP.replace("p-1", "p-2")),
    r"\*INSTANCE: PART= is not a part": assembly("NAME=Chip-1, LIBRARY=old\n"),
    r"CHIP, B have elements": PART + PART.replace("Chip", "B"),
}


def source_of(folder, deck, table=TABLE, **more):
    (folder / "chip.inp").write_bytes(deck.encode())
    (folder / "chip.csv").write_text(table)
    return MeshSource(folder / "chip.inp", **more)


@pytest.mark.parametrize("deck", READ.values(), ids=READ)
def test_decks_of_one_mesh_are_read_alike(tmp_path, deck):
    source = source_of(tmp_path, deck)
    assert source.survey().extent == pytest.approx((0.0, 2.0, 0.0, 1.0))
    (frame,) = source.frames(RASTER)
    # float32: 24 bits of 510 K; cos(90 degrees) is 6e-17.
    np.testing.assert_allclose(frame.fields["temperature"], EXPECTED, atol=1e-4)
    assert (frame.material == Material.WORKPIECE).all()


@pytest.mark.parametrize("said", REFUSED)
def test_decks_that_are_not_read_are_refused_with_keyword_and_line(tmp_path, said):
    with pytest.raises(SourceError, match=said):
        source_of(tmp_path, REFUSED[said]).survey()


def test_a_ring_in_cylindrical_coordinates(tmp_path):
    deck = MESH.replace("*NODE", "*NODE, SYSTEM=C").replace(", 1.\n", ", 90.\n")
    deck = deck.replace(", 2., ", ", 3., ").replace(", 1., ", ", 2., ").replace(", 0., ", ", 1., ")
    assert source_of(tmp_path, deck).survey().extent == pytest.approx((0.0, 3.0, 0.0, 3.0))


def test_elements_without_an_area_are_counted_and_their_rows_ignored(tmp_path):
    deck = READ["rigid line, mass, springs"]
    table = "element,NT11\n1,300\n2,400\n3,7\n4,7\n"
    survey = source_of(tmp_path, deck, table).survey()
    assert survey.notes.remarks == [
        "Elements without an area are skipped: 1 CONN2D2, 1 DASHPOTA, 1 MASS, 1 R2D2, 1 ROTARYI, "
        "1 SPRINGA.",
        "Positions are taken from the input file: its tables have no U1 and no COOR1.",
    ]
    assert survey.temperatures == (300.0, 400.0)


@pytest.mark.parametrize(
    ("lines", "tool"),
    [
        ("*ELSET, ELSET=tool\n2\n", "tool"),
        ("*ELSET, ELSET=tool, GENERATE\n2, 4\n", "tool"),
        ("*ELSET, ELSET=half\n2\n*Elset, elset=tool\nHALF\n", "tool"),
        ('*ELSET, ELSET="hard, sharp"\n2\n', "hard, sharp"),
        ("*ELGEN, ELSET=tool\n2, 1\n", "tool"),
    ],
)
def test_sets_of_elements(tmp_path, lines, tool):
    (frame,) = source_of(tmp_path, MESH + lines, tool_parts=(tool,)).frames(RASTER)
    right = np.broadcast_to(RASTER.x > 1.0, RASTER.shape)
    np.testing.assert_array_equal(frame.material == Material.TOOL, right)


def test_sets_of_another_instance_do_not_count(tmp_path):
    deck = PART + RIGID + assembly(CHIP, RIGID_TOOL)
    of_tool = "*ELSET, ELSET=tool, INSTANCE=Tool-1\n1\n*ELSET, ELSET=hot, INSTANCE=Chip-1\n1\n"
    deck = deck.replace("*END ASSEMBLY", of_tool + "*END ASSEMBLY")
    with pytest.raises(SourceError, match="no part 'tool', it has chip, hot"):
        source_of(tmp_path, deck, tool_parts=("tool",)).survey()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("node,NT11,U1,COOR1\n1,300,0,0\n", "U1, COOR1, expected positions .* or displacements"),
        ("node,NT11,U1\n1,300,0\n1,900,1\n", "node 1 has several positions"),
    ],
)
def test_positions_that_contradict_each_other_are_refused(tmp_path, table, said):
    with pytest.raises(SourceError, match=said):
        source_of(tmp_path, MESH, table).survey()
