"""The report: every file is there, the numbers are strict, the page stands alone."""

import json
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from analytic_chip import AnalyticChip

from chipglow.analysis import PAPER, Inertia, Line, Plan, analyse
from chipglow.camera import Camera
from chipglow.report import Row, comparison_rows, write_report
from chipglow.report.chip import chip_rows
from chipglow.report.evidence import crossing
from chipglow.surface import CHIP_1, CHIP_2

STUDY = "cutting:\n  speed: 250 m/min  # <script>alert('&')</script>\n"
PROVENANCE = {"Study": "<b>the paper's</b>", "Version": "0.0", "Seed": "1"}
FIGURES = {
    "fields",
    "measurement",
    "band-curves",
    "error-images",
    "error-lines",
    "psf-sensitivity",
    "psf",
    "forces",
    "chip",
}


@pytest.fixture(scope="module")
def result():
    return analyse(
        AnalyticChip(frames=60).scene(),
        {"chip 1": CHIP_1, "chip 2": CHIP_2},
        Camera(psf_order="sensor"),
        Plan(instants=3, psf_widths=(4e-6, 12e-6, 20e-6)),
    )


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    assert write_report(result, folder, STUDY, PROVENANCE) == folder / "report.html"
    return folder


class Page(HTMLParser):
    """Checks that tags close in order, and gathers what a reader sees."""

    VOID = frozenset({"meta", "img", "br", "link"})

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text, self.sources = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        self.sources += [value for name, value in attrs if name in ("src", "href")]
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
    assert "script" not in page.seen and "b" not in page.seen
    shown = "".join(page.text)
    assert STUDY in shown
    for value in PROVENANCE.values():
        assert value in shown
    for row in comparison_rows(result):
        for part in (row.quantity, row.paper_text, row.here_text, row.explanation):
            assert part in shown
    for number in (5, 6, 9, 10, 11):
        assert f"Figure {number}" in shown
    chip = chip_rows(result.chip)
    for line in chip:
        for part in (line.quantity, line.value_text, line.spread_text, line.explanation):
            assert part in shown
    assert page.seen.count("tr") == 2 + len(comparison_rows(result)) + len(chip)


def test_inertia_that_is_too_much_is_said(result):
    def rows(share):
        inert = Inertia(kinetic_share=share, force_share=0.004, mass_scaling=300.0)
        found = comparison_rows(replace(result, forces=replace(result.forces, inertia=inert)))
        return {row.key: row for row in found}

    assert rows(0.02)["kinetic_share_percent"].here_text == "2.00 %"
    assert "lower mass_scaling, now 300" in rows(0.02)["kinetic_share_percent"].explanation
    assert "lower" not in rows(0.009)["kinetic_share_percent"].explanation
    assert rows(0.009)["inertia_force_share_percent"].here_text == "0.40 %"
    assert "1/300 of it" in rows(0.009)["inertia_force_share_percent"].explanation


def test_the_summary_is_strict_json(folder, result):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    text = (folder / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=refuse)
    assert summary["provenance"] == PROVENANCE
    assert summary["results"]["rake_error_degC"] == result.rake.error
    assert summary["results"]["band_error_degC"] == result.band_errors.error
    assert summary["paper"]["rake_error_degC"] == -42.0
    assert summary["difference"]["rake_error_degC"] == result.rake.error + 42.0
    assert set(summary["explanation"]) == set(summary["results"])
    assert summary["chip"]["feed_um"] == pytest.approx(result.chip.feed * 1e6)
    assert set(summary["chip_spread"]) <= set(summary["chip"])


def test_the_arrays_come_back_with_units(folder, result):
    with xr.open_dataset(folder / "results.nc", engine="h5netcdf") as data:
        surface = result.surfaces["chip 2"]
        stored = data.sel(surface="chip 2")
        np.testing.assert_array_equal(stored["error_case_1"], surface.errors.case_1)
        np.testing.assert_array_equal(stored["rake_error"], surface.rake.case_1)
        np.testing.assert_array_equal(data["temperature"], result.frame.temperature)
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
        "rake_psf_share_percent": 45.0,
        "band_error_degC": -46.0,
        "band_psf_share_percent": 15.0,
        "band_worst_error_degC": -120.0,
        "segment_period_us": pytest.approx(90.0),
    }
    assert rows["segment_period_us"].here == pytest.approx(72.0, rel=0.02)
    assert rows["band_width_um"].here == pytest.approx(20.0, rel=0.05)
    assert rows["contact_length_um"].paper_text == "–"
    assert all(row.explanation.endswith(".") for row in rows.values())
    assert PAPER.rake_error.where in rows["rake_error_degC"].where


def test_a_band_that_begins_away_from_the_edge_is_as_long_as_itself(result):
    whole = result.band
    ridge = Line(whole.ridge.distance[20:], whole.ridge.points[20:])
    values = {name: getattr(whole, name)[20:] for name in ("normals", "rate", "widths")}
    instants = list(result.instants)
    instants[result.developed] = replace(
        instants[result.developed], band=replace(whole, ridge=ridge, **values)
    )
    shorter = replace(result, instants=tuple(instants))
    row = next(r for r in comparison_rows(shorter) if r.key == "band_length_um")
    begins = whole.ridge.distance[20]
    assert row.here == pytest.approx(1e6 * (whole.ridge.distance[-1] - begins))
    assert f"begins {1e6 * begins:.0f} µm from the cutting edge" in row.explanation


def test_numbers_are_printed_with_sign_unit_and_dash():
    row = Row("error_degC", "Error", "°C", -42.0, -35.4, 0, "Why.")
    assert (row.paper_text, row.here_text, row.difference_text) == ("−42 °C", "−35 °C", "+7 °C")
    rate = Row("rate_per_s", "Rate", "1/s", None, 123456.0, -3, "Why.")
    assert (rate.paper_text, rate.here_text) == ("–", "123 000 1/s")
    assert rate.difference is None and rate.difference_text == "–"


def test_a_width_is_found_where_the_series_meets_the_value():
    widths = np.array([4.0, 8.0, 12.0])
    assert crossing(widths, np.array([-10.0, -30.0, -50.0]), -40.0) == pytest.approx(10.0)
    assert crossing(widths, np.array([-10.0, -30.0, -50.0]), -10.0) == 4.0
    assert crossing(widths, np.array([-10.0, -30.0, -50.0]), -60.0) is None


def test_what_is_missing_is_left_out_and_unknown_is_null(result, tmp_path):
    bare = replace(
        result, forces=None, camera=replace(result.camera, psf=None, floor=None), sweep=float("nan")
    )
    write_report(bare, tmp_path, STUDY, PROVENANCE)
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == FIGURES - {"psf", "forces"}
    assert "segment_period_us" not in {row.key for row in comparison_rows(bare)}
    still = replace(result.forces.segmentation, period=float("nan"))
    unknown = replace(result, forces=replace(result.forces, segmentation=still))
    row = next(r for r in comparison_rows(unknown) if r.key == "segment_period_us")
    assert row.here is None and row.here_text == "–"
    assert "no period" in row.explanation
