import threading
from dataclasses import replace
from math import isfinite, radians
from pathlib import Path

import numpy as np
import pytest
from analytic_chip import AnalyticChip, replace_cut
from hypothesis import HealthCheck, given, settings, strategies as st

from chipglow.analysis import Plan
from chipglow.camera import Camera, GaussianPSF, MeasuredPSF
from chipglow.cutting import CuttingConditions, Friction, Numerics, OutputWindow
from chipglow.io import atomic_path, open_scene, read_tool_outline
from chipglow.quantities import units
from chipglow.scene import FIELD_UNITS, Chamfer, Hone, Material, Raster, Scene, ToolGeometry
from chipglow.study import (
    Study,
    cached_scenes,
    clear_cache,
    cut,
    fit,
    is_cut,
    load_study,
    study_text,
)
from chipglow.study.fitting import uncovered
from chipglow.surface import (
    CHIP_1,
    CHIP_2,
    EmissivityTrend,
    FeatureTrends,
    MapSurface,
    TrendSurface,
    Wedge,
)
from chipglow.text import DescriptionError

TEXTS = [
    (units.TIME, "10 us", 10e-6),
    (units.TIME, "0.2us", 0.2e-6),
    (units.LENGTH, "6 um", 6e-6),
    (units.LENGTH, "6 µm", 6e-6),
    (units.LENGTH, "6000 nm", 6e-6),
    (units.CUT_LENGTH, "1.579 mm", 1.579e-3),
    (units.POSITION, "-420 um", -420e-6),
    (units.POSITION, "−420 um", -420e-6),
    (units.SPEED, "250 m/min", 250 / 60),
    (units.ANGLE, "-7 deg", radians(-7)),
    (units.ANGLE, "7°", radians(7)),
    (units.TEMPERATURE, "391 degC", 664.15),
    (units.TEMPERATURE, "300 °C", 573.15),
    (units.TEMPERATURE, "293 K", 293.0),
    (units.FREQUENCY, "600 Hz", 600.0),
    (units.FREQUENCY, "0.6 kHz", 600.0),
    (units.LENGTH, "6e-3 mm", 6e-6),
    (units.LENGTH, "2/3 um", 6.666666666666667e-07),
    (units.POSITION, "-2/3 um", -6.666666666666667e-07),
]


@pytest.mark.parametrize(("kind", "text", "value"), TEXTS)
def test_quantities_are_exactly_the_float_that_python_writes(kind, text, value):
    assert kind.parse(text) == value


def test_a_simple_fraction_is_written_as_such_and_a_range_has_one_unit():
    for text in ("2/3 um", "4/3 um", "1/7 um", "0.5 um", "0.66667 um"):
        assert units.LENGTH.text(units.LENGTH.parse(text)) == text
    with pytest.raises(ValueError, match="'1/0 um' is not a length"):
        units.LENGTH.parse("1/0 um")
    assert units.WAVELENGTHS.parse_range("3.8-5.1 um") == (3.8e-6, 5.1e-6)


@given(
    st.sampled_from(list(dict.fromkeys(kind for kind, *_ in TEXTS))),
    st.floats(min_value=1e-9, max_value=1e9, allow_nan=False),
    st.booleans(),
)
def test_a_quantity_is_read_back_from_its_text_as_the_same_float(kind, value, negative):
    if kind.base == "K":
        value += 1.0  # nearer to 0 K, 25 digits of degC would be needed
    if negative and not kind.positive:
        value = -value
    assert kind.parse(kind.text(value)) == value


@given(
    st.text()
    | st.from_regex(r"[-+]?[0-9.e]{1,8} ?[a-zA-Z/*^ .0-9°µ]{0,9}", fullmatch=True)
    | st.none()
    | st.floats()
    | st.lists(st.integers())
)
def test_any_other_value_is_one_line_of_error(value):
    try:
        assert isfinite(units.LENGTH.parse(value))
    except ValueError as error:
        assert "expected" in str(error)
        assert "6 um" in str(error)


def test_the_default_study_has_the_librarys_defaults():
    study = Study()
    cutting, camera = study.cutting, study.camera.build()
    assert cutting.simulation().conditions == CuttingConditions()
    assert cutting.tool.build() == ToolGeometry()
    assert cutting.friction == Friction()
    assert cutting.numerics == Numerics()
    assert cutting.window.build() == OutputWindow()
    assert camera == Camera.paper()
    assert study.analysis == Plan()
    chips = study.surface.build(study.seed)
    assert list(chips.values()) == [CHIP_1, CHIP_2]


@pytest.mark.parametrize(("study", "samples"), [(Study(), 9), (Study.quick(), 4)])
def test_a_whole_number_of_samples_makes_a_pixel_of_the_default_grids(study, samples):
    raster, pitch = study.cutting.field_of_view.build(), study.camera.pitch
    # Over the whole view the error adds up to under a millionth of a sample.
    assert abs(pitch / raster.spacing - samples) * max(raster.shape) / samples < 1e-6
    assert [n % samples for n in raster.shape] == [0, 0]


@pytest.mark.parametrize("study", [Study(), Study.quick()], ids=["paper", "quick"])
def test_the_template_is_read_back_as_the_same_study(study, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(study_text(study), encoding="utf-8")
    assert load_study(path) == study


def load(text, folder):
    path = folder / "study.yaml"
    path.write_text(text, encoding="utf-8")
    return load_study(path)


REFUSED = [
    ("", "is empty, expected a study"),
    ("sede: 3", "unknown key 'sede', did you mean 'seed'?"),
    ("camera: {zoom: 3}", "camera: unknown key 'zoom', expected one of preset, band, response"),
    ("cutting: {feed: 0.3}", "cutting.feed: 0.3 has no unit, expected a length such as 0.3 mm"),
    (
        "cutting: {initial_temperature: -280 degC}",
        "initial_temperature: -280 degC must be more than 0 K",
    ),
    (
        "cutting: {tool: {temperature: 1300 degC}}",
        "1300 degC, expected -73.15 degC to 1226.85 degC",
    ),
    ("cutting: {tool: {material: cheese}}", "'cheese' is unknown, expected one of carbide"),
    ("cutting: {workpiece: cheese}", "workpiece: 'cheese' is unknown, expected one of aisi-1045"),
    ("cutting: {numerics: {cell: 1 m}}", "1000000 um, expected 0.5 um to 43.75 um"),
    ("cutting: {window: {end: 3 mm}}", "window.end: 3 mm is beyond cutting_length, expected up to"),
    (
        "cutting: {window: {start: 1.9 mm, end: 1.8 mm}}",
        "start: 1.9 mm, expected less than end, 1.8 mm",
    ),
    (
        "cutting: {window: {band_duration: 5 us}}",
        "5 us is shorter than the exposure, expected 10 us",
    ),
    ("cutting: 3", "cutting: 3 is not a section, expected keys of speed"),
    ("camera: {band: 5.1-3.8 um}", "camera.band: 5.1-3.8 um is reversed"),
    (
        "{camera: {integration_time: 200 us}, cutting: {window: {start: 1.579 mm, end: 1.958 mm}}}",
        "camera.integration_time: 200 us is longer than the scene, expected up to the 90.96 us",
    ),
    ("camera: {pitch: 2 mm}", "2000 um is larger than the field of view, expected up to the 690"),
    ("camera: {exposure: 10 us}", "unknown key 'exposure', did you mean 'integration_time'"),
    ("camera: {array: 640x512}", "camera.array: '640x512', expected none, or such as [640, 512]"),
    ("camera: {fill_factor: yes}", "camera.fill_factor: True, expected a number"),
    (
        "camera: {psf: {kind: lens}}",
        "kind: 'lens', expected one of annular-aperture, gaussian, airy",
    ),
    ("camera: {psf: {kind: gaussian}}", "camera.psf.fwhm: is missing"),
    ("camera: {psf: {kind: measured, file: no.npy, spacing: 1 um}}", "no.npy: No such file"),
    ("camera: {psf_order: pixels}", "psf_order: 'pixels', expected 'optics' or 'detector'"),
    ("surface: {chips: {}}", "surface: chips: {} is empty, must have a chip"),
    (
        "surface: {chips: {a: chip-3}}",
        "surface.chips.a: 'chip-3' is unknown, expected one of chip-1",
    ),
    ("surface: {chips: {a: chip-1}}", "analysis.rake_chip: 'chip 2' is unknown, expected one of a"),
    ("analysis: {psf_widths: [4]}", "analysis.psf_widths.0: 4 has no unit"),
    (
        "cutting: {tool: {chamfer: {width: 10 um, angle: 20 deg}}}",
        "chamfer width: more than 17.53 um",
    ),
    (
        "cutting: {tool: {hone: {rake: 40 um, clearance: 20 um}, edge_radius: 5 um}}",
        "edge_radius: cannot be combined with hone, give only one of them",
    ),
    (
        "cutting: {tool: {outline: none.csv}}",
        "none.csv: No such file or directory, expected a file",
    ),
    ("- 1", "[1] is not a section"),
    ("a: [1,", "line 1, column 7: "),
    ("seed: 1\nseed: 2", "line 2, column 1: duplicate key 'seed'"),
    ("x: !!python/object/apply:os.system [ls]", "could not determine a constructor"),
    ("seed: 2026-13-45", "month must be in 1..12, expected YAML"),
    (b"\x89HDF\r\n\x1a\n\xff\xfe", "expected text in UTF-8"),
    ("seed: 1\n" + 1_000_000 * "#", "expected a text of up to 1000 kB"),
]


@pytest.mark.parametrize(("text", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_bad_input_is_one_line_with_file_field_value_and_expectation(text, message, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DescriptionError) as caught:
        load_study(path)
    line = str(caught.value)
    assert "\n" not in line and "study.yaml: " in line and message in line


TEMPLATE = [line for line in study_text(Study()).splitlines() if line.strip()[:1] not in ("", "#")]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    number=st.integers(0, len(TEMPLATE) - 1),
    text=st.text(max_size=12)
    | st.sampled_from(["-1", "none", "{a: 1}", "{{a: 1}: 2}", "[1 um]", "*a", "!!", "1e400 m"]),
    value=st.booleans(),
)
def test_a_study_with_a_garbled_line_is_read_or_refused_in_one_line(number, text, value, tmp_path):
    line = f"{TEMPLATE[number].split(':')[0]}: {text}" if value else text
    try:
        load("\n".join([*TEMPLATE[:number], line, *TEMPLATE[number + 1 :]]), tmp_path)
    except DescriptionError as error:
        assert len(str(error).splitlines()) == 1


def test_a_mark_of_the_order_of_bytes_is_no_part_of_the_study(tmp_path):
    (tmp_path / "study.yaml").write_text("seed: 3\n", encoding="utf-8-sig")
    assert load_study(tmp_path / "study.yaml").seed == 3


def test_an_empty_section_means_the_defaults(tmp_path):
    assert load("surface:\n", tmp_path) == Study()
    assert load("camera:\nanalysis:\n", tmp_path) == Study()


def test_numbers_may_be_whole_or_have_an_exponent(tmp_path):
    study = load("cutting: {numerics: {mass_scaling: 1e2}, friction: {coefficient: 1}}", tmp_path)
    assert study.cutting.numerics.mass_scaling == 100.0
    assert load("camera: {pitch: 7e-06 m}", tmp_path).camera.pitch == 7e-6
    assert study.cutting.friction.coefficient == 1.0


def test_none_means_none(tmp_path):
    study = load("camera: {psf: none, lower_limit: none}", tmp_path)
    camera = study.camera.build()
    assert camera.psf is None
    assert camera.lower_limit is None
    assert load(study_text(study), tmp_path) == study


def test_other_kinds_of_psf_are_built_and_written(tmp_path):
    gaussian = load("camera: {psf: {kind: gaussian, fwhm: 12 um}}", tmp_path)
    assert gaussian.camera.build().psf == GaussianPSF(12e-6)
    assert load(study_text(gaussian), tmp_path) == gaussian
    np.save(tmp_path / "psf.npy", np.ones((3, 3)))
    measured = load("camera: {psf: {kind: measured, file: psf.npy, spacing: 2 um}}", tmp_path)
    assert isinstance(measured.camera.build().psf, MeasuredPSF)
    # As run, the study names the file's whole path: it can be run from any folder.
    assert measured.camera.psf.file == str(tmp_path / "psf.npy")
    assert load(study_text(measured), tmp_path) == measured


@pytest.fixture
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("CHIPGLOW_CACHE", str(folder))
    return folder


@pytest.fixture
def runs(monkeypatch):
    """The cutting simulation replaced by three frames of a chip in closed form."""
    return replace_cut(monkeypatch, AnalyticChip(frames=3).scene())


def small_study(**cutting):
    return Study(cutting={"field_of_view": AnalyticChip().field_of_view, **cutting})


def test_a_scene_is_computed_once_for_the_same_inputs(cache, runs):
    study = small_study()
    assert not is_cut(study)
    seen = []
    path = cut(study, lambda step, fraction: seen.append((step, fraction)))
    assert seen == [("cutting simulation", 0.0), ("cutting simulation", 1.0)]
    assert path.parent == cache
    assert is_cut(study)
    other_camera = replace(study, camera=Study(camera={"pitch": "5 um"}).camera)
    assert cut(study) == cut(other_camera) == path
    assert len(runs) == 1
    scene = open_scene(path)
    assert scene.tool == ToolGeometry()
    assert len(scene.times) == 3
    np.testing.assert_array_equal(scene.data["cutting_force"], AnalyticChip().forces()[1])


@pytest.mark.parametrize(
    "change",
    [
        {"speed": "251 m/min"},
        {"friction": {"coefficient": 0.51}},
        {"numerics": {"cell": "11 um"}},
        {"window": {"interval": "0.3 us"}},
        {"tool": {"edge_radius": "21 um"}},
        {"tool": {"chamfer": {"width": "100 um", "angle": "20 deg"}}},
        {"tool": {"hone": {"rake": "40 um", "clearance": "20 um"}}},
    ],
)
def test_another_cut_is_another_scene(cache, runs, change):
    assert cut(small_study()) != cut(small_study(**change))
    assert len(runs) == 2


OUTLINE = "x_um,y_um\n0,500\n0,20\n20,0\n600,60\n"


def test_a_tool_with_a_prepared_edge_is_built_and_written(tmp_path):
    chamfered = load(
        "cutting: {tool: {chamfer: {width: 0.1 mm, angle: 20 deg}, edge_radius: 5 um}}", tmp_path
    )
    assert chamfered.cutting.simulation().tool == ToolGeometry(
        edge_radius=5e-6, chamfer=Chamfer(1e-4, radians(20))
    )
    honed = load("cutting: {tool: {hone: {rake: 40 um, clearance: 20 um}}}", tmp_path)
    assert honed.cutting.simulation().tool == ToolGeometry(hone=Hone(40e-6, 20e-6))
    (tmp_path / "edge.csv").write_text(OUTLINE)
    measured = load("cutting: {tool: {outline: edge.csv}}", tmp_path)
    assert measured.cutting.simulation().tool == read_tool_outline(tmp_path / "edge.csv")
    for study in (chamfered, honed, measured):
        assert load(study_text(study), tmp_path) == study
    with pytest.raises(DescriptionError, match="rake_angle: cannot be combined with outline"):
        load("cutting: {tool: {outline: edge.csv, rake_angle: 5 deg}}", tmp_path)


def test_a_scene_is_found_by_the_points_of_the_outline_not_by_its_files_name(cache, runs, tmp_path):
    paths = []
    for name, text in (
        ("a.csv", OUTLINE),
        ("b.csv", OUTLINE),
        ("b.csv", OUTLINE.replace("20,0", "25,0")),
    ):
        (tmp_path / name).write_text(text)
        paths.append(cut(small_study(tool={"outline": str(tmp_path / name)})))
    assert paths[0] == paths[1] != paths[2]
    assert len(runs) == 2
    assert open_scene(paths[2]).tool == read_tool_outline(tmp_path / "b.csv")
    assert cut(small_study()) not in paths


def test_another_solver_is_another_scene(cache, runs, monkeypatch):
    first = cut(small_study())
    monkeypatch.setattr("chipglow.study.running.SOLVER_VERSION", "next")
    assert cut(small_study()) != first


def test_the_cache_is_listed_and_cleared(cache, runs):
    assert cached_scenes() == []
    assert clear_cache() == 0
    paths = {cut(small_study()), cut(small_study(speed="251 m/min"))}
    scenes = cached_scenes()
    assert {scene.path for scene in scenes} == paths
    assert all(scene.size == scene.path.stat().st_size for scene in scenes)
    (cache / "notes.txt").write_text("not a scene")
    assert clear_cache() == sum(scene.size for scene in scenes)
    assert [path.name for path in cache.iterdir()] == ["notes.txt"]


def test_what_ended_runs_left_is_cleared_and_what_runs_stays(cache):
    cache.mkdir()
    part = cache / ".scene-ended.0123abcd.part"
    for path in (part, part.with_suffix(".npz"), cache / ".scene-other.89ab4567.npz"):
        path.write_bytes(b"x" * 10)
    with atomic_path(cache / "scene-running.nc") as running:
        running.write_bytes(b"x" * 10)
        assert [scene.path for scene in cached_scenes()] == [part]
        assert clear_cache() == 20
        assert list(cache.iterdir()) == [running]
    assert clear_cache() == 10


def test_runs_at_the_same_time_leave_one_whole_scene(cache, runs):
    barrier, found = threading.Barrier(2), []

    def work():
        barrier.wait()
        found.append(cut(small_study()))

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(found)) == 1
    assert is_cut(small_study())
    assert [Path(path) for path in cache.iterdir()] == [found[0]]


def test_a_scene_without_tool_and_coordinates_is_fitted_and_says_so():
    whole = AnalyticChip(frames=2).scene()
    untouched = fit(Study(), whole)
    assert untouched.scene is whole
    assert untouched.notes.assumed == []
    fields = {name: whole.data[name].values for name in FIELD_UNITS}
    fields["material"] = np.where(fields["material"] == Material.TOOL, Material.VOID, 1)
    bare = Scene.from_fields(whole.raster, whole.times, fields)
    fitted = fit(Study(cutting={"tool": {"rake_angle": "5 deg"}}), bare)
    assert fitted.scene.tool == ToolGeometry(rake_angle=radians(5.0))
    assert bare.tool is None
    assert [surface.follow for surface in fitted.surfaces.values()] == ["mean", "mean"]
    assert [sentence[:23] for sentence in fitted.notes.assumed] == [
        "The scene has no tool: ",
        "The scene shows no tool",
        "The scene does not stat",
    ]


def test_a_scene_without_coordinates_is_fitted_under_what_is_seen_over_a_surface():
    whole = AnalyticChip(frames=2).scene()
    fields = {name: whole.data[name].values for name in FIELD_UNITS}
    scene = Scene.from_fields(whole.raster, whole.times, fields, whole.tool)
    law = {"kind": "fresnel", "n": 4.6, "k": 15}
    study = Study(surface={"directional": law, "reflections": {"kind": "wedge"}})
    for surface in fit(study, scene).surfaces.values():
        assert len(surface.modifiers) == 2
        assert surface.bare.follow == "mean"


def test_where_an_emissivity_was_measured_is_said(monkeypatch):
    scene = AnalyticChip(frames=2).scene()
    for measured, said in (((650.0, 850.0), "at 377 °C to 577 °C"), ((650.0, 650.0), "the same")):
        trend = EmissivityTrend(750.0, 0.5, measured=measured)
        for surface in (TrendSurface(trend), CHIP_1.modified(FeatureTrends({"chip": trend}))):
            found = {"heated": surface.modified(Wedge())}
            monkeypatch.setattr("chipglow.study.fitting.surfaces_of", lambda *_, of=found: of)
            (sentence,) = fit(Study(), scene).notes.assumed
            assert sentence.startswith("The emissivity of 'heated' was measured at 377 °C")
            assert said in sentence


def test_what_an_emissivity_map_leaves_of_the_scene_is_said():
    scene = AnalyticChip(frames=2).scene()
    raster = scene.raster
    half = Raster(raster.left, raster.top, raster.spacing, raster.rows, raster.columns // 2)
    away = replace(raster, left=raster.left + 1e-3)
    maps = {
        name: MapSurface(np.full(of.shape, 0.5), of)
        for name, of in (("whole", raster), ("half", half), ("away", away))
    }
    assert maps["whole"].known_fraction(raster) == 1.0
    # Beside its last pixel a map is interpolated, at most one sample far.
    assert maps["half"].known_fraction(raster) == pytest.approx(0.5, abs=1.5 / raster.columns)
    assert list(uncovered({"whole": maps["whole"]}, raster)) == []
    (sentence,) = uncovered({"half": maps["half"]}, raster)
    assert sentence.startswith("The emissivity map 'half' covers 50")
    assert "elsewhere its emissivity is 0" in sentence
    with pytest.raises(ValueError, match=r"the map 'away' lies at x .* expected the scene's"):
        list(uncovered({"away": maps["away"]}, raster))
