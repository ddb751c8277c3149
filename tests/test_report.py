"""The report: every file is there, the numbers are strict, the page stands alone."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
import xarray as xr
from PIL import Image

from chipglow.analysis import Distribution, one_draw, with_errors
from chipglow.io import open_scene
from chipglow.report import Row, result_rows, results_frame, write_report
from chipglow.report.answer import answer, error_text
from chipglow.report.facts import Facts
from chipglow.report.figures import exposure
from chipglow.report.paper import PAPER, TABLE_1, PaperValue, crossing, position, table_2
from chipglow.report.rows import all_rows, spread_text
from chipglow.report.summary import summary
from chipglow.scene import SceneError
from chipglow.study import Study

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
FIGURES = {
    *PAPER_FIGURES, "exposure", "psf-sensitivity", "forces", "chip-thickness",
    "attribution", "attribution-lines",
}  # fmt: skip
PAPERS = Study()
CAUSES = ("segment", "texture", "pixel phase")
SETTINGS = table_2(PAPERS.cutting)


@pytest.fixture(scope="module")
def result(chip_analysis):
    return chip_analysis


@pytest.fixture(scope="module")
def facts(result):
    return Facts(result, PAPERS)


def of_cut(result, **changes):
    return replace(result, cut=replace(result.cut, **changes))


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    path = write_report(result, folder, TITLE, STUDY, PROVENANCE, REMARKS, PAPERS)
    assert path == folder / "report.html"
    return folder


class Page(HTMLParser):
    """Checks that tags close in order, and gathers what a reader sees."""

    VOID = frozenset({"meta", "img", "br", "link", "input", "source"})

    def __init__(self, text):
        super().__init__()
        self.open, self.seen, self.text, self.sources = [], [], [], []
        self.ids, self.alts, self.sections, self.cells = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        attrs = dict(attrs)
        self.sources += [attrs[name] for name in ("src", "href") if name in attrs]
        self.ids += [attrs["id"]] if "id" in attrs else []
        self.alts += [attrs["alt"]] if tag == "img" else []  # KeyError: a picture without
        self.sections += [attrs["id"]] if tag == "section" else []
        if tag == "td":
            self.cells.append([attrs, ""])
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        data = data.replace("\u00a0", " ")  # no line ends before a unit
        self.text.append(data)
        if "td" in self.open:
            self.cells[-1][1] += data


@pytest.fixture(scope="module")
def page(folder):
    return Page((folder / "report.html").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_columns_of_panels_are_separate_images_that_together_show_the_figure(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    for name, columns in (
        ("figure-10-error-images", 2),
        ("figure-11-error-lines", 2),
        ("figure-2-psf", 2),
    ):
        figure = text.partition(f'<figure id="{name}">')[2].partition("</figure>")[0]
        data = re.findall('data:image/png;base64,([^"]+)"[^>]* flex:', figure)
        images = [Image.open(BytesIO(b64decode(one))) for one in data]
        whole = Image.open(folder / "figures" / f"{name}.png")
        assert len(images) == columns and sum(one.width for one in images) == whole.width
        left, top = 0, int(np.flatnonzero((np.asarray(whole.convert("L")) < 255).any(axis=1))[0])
        for image in images:
            part = whole.crop((left, top, left + image.width, top + image.height))
            assert image.tobytes() == part.tobytes()
            edge = np.asarray(image.convert("L"))[:, 0]
            assert (edge == 255).all()  # no panel or label is cut
            left += image.width


def test_the_page_describes_the_camera(facts, page):
    text = " ".join(" ".join(page.text).split())
    for said in (
        "Spectral band 3.8 to 5.1 µm", "µm on the scene", "Exposure 10 µs at 600 Hz",
        "Range from 300 °C", "Emissivity of chip 2",
    ):  # fmt: skip
        assert said in text
    assert str(facts.analysis.camera.psf) in text.replace("\u00a0", " ")


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


def test_the_page_stands_alone_and_escapes_text(page, result, facts):
    assert page.open == []
    inside = ("data:image/png;base64,", "#", "study.yaml")
    assert all(source.startswith(inside) for source in page.sources)
    assert page.seen.count("script") == 1 and not {"b", "i", "link"} & set(page.seen)
    shown = "".join(page.text)
    for value in (*PROVENANCE.values(), *REMARKS, *sentences_of(facts)):
        assert value in shown
    rows = all_rows(facts)
    for row in (*rows["errors"], *rows["cut"], *rows["chip"]):
        causes = () if row.unit != "K" else row.draws.parts if row.draws else ()
        names = ("quantity", "paper", "mean", "interval", "one-draw", *causes)
        assert all(row.cells[name] in shown for name in names) and row.explanation in shown
    headings = [f"{number}:" for number in PAPER_FIGURES.values()] + ["Table 1:", "Table 2:"]
    places = [shown.index(heading) for heading in headings]
    assert places == sorted(places)
    for feature, published in TABLE_1.items():
        assert feature in shown
        assert f"{published.mean:.2f} ± {published.standard_deviation:.2f}" in shown
    for setting in SETTINGS:
        assert all(text in shown for text in setting)


def sentences_of(facts):
    return [sentence.text for sentence in answer(facts, all_rows(facts)["errors"])]


def test_the_answer_comes_first_then_causes_paper_tables_and_how_to_repeat_it(page, facts):
    assert page.sections == [
        "answer",
        "camera-settings",
        "causes",
        "details",
        "comparison",
        "tables",
        "repeat",
    ]
    assert page.seen.count("details") == 5  # all but the answer and its causes is folded
    shown = "".join(page.text)
    assert shown.count(TITLE) == 2
    sentences = sentences_of(facts)
    assert len(sentences) == 4
    later = (REMARKS[0], "would reduce it", "Figure 2:", "Table 1:", "study.yaml")
    places = [shown.index(text) for text in (TITLE, *sentences, *later)]
    assert places == sorted(places)


def test_every_link_leads_somewhere_and_every_picture_is_described(page):
    assert len(set(page.ids)) == len(page.ids)
    linked = {source[1:] for source in page.sources if source.startswith("#")}
    assert linked <= set(page.ids)
    assert {"why-rake_error_degC", "why-feed_um", "interval", "psf-contribution"} <= linked
    alts = list(filter(None, page.alts))  # a figure's further columns and legend have none
    assert len(set(alts)) == len(alts) == len(FIGURES)
    assert all(alt.endswith(".") and len(alt) > 80 for alt in alts)


def test_table_2_says_what_the_study_sets():
    rows = {name: (paper, here) for name, paper, here in SETTINGS}
    for name in ("Feed", "Cutting speed", "Rake angle", "Clearance angle", "Edge radius"):
        assert rows[name][0] == rows[name][1], name
    changed = {"feed": "0.1 mm", "tool": {"rake_angle": "6 deg"}}
    other = table_2(Study(cutting=changed).cutting)
    assert {("Feed", "0.3 mm", "0.1 mm"), ("Rake angle", "−7°", "6°")} <= set(other)


def test_every_number_has_its_unit(page):
    numbers = [(attrs, text) for attrs, text in page.cells if "data-unit" in attrs]
    assert len(numbers) > 100
    for attrs, text in numbers:
        assert attrs["data-unit"] == "1" or attrs["data-unit"] in text, text
    without = [
        text for attrs, text in page.cells if "data-head" in attrs and not attrs.get("data-unit")
    ]
    settings = {text for row in SETTINGS for text in row}
    assert {text for text in without if any(map(str.isdigit, text))} <= settings


def test_the_picture_of_the_answer_is_of_the_shown_exposure(result, facts):
    figure = exposure(facts)
    # Three panels of two chips, one row each.
    images = [axes.images[0].get_array().filled(np.nan) for axes in figure.axes[:6]]
    reference, measured, error = images[:3]
    shown = with_errors(result.data).isel(surface=0)
    flagged = shown.flagged.values
    assert np.isnan(error[flagged]).all() and np.isnan(measured[flagged]).all()
    # The error of the developed instant by the analysis; images are drawn as they are stored.
    np.testing.assert_allclose(error[~flagged], shown.error_case_1.values[~flagged], atol=1e-9)
    # Rounding in K.
    np.testing.assert_allclose(error, measured - reference, atol=1e-9)


def test_the_parts_of_an_error_are_all_of_it(result, facts):
    rows = {row.key: row for row in all_rows(facts)["errors"] if row.parts}
    assert list(rows) == ["rake_error_degC", "band_error_degC", "band_worst_error_degC"]
    for row in rows.values():
        total = sum(part.values for part in row.parts.values())
        # Rounding in K.
        np.testing.assert_allclose(total, row.draws.values, atol=1e-9)
    assert set(rows["band_error_degC"].parts) == {"psf", "motion", "footprint"}
    assert set(rows["band_worst_error_degC"].parts) == {"psf", "rest"}
    mean = Facts(replace(result, plan=replace(result.plan, reference="mean")))
    assert all("motion" not in row.parts for row in all_rows(mean)["errors"])


def test_the_answer_states_interval_and_whether_the_paper_differs(facts):
    sentences = sentences_of(facts)
    error = facts.headlines["rake"].error
    low, high = (f"{-end:.0f}" for end in error.interval[::-1])
    mean = f"{-error.mean:.0f} ± {error.expanded_uncertainty:.0f} K too low on average"
    assert f"{mean}; in a single frame between {low} K and {high} K too low" in sentences[0]
    for sentence in sentences[:-1]:
        assert ("lies within the interval" in sentence) != ("lies outside the interval" in sentence)


def test_the_answer_ends_with_the_true_temperature_without_and_with_emissivity(facts):
    found = facts.headlines["rake"]
    plain, corrected = found.true_error.mean, found.corrected_error.mean
    assert plain < corrected < 0
    emissivity = float(facts.data.set_emissivity.sel(surface="chip 2"))
    assert 0.74 < emissivity < 0.88
    assert sentences_of(facts)[-1] == (
        f"Compared with the true temperature, the reading at the rake face is {-plain:.0f} K too "
        f"low if the camera is set to emissivity 1, and {-corrected:.0f} K too low if it is set to "
        f"{emissivity:.2f}."
    )
    rows = {row.key: row for row in result_rows(facts.analysis)}
    assert rows["rake_true_error_degC"].here == plain
    assert rows["rake_corrected_error_degC"].here == corrected


def test_a_period_of_three_intervals_is_judged_with_students_factor():
    intervals = np.array([107.0, 94.6, 95.8])
    uncertainty = intervals.std(ddof=1) / np.sqrt(3)
    row = Row(
        "segment_period_us", "Period", "µs", float(intervals.mean()),
        uncertainty=float(uncertainty),
        freedom=2, published=PaperValue(90.0, 0.0, ""),
    )  # fmt: skip
    # A one-sample t test: t = 2.31, p = 0.15.
    assert (intervals.mean() - 90) / uncertainty == pytest.approx(2.31, abs=0.01)
    assert row.differs is False
    assert replace(row, freedom=1).differs is None
    assert replace(row, freedom=200).differs is True
    # About 90: 85 to 95, which meets 99.1 ± 8.1 and 99.1 ± 5 but not 99.1 ± 4.
    about = replace(row, freedom=200, published=PaperValue(90.0, 5.0, ""))
    assert about.differs is False
    assert replace(about, uncertainty=2.0).differs is True


def test_one_phase_or_one_texture_leaves_no_interval_and_names_the_cause(result):
    data = result.data.copy()
    data["undrawn"] = data.undrawn.where(data.undrawn != "", "texture, pixel phase")
    facts = Facts(replace(result, data=data), PAPERS)
    (sentence, *_) = sentences_of(facts)
    assert "no interval: only 1 texture and 1 pixel phase)" in sentence
    row = next(row for row in result_rows(facts.analysis, PAPERS) if row.key == "rake_error_degC")
    assert (row.cells["interval"], row.differs) == ("–", None)
    assert "±" not in row.cells["mean"]


def test_a_contact_that_reaches_the_border_is_a_least_length(result):
    long = [replace(segment, contact_length=900e-6) for segment in result.cut.segments]
    row = next(
        row
        for row in result_rows(of_cut(result, segments=tuple(long)))
        if row.key == "contact_length_um"
    )
    assert row.cells["mean"] == f"more than {row.here:.0f} µm"
    assert row.cells["interval"] == "–"
    assert "continues beyond" in row.explanation
    rows = {"errors": [], "cut": [row], "corrected": [], "chip": [], "camera": []}
    assert summary(rows, result, {}, {}).lower_bounds == ["contact_length_um"]


def test_the_summary_keeps_its_schema(folder):
    schema = json.loads((folder / "summary.schema.json").read_text(encoding="utf-8"))
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    check = jsonschema.Draft202012Validator(schema)
    check.check_schema(schema)
    check.validate(summary)
    assert "camera" not in summary
    for wrong in (
        summary | {"results": {"rake_error_degC": "−61"}},
        summary | {"more": 1},
        {name: part for name, part in summary.items() if name != "draws"},
    ):
        assert not check.is_valid(wrong)


def test_the_summary_is_strict_json(folder, result, facts):
    def refuse(constant):
        raise AssertionError(f"{constant} is not JSON")

    text = (folder / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=refuse)
    assert summary["provenance"] == PROVENANCE
    for name in ("rake", "band"):
        error = facts.headlines[name].error
        key = f"{name}_error_degC"
        assert summary["results"][key] == summary["draws"][key]["mean"] == error.mean
        assert summary["draws"][key]["standard_deviation"] == error.standard_deviation
        assert summary["draws"][key]["count"] == 12
        assert summary["one_draw"][key] == one_draw(result.data, name).error
        celsius = facts.headlines[name].reference.mean - 273.15
        # Rounding in K.
        assert summary["references"][key] == pytest.approx(celsius, abs=1e-9)
        parts = summary["causes"][key]
        assert list(parts) == ["segment", "texture", "pixel phase", "causes together"]
        assert sum(part["fraction_percent"] for part in parts.values()) == pytest.approx(100.0)
    assert summary["paper"]["rake_error_degC"] == -42.0
    drawn = summary["draws"]["rake_error_degC"]
    assert drawn["expanded_uncertainty"] == facts.headlines["rake"].error.expanded_uncertainty
    low, high = (drawn[f"interval_{end}"] for end in ("low", "high"))
    assert summary["differs"]["rake_error_degC"] is not (low <= -42.0 <= high)
    assert set(summary["explanation"]) == {*summary["results"], *summary["chip"]}
    parts = summary["parts"]["rake_error_degC"]
    total = sum(part["mean"] for part in parts.values())
    assert total == pytest.approx(summary["results"]["rake_error_degC"])
    assert summary["chip"]["feed_um"] == pytest.approx(result.cut.chip.feed * 1e6)
    assert set(summary["chip_uncertainty"]) <= set(summary["chip"])


def test_arrays_and_study_are_as_written(folder, result, facts):
    with xr.open_dataset(folder / "results.nc", engine="h5netcdf") as data:
        for name, values in result.data.data_vars.items():
            np.testing.assert_array_equal(data[name], values)
        drawn = facts.headlines["band_measured"].psf_portion.values
        np.testing.assert_array_equal(data["draws_band_measured_psf_portion"], drawn)
        assert all(data[name].attrs.get("units") for name in data.data_vars)
        assert data.attrs["provenance_Seed"] == "1"
    assert (folder / "study.yaml").read_text(encoding="utf-8") == STUDY


@pytest.mark.parametrize("name", ["", "results.nc"])
def test_results_in_the_place_of_a_scene_are_named_with_what_to_do_next(folder, name):
    with pytest.raises(SceneError, match=r"results of an analysis.*chipglow cut study\.yaml"):
        open_scene(folder / name)


def test_the_comparison_holds_what_the_paper_states(result):
    rows = {row.key: row for row in result_rows(result, PAPERS)}
    paper = {key: row.published.value for key, row in rows.items() if row.published}
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
    assert rows["segment_period_us"].here == pytest.approx(72.0, rel=1e-9)  # the stated period
    # Widths between samples: 0.5 % measured.
    assert rows["band_width_um"].here == pytest.approx(20.0, rel=0.01)
    assert rows["contact_length_um"].cells["paper"] == "–"
    assert all(row.explanation.endswith(".") for row in rows.values())
    assert rows["rake_error_degC"].published is PAPER["rake_error_degC"]
    frame = results_frame(result, PAPERS)
    assert list(frame.index) == list(rows)
    assert frame["paper"].dropna().to_dict() == paper
    draws = rows["rake_error_degC"].draws
    error = frame.loc["rake_error_degC"]
    assert (error["least"], error["greatest"]) == draws.range
    assert error["standard_deviation"] == draws.standard_deviation


def test_numbers_are_printed_with_sign_unit_and_dash():
    paper = PaperValue(-42.0, 0.5, "abstract")
    row = Row("error_degC", "Error", "°C", -35.4, uncertainty=1.6, freedom=30, published=paper)
    names = ("paper", "mean", "interval", "one-draw", "differs")

    def cells(row):
        return tuple(row.cells[name] for name in names)

    assert cells(row) == ("−42 ± 0.5 °C", "−35 ± 3 °C", "–", "–", "yes")
    # 2.04 × 3.0 = 6.1 from −35.4 is −41.5: the paper's −42 may be −41.5.
    assert replace(row, uncertainty=2.9).differs is True
    assert replace(row, uncertainty=3.0).differs is False
    assert replace(row, freedom=None).cells["mean"] == "−35 °C (sd 2 K)"
    rate = Row("rate_per_s", "Rate", "1/s", 123456.0, -3)
    assert cells(rate) == ("–", "123 000 1/s", "–", "–", "–")
    draws = Distribution(np.array([[[-30.0, -50.0, -40.0, -44.0]]]), CAUSES)
    drawn = replace(row, here=draws.mean, draws=draws, one_draw=-30.0, uncertainty=None)
    # Four pixel phases are all that there are: quantiles of 2.5 % and 97.5 % between them.
    assert cells(drawn) == ("−42 ± 0.5 °C", "−41 °C", "−50 to −31 °C", "−30 °C", "no")


@pytest.mark.parametrize(
    ("value", "uncertainty", "decimals", "text"),
    [
        (57.1, 0.0, 1, "57.1 K"),
        (57.1, 1e-12, 1, "57.1 K"),  # the rounding of the computation
        (57.1, 0.004, 1, "57.100 ± 0.004 K"),
        (57.1, 0.06, 1, "57.1 ± 0.1 K"),
        (1234.0, 300.0, -3, "1 200 ± 300 K"),
        (57.1, np.inf, 1, "57.1 K"),
        (np.nan, 1.0, 1, "–"),
    ],
)
def test_no_uncertainty_is_printed_as_zero(value, uncertainty, decimals, text):
    assert spread_text(value, uncertainty, "K", decimals) == text


def test_two_segments_state_neither_uncertainty_nor_verdict():
    values = np.linspace(-118.0, -108.0, 2 * 2 * 16).reshape(2, 2, 16)
    draws = Distribution(values, CAUSES)
    paper = PaperValue(-42.0, 0.5, "abstract")
    row = Row("e_degC", "Error", "K", draws.mean, draws=draws, published=paper)
    assert (row.cells["mean"], row.cells["interval"], row.differs) == ("−113 K", "–", None)
    assert position(draws, paper, "K") == (
        "Only 2 segments and 2 textures: too few to show whether the paper's value differs."
    )
    assert error_text(draws) == "113 K too low (no interval: only 2 segments and 2 textures)"


def test_the_place_of_the_papers_figure_is_stated():
    draws = Distribution(np.array([[[-30.0, -50.0, -40.0, -44.0]]]), CAUSES)
    near, far, rounded = (
        position(draws, PaperValue(*paper, ""), "°C")
        for paper in ((-42.0, 0.5), (-120.0, 5.0), (-54.0, 5.0))
    )
    assert "−42 ± 0.5 °C lies within the 95 %" in near and "lies outside the 95 %" in far
    assert "−54 ± 5 °C lies within the 95 %" in rounded  # it may be −49, the interval begins at −50
    single = Distribution(np.full((1, 1, 1), -40.0), CAUSES, missing=("texture",))
    assert "Only 1 texture: too few" in position(single, PAPER["rake_error_degC"], "°C")


def test_every_published_value_has_the_rounding_of_its_print():
    texts = {key: value.text("") for key, value in PAPER.items()}
    assert texts["rake_error_degC"] == texts["rake_extremum_error_degC"] == "−42 ± 0.5 "
    assert texts["band_error_degC"] == texts["band_measured_error_degC"] == "−46 ± 0.5 "
    assert texts["rake_psf_fraction_percent"] == "45 ± 0.5 "
    assert texts["band_psf_fraction_percent"] == "15 ± 2.5 "
    assert texts["band_worst_error_degC"] == "−120 ± 5 "
    assert texts["segment_period_us"] == "90 ± 5 "


def test_a_width_is_found_where_the_series_meets_the_value():
    widths, falling = np.array([4.0, 8.0, 12.0]), np.array([-10.0, -30.0, -50.0])

    def width(value, rounding, series=falling):
        return crossing(widths, series, PaperValue(value, rounding, ""))

    assert width(-40.0, 0.5) == pytest.approx(10.0)
    assert width(-10.0, 0.5) == 4.0
    assert width(-60.0, 0.5) is None
    assert width(-51.0, 5.0) == 12.0  # rounded, it may be −50
    assert width(-20.0, 5.0, np.array([-30.0, -22.0, -30.0])) == 8.0
    assert width(-20.0, 5.0, np.array([-20.0, -20.0, -20.0])) == 4.0


def test_what_is_missing_is_left_out_and_unknown_is_null(result, undrawn, tmp_path):
    segments = tuple(replace(segment, sweep=float("nan")) for segment in result.cut.segments)
    ideal = replace(result.camera, psf=None, lower_limit=None)
    unseen = result.data.copy()
    unseen["measured"] = unseen.measured.where(
        (unseen.reading != "rake") | (unseen.pixel_phase != 1)
    )
    bare = replace(of_cut(result, forces=None, segments=segments), camera=ideal, data=unseen)
    write_report(bare, tmp_path, TITLE, STUDY, PROVENANCE, study=PAPERS)
    row = next(row for row in result_rows(bare) if row.key == "rake_error_degC")
    assert (row.cells["mean"], row.differs) == ("–", None)
    assert row.one_draw == one_draw(result.data, "rake").error
    assert "outside the image" in row.explanation
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == FIGURES - {"figure-2-psf", "forces"}
    assert "failed" not in Page((tmp_path / "report.html").read_text(encoding="utf-8")).text
    assert "segment_period_us" not in {row.key for row in result_rows(bare)}
    forces = result.cut.forces
    segmentation = replace(forces.history.segmentation, period=float("nan"))
    history = replace(forces.history, segmentation=segmentation)
    unknown = of_cut(result, forces=replace(forces, history=history))
    row = next(r for r in result_rows(unknown) if r.key == "segment_period_us")
    assert row.here is None and row.cells["mean"] == "–"
    assert "there is no period" in row.explanation


def test_a_part_that_fails_is_shown_beside_the_others(result, undrawn, tmp_path):
    """The analysis names one part; a figure that cannot be drawn is another."""
    reason = "region chip 1 body: reaches over columns 50.34 to 81.35"
    data = result.data.drop_vars("ridge_distance")
    failed = {"heated chips and tool": reason}
    broken = replace(of_cut(result, heated=()), data=data, failed=failed)
    write_report(broken, tmp_path, TITLE, STUDY, PROVENANCE, study=PAPERS)
    page = "".join(Page((tmp_path / "report.html").read_text(encoding="utf-8")).text)
    assert f"heated chips and tool failed: {reason}" in page
    assert "Development of the shear band failed: AttributeError" in page
    gone = {"figure-3-heated-chips", "figure-4-heated-tool", "figure-9-band-curves"}
    assert {path.stem for path in (tmp_path / "figures").iterdir()} == FIGURES - gone
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["failed"] == failed
    assert summary["results"]["rake_error_degC"] < 0
