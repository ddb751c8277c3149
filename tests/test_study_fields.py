"""What a study's fields say of themselves: complete, and true."""

import pytest

from chipglow.quantities import Part, changed, own_settings, setting_at, settings, value_at
from chipglow.study import Study, study_text


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


def accepts(section, name, value):
    try:
        changed(section, {name: value})
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("part", list(subclasses(Part)), ids=lambda kind: kind.__name__)
def test_every_declared_field_has_a_description(part):
    for name, parameter in part.declared().items():
        assert parameter.meaning.strip(), name


def test_every_field_of_the_cut_says_what_is_allowed_and_its_default():
    template = " ".join(study_text(Study()).replace("#", " ").split())
    for _, entry in FIELDS:
        assert entry.meaning
        assert entry.plain == "none" or str(entry.plain).endswith(entry.unit)
        assert entry.value == entry.default
        allowed = f"Allowed: {entry.allowed}. " if entry.allowed else ""
        assert f"{entry.meaning} {allowed}{entry.name}: {entry.plain}" in template


LIMITS = [
    (section, entry, getattr(entry.parameter, limit), direction, limit in ("least", "most"))
    for section, entry in FIELDS
    for limit, direction in (("over", -1), ("least", -1), ("under", 1), ("most", 1))
    if getattr(entry.parameter, limit) is not None and entry.name not in ("start", "end")
]


def test_the_limits_that_are_declared_are_those_that_hold():
    assert len(LIMITS) > 30
    for section, entry, limit, direction, inclusive in LIMITS:
        step = 1 if entry.kind is int else 1e-3 * (abs(limit) or 1)
        if entry.name not in ("cutting_length", "left", "top"):  # others bind these first
            assert accepts(section, entry.name, limit) == inclusive, entry.path
            assert accepts(section, entry.name, limit - direction * step), entry.path
        assert not accepts(section, entry.name, limit + direction * step), entry.path


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
    assert not settings(study)["title"].allowed
    with pytest.raises(ValueError, match="expected 0 to 1"):
        changed(study, {"surface.chips.chip 1.body.mean": 2.0})
    for path in ("camera.band.2", "surface.chips.chip 9.body", "camera.psf.fwhm", "camera.zoom"):
        with pytest.raises(LookupError):
            value_at(study, path)
