"""Parts: one declaration makes check, section, comment, error, JSON schema and documentation."""

import inspect
import json
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Annotated

import jsonschema
import pytest
import yaml
from pydantic import AfterValidator, ValidationError

from chipglow import quantities
from chipglow.camera import PSFS, GaussianPSF, PointSpreadFunction
from chipglow.io import ImportDescription, import_text
from chipglow.laboratory.recordings import MeasurementDescription, measurement_text
from chipglow.quantities import (
    Family,
    Parameter,
    Part,
    adapter,
    changed,
    made_from,
    placed,
    problem,
    rederived,
)
from chipglow.quantities.units import LENGTH, TEMPERATURE
from chipglow.study import Study, study_text
from chipglow.text import commented_yaml, json_schema


@dataclass(frozen=True)
class Shelf(Part):
    """A shelf.

    Its second paragraph is for the documentation only.
    """

    width: Annotated[float, Parameter("Of the board.", LENGTH, over=0.0, most=2.0)]
    boards: Annotated[int, Parameter("How many.", least=1)] = 3
    warmth: Annotated[float | None, Parameter("Of the room.", TEMPERATURE, least=273.15)] = None
    hidden: str = "not for descriptions"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 0.0}, "width: 0 m, expected more than 0 m, up to 2 m"),
        ({"width": "3 m"}, "width: 3000000 um, expected more than 0 um, up to 2000000 um"),
        ({"width": "3 s"}, "width: '3 s' is not a length, expected a value such as 6 um"),
        ({"width": float("nan")}, "width: nan m, expected more than 0 m, up to 2 m"),
        ({"width": 1.0, "boards": 0}, "boards: 0, expected 1 or more"),
        ({"width": 1.0, "boards": 2.5}, "boards: 2.5, expected a whole number"),
        ({"width": 1.0, "boards": True}, "boards: True, expected a whole number"),
        ({"width": 1.0, "warmth": 3.0}, "warmth: 3 K, expected 273.15 K or more"),
        ({"width": "1 m", "warmth": "-1 degC"}, "warmth: -1 degC, expected 0 degC or more"),
    ],
)
def test_a_wrong_value_is_refused_with_its_limits(values, message):
    with pytest.raises(ValueError, match="Shelf") as caught:
        Shelf(**values)
    assert str(caught.value) == f"Shelf.{message}"
    with pytest.raises(ValidationError) as refused:
        read(values)
    assert problem(refused.value) == message


def read(data):
    return adapter(Shelf).validate_python(data)


FILE = {"folder": "."}
"""Context of data from a file."""


def read_from_file(data):
    return adapter(Shelf).validate_python(data, context={"folder": "."})


def test_a_description_gives_text_with_units_and_makes_the_part():
    shelf = read({"width": "20 cm", "warmth": "20 degC"})
    assert shelf == Shelf(0.2, 3, 293.15)
    assert adapter(Shelf).dump_python(shelf, mode="json") == {
        "width": "200000 um",
        "boards": 3,
        "warmth": "20 degC",
    }
    assert read({"width": "1 m", "warmth": "none"}).warmth is None
    for values, message in (
        ({"width": "1 m", "hidden": "x"}, "unknown key 'hidden'"),
        ({}, "width\\n  Value error, is missing, expected a length such as 6 um"),
    ):
        with pytest.raises(ValidationError, match=message):
            read(values)


def test_si_numbers_pass_from_python_only():
    assert read({"width": 1.5}) == Shelf(1.5) == Shelf("150 cm")
    assert (Shelf(1.5).given, Shelf(1.5, warmth=300.0).given) == ({"width"}, {"width", "warmth"})
    with pytest.raises(ValidationError, match="3 m, expected more than 0 m"):
        read({"width": 3.0})
    with pytest.raises(ValidationError, match="has no unit"):
        read_from_file({"width": 1.5})
    assert read_from_file({"width": "1.5 m"}) == Shelf(1.5)


def test_a_field_is_validated_once():
    seen = []

    def noted(width):
        seen.append(width)
        return width

    @dataclass(frozen=True)
    class Board(Part):
        """A board."""

        width: Annotated[float, Parameter("Of it.", LENGTH), AfterValidator(noted)] = 1.0

    @dataclass(frozen=True)
    class Case(Part):
        """A case."""

        board: Annotated[Board, Parameter("In it.")]

    @dataclass(frozen=True)
    class Plank(Board):
        """A board with a length."""

        length: Annotated[float, Parameter("Of it.", LENGTH, most=9.0)] = 1.0

    for make in (
        lambda: Board(2.0),
        lambda: Case({"width": "2 m"}),
        lambda: adapter(Case).validate_python({"board": {"width": "2 m"}}, context={"folder": "."}),
        lambda: made_from(Plank, Board(2.0), length="3 m"),
    ):
        seen.clear()
        made = make()
        assert seen == [2.0]
    assert (made, made.given) == (Plank(2.0, 3.0), {"width", "length"})
    with pytest.raises(ValueError, match=r"Plank.length: 30 m, expected .* up to 9 m"):
        made_from(Plank, Board(2.0), length=30.0)


def test_a_field_with_another_default_keeps_its_declaration():
    @dataclass(frozen=True)
    class Wide(Shelf):
        """A wide shelf."""

        width: float = 1.8

    assert (Wide().width, Wide("50 cm").width) == (1.8, 0.5)
    assert Wide.parameter("width") == Shelf.parameter("width")
    assert list(Wide.declared()) == ["width", "boards", "warmth"]
    with pytest.raises(ValueError, match=r"Wide.width: 3 m, expected more than 0 m, up to 2 m"):
        Wide(3.0)


def test_a_derived_value_is_checked_and_gives_way_to_a_given_one():
    @dataclass(frozen=True)
    class Door(Part):
        """A door, as high as two widths."""

        width: Annotated[float, Parameter("Of it.", LENGTH)] = 1.0
        height: Annotated[float, Parameter("Of it.", LENGTH, most=4.0)] = 2.0

        def __post_init__(self) -> None:
            super().__post_init__()
            self.derive(height=2 * self.width)

    door = adapter(Door).validate_python({"width": "50 cm"}, context=FILE)
    assert (door.height, door.given, door.derived) == (1.0, {"width"}, {"height"})
    assert changed(door, {"width": 1.5}).height == 3.0
    assert changed(changed(door, {"height": 1.2}), {"width": 1.5}).height == 1.2
    assert rederived(door, height=3.0) == Door(0.5, 3.0)
    assert rederived(door) == Door(0.5, 2.0)
    assert rederived(Door(0.5, 1.2), height=3.0).height == 1.2
    with pytest.raises(ValueError, match="height: 6 m, expected more than 0 m, up to 4 m"):
        Door(3.0)


def test_help_shows_plain_types():
    signature = str(inspect.signature(Shelf))
    assert signature.startswith("(width: float, boards: int = 3, warmth: float | None = None,")
    assert "title: str = " in str(inspect.signature(Study))


def test_comment_schema_and_documentation_say_the_same():
    text = commented_yaml("# head", Shelf(1.0))
    assert (
        "# Of the board.\n# Allowed: more than 0 um, up to 2000000 um.\nwidth: 1000000 um\n" in text
    )
    assert "# How many.\n# Allowed: 1 or more.\nboards: 3\n" in text
    assert "# Of the room.\n# Allowed: none, or 0 degC or more.\nwarmth: none\n" in text
    schema = json.loads(json_schema(Shelf))
    assert schema["properties"]["boards"]["minimum"] == 1
    assert schema["properties"]["width"]["description"] == "Of the board."
    assert schema["required"] == ["width"]
    assert "width : float, in m\n    Of the board.\n" in Shelf.__doc__
    assert "hidden" not in Shelf.__doc__


def test_a_family_finds_parts_of_other_packages(monkeypatch):
    family = Family("furniture")
    family.add("shelf", Shelf)
    with pytest.raises(ValueError, match="furniture: 'shelf' is not a new kind"):
        family.add("shelf", GaussianPSF)
    family.add("shelf", Shelf)  # as a notebook's cell does that is run again
    entry = EntryPoint("gauss", "chipglow.camera:GaussianPSF", "chipglow.furniture")
    monkeypatch.setattr(
        quantities.part, "entry_points", lambda group: [entry] if "furniture" in group else []
    )
    quantities.part.of_other_packages.cache_clear()
    assert set(family.kinds) == {"shelf", "gauss"}
    assert family.parts["gauss"] is GaussianPSF
    quantities.part.of_other_packages.cache_clear()


def test_a_package_that_cannot_be_loaded_is_a_warning(monkeypatch):
    entry = EntryPoint("broken", "no_such_module:Part", "chipglow.broken")
    monkeypatch.setattr(quantities.part, "entry_points", lambda group: [entry])
    with pytest.warns(RuntimeWarning, match="no_such_module:Part: cannot be loaded"):
        assert Family("broken").kinds == ()


def test_every_kind_has_an_example_that_a_study_reads(tmp_path):
    for kind, part in PSFS.parts.items():
        assert f"kind: {kind}" in part.example
    example = PSFS.parts["airy"].example.split("}")[0] + "}"
    study = Study(**{"camera": {"psf": yaml.safe_load(example), "magnification": 2.0}})
    assert isinstance(study.camera.build().psf, PointSpreadFunction)


@pytest.mark.parametrize(
    ("section", "text"),
    [
        (Study, study_text(Study())),
        (Study, study_text(Study.quick())),
        (ImportDescription, import_text(ImportDescription())),
        (MeasurementDescription, measurement_text(MeasurementDescription())),
    ],
)
def test_the_templates_hold_their_json_schema(section, text):
    schema = json.loads(json_schema(section))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(yaml.safe_load(text), schema)


@pytest.mark.parametrize(
    "wrong",
    [
        {"camera": {"pitch": 6}},
        {"camera": {"lens": "1 x"}},
        {"cutting": {"friction": {"coefficient": 3}}},
        {"cutting": {"numerics": {"points_per_side": 0}}},
        {"camera": {"psf": {"kind": "lens"}}},
        {"surface": {"kind": "uniform", "emissivity": 1.5}},
    ],
)
def test_the_schema_refuses_what_a_study_refuses(wrong):
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(wrong, json.loads(json_schema(Study)))
    with pytest.raises(ValueError, match=r"expected|did you mean"):
        Study(**wrong)


def test_a_part_that_overrides_another_has_its_fields_or_none():
    @dataclass(frozen=True)
    class Change(Part, overrides=Shelf):
        """Other numbers of a shelf."""

    assert Change().declared() == Shelf.declared()
    assert {getattr(Change(), name) for name in Change.declared()} == {None}
    made = adapter(Change).validate_python({"width": "1.5 m", "boards": None}, context=FILE)
    assert (made.width, made.boards) == (1.5, None)
    with pytest.raises(ValueError, match=r"Change.width: 0 m, expected more than 0 m"):
        Change(width=0.0)


def test_a_path_sets_a_value_in_parts_and_in_what_a_file_holds():
    assert placed(None, {"units.length": "mm"}) == {"units": {"length": "mm"}}
    held = {"terms": [{"kind": "veil"}, {"kind": "lag"}], "bits": 12}
    assert placed(held, {"terms.1.kind": "netd", "bits": 14, "terms.0.radius": 2}) == {
        "terms": [{"kind": "veil", "radius": 2}, {"kind": "netd"}],
        "bits": 14,
    }
    assert held["terms"][1] == {"kind": "lag"}
    with pytest.raises(ValueError, match=r"5: expected a position in a list"):
        placed(held, {"terms.5": {}})
    study = changed(Study(), {"camera.psf": {"kind": "gaussian", "fwhm": 8e-6}})
    assert changed(study, {"camera.psf.fwhm": 9e-6}).camera.psf == GaussianPSF(9e-6)
    with pytest.raises(LookupError, match=r"camera\.lens"):
        changed(study, {"camera.lens.focus": 1})
    with pytest.raises(ValueError, match=r"camera\.detector\.response: is missing"):
        changed(study, {"camera.detector.bits": 12})
