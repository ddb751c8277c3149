"""What a study's fields say of themselves: complete, and true."""

import re

import pytest

from chipglow.cutting import material_names
from chipglow.quantities import (
    Part,
    changed,
    field_tables,
    own_settings,
    setting_at,
    settings,
    value_at,
)
from chipglow.study import Study, study_text

_VALUE = r"(-?[\d.]+)(?: ([A-Za-z/^2]+))?"
_RANGE = re.compile(rf"{_VALUE} to {_VALUE}")
_LOWER = re.compile(rf"(over )?{_VALUE}( or more)?")
_UPPER = re.compile(rf"(under|up to) {_VALUE}")
INCLUSIVE, EXCLUSIVE = True, False


def sections(section, name):
    yield section, name
    for one in own_settings(section):
        if one.is_section:
            yield from sections(one.value, f"{name}.{one.name}")


def subclasses(kind):
    for sub in kind.__subclasses__():
        yield sub
        yield from subclasses(sub)


CUTTING = list(sections(Study().cutting, "cutting"))
FIELDS = [
    (section, one) for section, _ in CUTTING for one in own_settings(section) if not one.is_section
]
NAMES = [f"{type(section).__name__}.{one.name}" for section, one in FIELDS]


def limits(text):
    """Limits that a field's words name, first and last, and whether they are allowed themselves.

    What follows after a semicolon depends on other fields.
    """
    words = text.split(";")[0].removeprefix("none, or ")
    if match := _RANGE.fullmatch(words):
        low, low_unit, high, high_unit = match.groups()
        return [(float(low), low_unit, -1, INCLUSIVE), (float(high), high_unit, 1, INCLUSIVE)]
    found = []
    for part in words.split(", "):
        if match := _UPPER.fullmatch(part):
            found.append((float(match[2]), match[3], 1, match[1] == "up to"))
        elif match := _LOWER.fullmatch(part):
            found.append((float(match[2]), match[3], -1, bool(match[4])))
    return found


def accepts(section, name, number, unit):
    whole = isinstance(getattr(section, name), int)
    value = f"{number:.9g} {unit}" if unit else (round(number) if whole else number)
    try:
        changed(section, {name: value})
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("part", list(subclasses(Part)), ids=lambda kind: kind.__name__)
def test_every_declared_field_has_a_description(part):
    for name, parameter in part.declared().items():
        assert parameter.meaning.strip(), name


@pytest.mark.parametrize(("section", "entry"), FIELDS, ids=NAMES)
def test_every_field_of_the_cut_says_what_is_allowed_and_its_default(section, entry):
    assert entry.meaning
    assert entry.allowed
    assert entry.plain == "none" or str(entry.plain).endswith(entry.unit)
    assert entry.value == entry.default


NOT_ONE_NUMBER = (
    "workpiece", "material", "left", "top", "end", "cutting_length", "chamfer", "hone", "outline",
)  # fmt: skip
NUMBERS = [(section, entry) for section, entry in FIELDS if entry.name not in NOT_ONE_NUMBER]


@pytest.mark.parametrize(
    ("section", "entry"), NUMBERS, ids=lambda value: getattr(value, "name", "")
)
def test_the_limits_that_are_told_are_those_that_hold(section, entry):
    found = limits(entry.allowed)
    assert found, entry.allowed
    for number, unit, direction, inclusive in found:
        step = 1 if isinstance(getattr(section, entry.name), int) else 1e-3 * (abs(number) or 1)
        at, beyond = number, number + direction * step
        within = number - direction * step
        if entry.name == "start":  # within the window, of which the end is given
            within = 1e-3
        assert accepts(section, entry.name, at, unit) == inclusive
        assert accepts(section, entry.name, within, unit)
        assert not accepts(section, entry.name, beyond, unit)


def test_the_window_is_within_the_cut_as_it_says():
    window = {"start": "0.5 mm", "end": "1 mm"}
    for start, end, length, good in (
        ("0.5 mm", "1 mm", "1 mm", True),
        ("1 mm", "1 mm", "1 mm", False),
        ("0.5 mm", "1.01 mm", "1 mm", False),
    ):
        cutting = {"cutting_length": length, "window": {**window, "start": start, "end": end}}
        if good:
            Study(cutting=cutting)
        else:
            with pytest.raises(ValueError, match="window"):
                Study(cutting=cutting)


def test_the_materials_that_are_told_are_those_there_are():
    cutting = Study().cutting
    entries = {entry.name: entry for entry in own_settings(cutting)}
    names = entries["workpiece"].allowed.split(";")[0].split(", ")
    assert names == list(material_names("workpiece"))
    assert "aisi-1045/ozel" in entries["workpiece"].allowed
    assert Study(cutting={"workpiece": "aisi-1045/ozel"})
    tools = next(entry for entry in own_settings(cutting.tool) if entry.name == "material")
    assert tools.allowed.split(", ") == list(material_names("tool"))


def test_the_tables_have_a_row_for_every_field_of_the_cut():
    text = field_tables(Study().cutting, "cutting")
    for section, name in CUTTING:
        _, _, after = text.partition(f"## `{name}`\n")
        rows = [line for line in after.split("\n## ")[0].splitlines() if line.startswith("| `")]
        entries = [one for one in own_settings(section) if not one.is_section]
        assert len(rows) == len(entries)
        for row, entry in zip(rows, entries, strict=True):
            cells = [cell.strip() for cell in row.strip("|").split(" | ")]
            expected = [f"`{entry.name}`", entry.meaning, entry.unit, f"`{entry.plain}`"]
            assert cells == [*expected, entry.allowed]


def test_the_template_says_what_is_allowed():
    text = " ".join(study_text(Study()).replace("#", " ").split())
    for _, entry in FIELDS:
        assert f"{entry.meaning} Allowed: {entry.allowed}. {entry.name}: {entry.plain}" in text


def test_a_field_without_limits_says_none():
    assert not settings(Study())["title"].allowed


def test_paths_lead_through_lists_and_mappings():
    detector = {
        "response": {"kind": "range", "hottest": "2500 degC"},
        "full_well": 1e7,
        "terms": [{"kind": "netd", "netd": "0.1 K", "temperature": "300 degC"}],
    }
    study = Study(camera={"detector": detector})
    paths = {
        "camera.band.0": 3.6e-6,
        "camera.detector.terms.0.netd": 0.2,
        "surface.chips.chip 1.body.mean": 0.6,
    }
    new = changed(study, paths)
    assert {path: value_at(new, path) for path in paths} == paths
    assert new.camera.band == (3.6e-6, study.camera.band[1])
    assert value_at(study, "surface.chips.chip 1.body.mean") == 0.42
    assert setting_at(new, "camera.band.0").unit == "um"
    assert setting_at(new, "camera.detector.terms.0.netd").unit == "K"
    assert setting_at(new, "seed").value == study.seed
    with pytest.raises(ValueError, match="expected 0 to 1"):
        changed(study, {"surface.chips.chip 1.body.mean": 2.0})
    for path in ("camera.band.2", "surface.chips.chip 9.body", "camera.psf.fwhm", "camera.zoom"):
        with pytest.raises(LookupError):
            value_at(study, path)
