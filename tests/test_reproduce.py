"""The quick study from the command line to its report, as a user runs it."""

import json
import re

import jsonschema
import pytest
from documented import ROOT

pytestmark = pytest.mark.slow

PAPER_ROWS = [
    "rake_error_degC",
    "rake_psf_fraction_percent",
    "band_error_degC",
    "band_psf_fraction_percent",
    "band_worst_error_degC",
    "segment_period_us",
]


@pytest.fixture(scope="module")
def results(quick_study):
    assert "report.html" in quick_study.printed
    assert "the paper" in quick_study.printed
    return quick_study.results


def test_summary_holds_the_papers_figures_beside_ours(results):
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(summary, json.loads((results / "summary.schema.json").read_text("utf-8")))
    for name in PAPER_ROWS:
        assert name in summary["paper"]
        assert summary["explanation"][name]
    here = summary["results"]
    # The sign and the order of the paper's errors; the quick study's cell is half the default's.
    assert -150 < here["rake_error_degC"] < -10
    assert -150 < here["band_error_degC"] < -10
    assert here["band_worst_error_degC"] < here["band_error_degC"]
    assert 0 < here["rake_psf_fraction_percent"] < 100
    assert len(list((results / "figures").glob("figure-*.png"))) == 10


def test_the_page_states_the_errors_of_the_quick_study(results):
    page = (ROOT / "docs" / "learn" / "paper-study.md").read_text(encoding="utf-8")
    both = page.partition("## Quick and full")[2]
    summary = json.loads((results / "summary.json").read_text(encoding="utf-8"))
    rows = {
        "rake_error_degC": "rake face, mid-contact",
        "band_error_degC": "shear band, ridge of strain rate",
        "band_worst_error_degC": "most negative beside the band",
    }
    for name, row in rows.items():
        stated = re.search(rf"\| {row} \| −(\d+) \| −(\d+) ± \d+ \| −\d+ ± ", both)
        assert stated, name
        # Another processor rounds another way, and the chip differs in detail: within the scatter.
        scatter = summary["draws"][name]["standard_deviation"]
        assert -summary["results"][name] == pytest.approx(float(stated[1]), abs=scatter), name
        assert re.search(rf"\| −{stated[2]} ± \d+ \| −\d+ to −\d+ \|", page), name


def test_rake_face_and_shear_band_are_corrected_on_the_page(results):
    corrected = json.loads((results / "summary.json").read_text(encoding="utf-8"))["corrected"]
    page = (results / "report.html").read_text(encoding="utf-8")
    for place in ("rake_face", "shear_band"):
        measured, found, true = (
            corrected[f"{place}_{name}_degC"] for name in ("measured", "corrected", "true")
        )
        assert abs(found - true) < 0.2 * abs(measured - true)
        assert f"the true temperature is {true:.0f}\u00a0°C" in page
    # 95 % are promised; a texture's grain leaves about 80 independent pixels: three deviations.
    assert min(corrected["chip_1_held_percent"], corrected["chip_2_held_percent"]) > 95 - 3 * 2.4
    assert 'id="correction"' in page and 'id="corrected-lines"' in page


def test_chip_is_segmented_as_the_study_needs(results):
    here = json.loads((results / "summary.json").read_text(encoding="utf-8"))["results"]
    # 30 000 /s is where the paper's emissivity map is wholly shear band.
    assert here["band_peak_rate_per_s"] > 30_000
    assert here["cutting_force_swing_N_per_mm"] > 30
    assert here["segments_count"] >= 3
    assert here["segmentation_degree_percent"] > 25
    # The coarse cut's own: one segment more or less is 10 us.
    assert here["segment_period_us"] == pytest.approx(90, abs=10)
    # Published forces of AISI 1045 at this feed are 600 to 700; softening lowers them.
    assert 350 < here["cutting_force_mean_N_per_mm"] < 750
