"""The report: every file is there, the numbers are strict, the page stands alone."""

import json
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from analytic_chip import AnalyticChip

from chipglow.camera import Camera
from chipglow.errors import Distribution, Plan, analyse
from chipglow.errors.draws import CAUSES
from chipglow.laboratory.chip import Inertia, rake_grid
from chipglow.report import Row, comparison_frame, comparison_rows, write_report
from chipglow.report.chip_rows import chip_rows
from chipglow.report.comparison import cause_rows
from chipglow.report.evidence import answer, crossing, place
from chipglow.report.paper import PAPER, TABLE_1, table_1, table_2
from chipglow.report.visible import visible_picture
from chipglow.scene import Line, Material
from chipglow.study import Study
from chipglow.surface import CHIP_1, CHIP_2

TITLE = "My <i>own</i> study"
REMARKS = ["Assumed: the moon is made of <b>cheese</b>."]
STUDY = "cutting:\n  speed: 250 m/min  # <script>alert('&')</script>\n"
PROVENANCE = {"Study": "<b>the paper's</b>", "Version": "0.0", "Seed": "1"}
PAPER_FIGURES = {
    "figure-2-psf": "Figure 2",
    "figure-3-heated-chips": "Figure 3",
    "figure-4-heated-tool": "Figure 4",
    "figure-5-scene": "Figure 5",
    "figure-6-measurement": "Figure 6",
    "figure-7-rake-profiles": "Figure 7",
    "figure-8-dual-spectrum": "Figure 8",
    "figure-9-band-curves": "Figure 9",
    "figure-10-error-images": "Figure 10",
    "figure-11-error-lines": "Figure 11",
}
FIGURES = {*PAPER_FIGURES, "psf-sensitivity", "forces", "chip-thickness"}
SETTINGS = table_2(Study())


@pytest.fixture(scope="module")
def result():
    return analyse(
        AnalyticChip(frames=60).scene(),
        {"chip 1": CHIP_1, "chip 2": CHIP_2},
        Camera(psf_order="detector"),
        Plan(exposures=3, phases=2, textures=2, psf_widths=(4e-6, 12e-6, 20e-6), study=Study()),
    )


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    report = write_report(result, folder, TITLE, STUDY, PROVENANCE, REMARKS, SETTINGS)
    assert report == folder / "report.html"
    return folder


class Page(HTMLParser):
    """Checks that tags close in order, and gathers what a reader sees."""

    VOID = frozenset({"meta", "img", "br", "link"})

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text, self.sources = [], [], [], []
        self.ids, self.alts = [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        self.sources += [value for name, value in attrs if name in ("src", "href")]
        self.ids += [value for name, value in attrs if name == "id"]
        self.alts += [value for name, value in attrs if name == "alt"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_every_figure_is_there_as_picture_and_as_drawing(folder):
    pictures = folder / "figures"
    assert {path.name for path in pictures.iterdir()} == {
        f"{name}.{kind}" for name in FIGURES for kind in ("png", "svg")
    }
    for path in pictures.iterdir():
        content = path.read_bytes()
        assert len(content) > 5000
        if path.suffix == ".png":
            assert content.startswith(b"\x89PNG")
        else:
            assert ElementTree.fromstring(content).tag.endswith("svg")


def test_the_page_stands_alone_and_escapes_text(folder, result):
    text = (folder / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    assert page.seen.count("img") == len(FIGURES)
    assert all(s.startswith(("data:image/png;base64,", "#")) for s in page.sources)
    assert not {"script", "b", "i"} & set(page.seen)
    shown = "".join(page.text)
    assert STUDY in shown
    for value in (*PROVENANCE.values(), *REMARKS, *answer(result)):
        assert value in shown
    rows, causes, chip = comparison_rows(result), cause_rows(result), chip_rows(result.chip)
    for row in rows:
        for part in (row.quantity, row.paper_text, row.here_text, row.range_text, row.explanation):
            assert part in shown
    for row in causes:
        assert all(text in shown for text in row.texts)
    headings = [f"{number}:" for number in PAPER_FIGURES.values()]
    headings.insert(2, "Table 1:")
    headings.insert(4, "Table 2:")
    places = [shown.index(heading) for heading in headings]
    assert places == sorted(places)
    tables = table_1(result)
    for setting in SETTINGS:
        assert all(text in shown for text in setting)
    for line in chip:
        for part in (line.quantity, line.value_text, line.spread_text, line.explanation):
            assert part in shown
    # Explanations have rows of their own.
    count = 5 + 2 * len(rows) + len(causes) + 2 * len(chip) + len(tables) + len(SETTINGS)
    assert page.seen.count("tr") == count


def test_the_study_heads_the_page_and_the_answer_comes_first(folder, result):
    page = Page((folder / "report.html").read_text(encoding="utf-8"))
    shown = "".join(page.text)
    assert shown.count(TITLE) == 2
    places = [shown.index(text) for text in (TITLE, answer(result)[0], REMARKS[0], "0.0")]
    assert places == sorted(places)
    assert shown.index(PROVENANCE["Study"]) > shown.index(answer(result)[-1])


def test_every_id_is_there_once_and_every_picture_is_described(folder, result):
    page = Page((folder / "report.html").read_text(encoding="utf-8"))
    assert len(set(page.ids)) == len(page.ids)
    linked = {source[1:] for source in page.sources if source.startswith("#")}
    assert linked <= set(page.ids)
    assert len(page.alts) == len(FIGURES)
    assert all(len(alt) > 80 and alt.endswith(".") for alt in page.alts)


def test_the_answer_states_scatter_and_whether_the_paper_differs(result):
    sentences = answer(result)
    error = result.draws.headlines["rake"].error
    assert f"{-error.mean:.0f} ± {error.standard_deviation:.0f} °C" in sentences[0]
    assert "8 draws" in sentences[0]
    for sentence in sentences:
        assert ("lies within this scatter" in sentence) != ("lies outside this scatter" in sentence)


def test_inertia_that_is_too_much_is_said(result):
    def rows(fraction):
        inert = Inertia(kinetic_fraction=fraction, force_fraction=0.004, mass_scaling=300.0)
        found = comparison_rows(replace(result, forces=replace(result.forces, inertia=inert)))
        return {row.key: row for row in found}

    assert rows(0.02)["kinetic_fraction_percent"].here_text == "2.00 %"
    assert "lower mass_scaling, now 300" in rows(0.02)["kinetic_fraction_percent"].explanation
    assert "lower" not in rows(0.009)["kinetic_fraction_percent"].explanation
    assert rows(0.009)["inertia_force_fraction_percent"].here_text == "0.40 %"
    assert "1/300 of it" in rows(0.009)["inertia_force_fraction_percent"].explanation


def test_the_summary_is_strict_json(folder, result):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    text = (folder / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=refuse)
    assert summary["provenance"] == PROVENANCE
    for name, one in (("rake", result.rake.face), ("band", result.band_errors.centre)):
        error = result.draws.headlines[name].error
        key = f"{name}_error_degC"
        assert summary["results"][key] == summary["draws"][key]["mean"] == error.mean
        assert summary["draws"][key]["standard_deviation"] == error.standard_deviation
        assert summary["draws"][key]["count"] == 8
        assert summary["one_draw"][key] == one.error
        parts = summary["causes"][key]
        assert list(parts) == ["segment", "texture", "pixel phase", "causes together"]
        assert sum(part["fraction_percent"] for part in parts.values()) == pytest.approx(100.0)
    assert summary["paper"]["rake_error_degC"] == -42.0
    low, high = (summary["draws"]["rake_error_degC"][f"interval_{end}"] for end in ("low", "high"))
    assert summary["differs"]["rake_error_degC"] is not (low <= -42.0 <= high)
    assert set(summary["explanation"]) == set(summary["results"])
    assert summary["chip"]["feed_um"] == pytest.approx(result.chip.feed * 1e6)
    assert set(summary["chip_uncertainty"]) <= set(summary["chip"])


def test_the_arrays_come_back_with_units(folder, result):
    with xr.open_dataset(folder / "results.nc", engine="h5netcdf") as data:
        surface = result.surfaces["chip 2"]
        stored = data.sel(surface="chip 2")
        np.testing.assert_array_equal(stored["error_case_1"], surface.errors.case_1)
        np.testing.assert_array_equal(stored["rake_error"], surface.rake.case_1)
        np.testing.assert_array_equal(data["temperature"], result.frame.temperature)
        drawn = result.draws.headlines["band_measured"].psf_portion.values
        np.testing.assert_array_equal(data["draws_band_measured_psf_portion"], drawn)
        np.testing.assert_array_equal(data["draws_rake_line_case_1"], result.draws.rake_line.case_1)
        curve = surface.curves[1]
        np.testing.assert_array_equal(stored["ridge_radiance_temperature"][1, : curve.size], curve)
        assert data.sizes["instant"] == len(result.instants)
        assert data["psf_width"].values.tolist() == [4e-6, 12e-6, 20e-6]
        for name in data.data_vars:
            assert "units" in data[name].attrs, name
        assert data.attrs["developed_instant"] == result.developed


def test_the_study_is_kept_as_run(folder):
    assert (folder / "study.yaml").read_text(encoding="utf-8") == STUDY


def test_the_comparison_holds_what_the_paper_states(result):
    rows = {row.key: row for row in comparison_rows(result)}
    paper = {key: row.paper for key, row in rows.items() if row.paper is not None}
    assert paper == {
        "rake_error_degC": -42.0,
        "rake_psf_fraction_percent": 45.0,
        "rake_extremum_error_degC": -42.0,
        "rake_extremum_psf_fraction_percent": 45.0,
        "band_error_degC": -46.0,
        "band_psf_fraction_percent": 15.0,
        "band_measured_error_degC": -46.0,
        "band_measured_psf_fraction_percent": 15.0,
        "band_worst_error_degC": -120.0,
        "segment_period_us": pytest.approx(90.0),
    }
    assert rows["segment_period_us"].here == pytest.approx(72.0, rel=0.02)
    assert rows["band_width_um"].here == pytest.approx(20.0, rel=0.05)
    assert rows["contact_length_um"].paper_text == "–"
    assert all(row.explanation.endswith(".") for row in rows.values())
    assert PAPER.rake_error.where in rows["rake_error_degC"].where
    frame = comparison_frame(result)
    assert list(frame.index) == list(rows)
    assert frame["paper"].dropna().to_dict() == paper
    draws = rows["rake_error_degC"].draws
    error = frame.loc["rake_error_degC"]
    assert (error["least"], error["greatest"]) == draws.range
    assert error["standard_deviation"] == draws.standard_deviation


def test_a_band_that_begins_away_from_the_edge_is_as_long_as_itself(result):
    whole = result.band
    ridge = Line(whole.ridge.distance[20:], whole.ridge.points[20:])
    values = {name: getattr(whole, name)[20:] for name in ("normals", "rate", "widths")}
    segment = replace(result.segment, band=replace(whole, ridge=ridge, **values))
    shorter = replace(result, segments=(segment,))
    row = next(r for r in comparison_rows(shorter) if r.key == "band_length_um")
    begins = whole.ridge.distance[20]
    assert row.here == pytest.approx(1e6 * (whole.ridge.distance[-1] - begins))
    assert f"begins {1e6 * begins:.0f} µm from the cutting edge" in row.explanation


def test_numbers_are_printed_with_sign_unit_and_dash():
    row = Row("error_degC", "Error", "°C", -42.0, -35.4, 0, "Why.", uncertainty=3.1)
    assert (row.paper_text, row.here_text) == ("−42 °C", "−35 ± 3 °C")
    assert (row.differs, row.differs_text, row.range_text) == (True, "yes", "–")
    assert replace(row, uncertainty=3.4).differs is False
    rate = Row("rate_per_s", "Rate", "1/s", None, 123456.0, -3, "Why.")
    assert (rate.paper_text, rate.here_text) == ("–", "123 000 1/s")
    assert rate.differs is None and rate.differs_text == "–"
    draws = Distribution(np.array([[[-30.0, -50.0, -40.0, -44.0]]]), CAUSES)
    drawn = replace(row, here=draws.mean, draws=draws, one_draw=-30.0, uncertainty=None)
    assert (drawn.here_text, drawn.range_text) == ("−41 ± 8 °C", "−50 to −30")
    assert (drawn.one_draw_text, drawn.differs_text) == ("−30 °C", "no")


def test_the_place_of_the_papers_figure_is_stated():
    draws = Distribution(np.array([[[-30.0, -50.0, -40.0, -44.0]]]), CAUSES)
    near, far = (place(draws, paper, "°C") for paper in (-42.0, -120.0))
    assert near.startswith("50 % of our 4 draws are lower than the paper's figure")
    assert near.endswith("does not differ.") and far.endswith("the paper's differs.")
    single = Distribution(np.full((1, 1, 1), -40.0), CAUSES)
    assert "does not say whether" in place(single, -42.0, "°C")


def test_a_width_is_found_where_the_series_meets_the_value():
    widths = np.array([4.0, 8.0, 12.0])
    assert crossing(widths, np.array([-10.0, -30.0, -50.0]), -40.0) == pytest.approx(10.0)
    assert crossing(widths, np.array([-10.0, -30.0, -50.0]), -10.0) == 4.0
    assert crossing(widths, np.array([-10.0, -30.0, -50.0]), -60.0) is None


def test_what_is_missing_is_left_out_and_unknown_is_null(result, tmp_path):
    still = tuple(replace(segment, sweep=float("nan")) for segment in result.segments)
    ideal = replace(result.camera, psf=None, lower_limit=None)
    headlines = {name: h for name, h in result.draws.headlines.items() if name != "rake"}
    draws = replace(result.draws, headlines=headlines)
    bare = replace(result, forces=None, camera=ideal, segments=still, draws=draws)
    write_report(bare, tmp_path, TITLE, STUDY, PROVENANCE)
    unseen = next(row for row in comparison_rows(bare) if row.key == "rake_error_degC")
    assert (unseen.here_text, unseen.differs) == ("–", None)
    assert unseen.one_draw == result.rake.face.error
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == FIGURES - {"figure-2-psf", "forces"}
    assert "segment_period_us" not in {row.key for row in comparison_rows(bare)}
    still = replace(result.forces.segmentation, period=float("nan"))
    unknown = replace(result, forces=replace(result.forces, segmentation=still))
    row = next(r for r in comparison_rows(unknown) if r.key == "segment_period_us")
    assert row.here is None and row.here_text == "–"
    assert "no period" in row.explanation


def test_the_papers_emissivities_come_back_from_heated_objects(result):
    """Within what the procedure states, and what the camera's blur is known to do."""
    found = {row.feature: row for heated in result.heated for row in heated.rows}
    assert set(found) == set(TABLE_1)
    for feature, paper in TABLE_1.items():
        row = found[feature]
        assert row.true == paper
        # Few grains of 20 um in a region: the mean of the textures scatters by the deviation over
        # the root of some ten grains. Narrow bands are drawn toward the bodies by up to 0.06.
        spread = 3 * paper.standard_deviation / np.sqrt(10 * row.means.size)
        drawn = 0.06 if "shear band" in feature else 0.02
        assert row.means.mean() == pytest.approx(paper.mean, abs=spread + drawn)
        if "shear band" not in feature:  # whose region holds the slope to the bodies too
            assert (row.deviations < paper.standard_deviation).all()
    for chip in ("chip 1", "chip 2"):
        body, band = found[f"{chip} chip body"].found, found[f"{chip} shear band"].found
        assert band.mean > body.mean + 2 * band.estimate.standard_uncertainty


def test_profiles_beside_the_rake_face_are_those_of_the_laboratory(result):
    surface = result.surfaces["chip 2"]
    grid = rake_grid(surface.measurement, result.tool)
    np.testing.assert_array_equal(surface.rake_grid.frame_mean, grid.frame_mean)
    assert surface.rake_grid.times.size == len(result.instants)


def test_the_visible_picture_shows_tool_and_bands(result):
    grey = visible_picture(result.frame, result.raster)
    material, strain = result.frame.material, result.frame.plastic_strain
    assert (grey[material == Material.TOOL] == 0.0).all()
    steel = material == Material.WORKPIECE
    assert grey.min() >= 0.0 and grey.max() <= 1.0
    low, high = grey[steel & (strain < 1.0)].mean(), grey[steel & (strain > 2.0)].mean()
    assert high < low


def test_table_2_says_what_the_study_sets():
    rows = {name: (paper, here) for name, paper, here in SETTINGS}
    for name in ("Feed", "Cutting speed", "Rake angle", "Clearance angle", "Edge radius"):
        assert rows[name][0] == rows[name][1], name
    other = table_2(Study(cutting={"feed": "0.1 mm", "tool": {"rake_angle": "6 deg"}}))
    assert ("Feed", "0.3 mm", "0.1 mm") in other
    assert ("Rake angle", "−7°", "6°") in other
