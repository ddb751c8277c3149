"""The choice of settings: closed forms for shot noise and motion, limits, and the command."""

import json
from itertools import product

import numpy as np
import pytest
from command import chipglow
from drawn import in_a_notebook, legend_of, on_given_axes, on_new_axes, points_of
from scipy.constants import c, h, k
from scipy.integrate import quad

from chipglow.io import write_scene
from chipglow.quantities import changed
from chipglow.scene import Raster, Scene
from chipglow.study import Study, design

RATE = 2.5e4
"""Kelvins per second of a plate of 900 K."""

ETA, ELEMENT, F_NUMBER = 0.8, 15e-6, 2.5
TIMES = (2e-6, 3e-6, 5e-6, 7e-6, 10e-6, 14e-6, 20e-6, 40e-6)
EFFICIENCIES = (0.2, 0.4, 0.6, 0.8)
FILL_FACTORS = (0.5, 1.0)


@pytest.fixture(scope="module")
def heating(tmp_path_factory):
    """A plate that is heated evenly, at 0.5 us between frames."""
    raster = Raster(left=-20e-6, top=20e-6, spacing=2e-6, rows=20, columns=20)
    times = 0.5e-6 * np.arange(121)
    temperature = 900.0 + RATE * (times - 30e-6)
    fields = np.broadcast_to(temperature[:, None, None], (len(times), *raster.shape))
    path = tmp_path_factory.mktemp("plate") / "heating.nc"
    write_scene(Scene.from_fields(raster, times, {"temperature": fields}), path)
    return path


def study_of(path, **camera):
    response = {
        "kind": "photon", "quantum_efficiency": ETA, "element": "15 um", "f_number": F_NUMBER
    }  # fmt: skip
    detector = {
        "response": response, "full_well": 1e8, "bits": 16, "terms": [{"kind": "shot-noise"}]
    }  # fmt: skip
    return Study(
        scene=str(path),
        surface={"kind": "uniform", "emissivity": 1.0},
        camera={"psf": None, "lower_limit": None, "detector": detector, **camera},
        analysis={"exposures": 1, "points": {"middle": ("0 um", "0 um")}},
    )


def expected(time, efficiency=ETA, fill=1.0):
    """Return bias by motion and noise by photons in K, from Planck's law."""

    def photons(temperature):
        def rate(wavelength):
            return 2 * c / wavelength**4 / np.expm1(h * c / (wavelength * k * temperature))

        cone = np.pi / (4 * F_NUMBER**2) * fill * ELEMENT**2 * time * efficiency
        return cone * quad(rate, 3.8e-6, 5.1e-6)[0]

    count, slope = photons(900.0), (photons(900.5) - photons(899.5))
    return RATE * time / 2, np.sqrt(count) / slope


def test_bias_and_noise_are_the_closed_forms_and_so_is_the_best_exposure(heating):
    found = design(study_of(heating), {"camera.integration_time": TIMES}, ("middle",), draws=256)
    times = np.array([one["camera.integration_time"] for one in found.settings])
    bias, noise = np.transpose([expected(time) for time in times])
    # A frame is 0.5 us, in which the largest temperature rises by 13 mK. Noise: 4 deviations.
    excess = np.abs(-found.bias[:, 0] - bias) - 4 * noise / np.sqrt(found.draws)
    assert (excess < 0.013).all()
    spread = found.expanded_uncertainty[:, 0] / (2 * noise)
    assert (np.abs(spread - 1) < 4 / np.sqrt(2 * found.draws)).all()
    # At the least of RATE t / 2 + 2 s / sqrt(t), with s = noise sqrt(t).
    best = (4 * noise[0] * np.sqrt(times[0]) / (2 * RATE)) ** (2 / 3)
    ratio = times[found.best] / best
    assert 1 / 1.45 < ratio < 1.45  # a step of the values
    assert found.regret[found.best] == 0.0 and found.is_pareto[found.best]


@pytest.mark.parametrize(
    ("efficiencies", "draws", "portion"),
    [((ETA,), 256, 1 / 3), pytest.param(EFFICIENCIES, 1024, 0.1, marks=pytest.mark.slow)],
)
def test_halving_finds_the_best_setting_with_a_portion_of_the_draws(
    heating, efficiencies, draws, portion
):
    vary = {
        "camera.integration_time": TIMES,
        "camera.detector.response.quantum_efficiency": efficiencies,
        "camera.fill_factor": FILL_FACTORS,
    }
    found = design(study_of(heating), vary, ("middle",), draws=draws)
    assert len(found.settings) == 16 * len(efficiencies)
    assert found.draws.sum() <= portion * len(found.settings) * draws
    total = {one: np.dot([1, 2], expected(*one)) for one in product(*vary.values())}
    best = total[tuple(found.settings[found.best].values())]
    assert best <= 1.05 * min(total.values())
    # The study's own settings, of 10 us, are among them.
    own = expected(10e-6)
    # The table of the radiance: 0.001 K measured.
    assert found.regret[0] == pytest.approx(np.dot([1, 2], own) - best, abs=0.005)


def test_settings_beyond_a_limit_are_excluded(heating):
    study = study_of(heating, lower_limit="626.8 degC")  # 899.95 K: half the noise of 2 us
    vary = {"camera.integration_time": ("2 us", "20 us", "3 ms")}
    found = design(study, vary, ("middle",), draws=64, below=0.4)
    assert found.settings[0] == {"camera.integration_time": 10e-6}
    assert "longer than the frame period" in found.reasons[3]
    assert np.isnan(found.bias[3]).all()
    frame = found.to_frame()
    assert list(frame.own).index(True) < 3 and not frame.pareto.iloc[-1]
    full = {"camera.detector.full_well": (1e5, 1e8)}
    found = design(study_of(heating), full, ("middle",), draws=64)
    reason = "camera.detector.full_well = 100000.0: middle, pixel: 100% of it is saturated"
    assert found.reasons[1] == reason


def test_all_settings_see_the_same_moments(tmp_path):
    """A plate that cools and heats again: the bias by motion depends on the moment."""
    raster = Raster(left=-20e-6, top=20e-6, spacing=2e-6, rows=20, columns=20)
    step, curvature = 0.1e-6, 0.2e12  # s, K/s²
    times = step * np.arange(601)
    temperature = 900.0 + curvature / 2 * (times - 30e-6) ** 2
    fields = np.broadcast_to(temperature[:, None, None], (len(times), *raster.shape))
    write_scene(Scene.from_fields(raster, times, {"temperature": fields}), tmp_path / "plate.nc")
    study = study_of(tmp_path / "plate.nc", detector=None)
    study = changed(study, {"analysis.exposures": 3})
    vary = {"camera.integration_time": ("1 us", "2 us", "20 us", "1 ms")}
    found = design(study, vary, ("middle",), draws=64)
    assert "scene: it lasts 60.1 us, expected an exposure's 1000 us" in found.reasons[4]
    # Exposures of 20 us, the longest that fit, are spread over 60 us: their middles.
    speed = curvature * np.abs(np.array([10e-6, 30e-6, 50e-6]) - 30e-6)
    for number, time in ((1, 1e-6), (2, 2e-6)):
        bias = -(speed * time / 2).mean()
        # The start is that of a frame, whose temperature is the same for a step.
        assert found.bias[number, 0] == pytest.approx(bias, abs=speed.mean() * step)


def test_settings_with_impossible_draws_are_excluded(heating):
    study = changed(
        study_of(heating),
        {"uncertainty": {"inputs": {"camera.integration_time": {"standard": "1 %"}}}},
    )
    vary = {"camera.integration_time": ("20 us", "1.66 ms")}  # of a frame period of 1.667 ms
    found = design(study, vary, ("middle",), draws=16)
    assert found.reasons.keys() == {2}
    assert "a draw is impossible: camera" in found.reasons[2]


def test_a_path_outside_of_camera_and_surface_is_refused(heating):
    with pytest.raises(ValueError, match="expected a path in camera, surface"):
        design(study_of(heating), {"cutting.feed": ("1 um",)})
    with pytest.raises(ValueError, match="unknown key 'pich', did you mean 'pitch'"):
        design(study_of(heating), {"camera.pich": ("1 um",)})
    with pytest.raises(ValueError, match="draws: 8, expected 16 or more"):
        design(study_of(heating), {"camera.pitch": ("1 um",)}, draws=8)


def test_the_command_prints_the_settings_and_draws_them(heating, tmp_path):
    (tmp_path / "study.yaml").write_text(
        f"""
scene: {heating}
surface: {{kind: uniform, emissivity: 0.9}}
camera: {{psf: none, lower_limit: none}}
analysis: {{exposures: 1, points: {{middle: [0 um, 0 um]}}}}
""",
        encoding="utf-8",
    )
    table, picture = tmp_path / "design.csv", tmp_path / "design.png"
    arguments = ["design", tmp_path / "study.yaml", "--vary", "camera.integration_time=5us,20us"]
    arguments += ["--draws", 32, "--out", table, "--plot", picture]
    result = json.loads(chipglow("--json", *arguments).stdout)
    assert result["values"]["best"] == {"camera.integration_time": 5e-6}
    assert [row["camera.integration_time"] for row in result["tables"]["settings"]] == [
        "5 us", "10 us", "20 us",
    ]  # fmt: skip
    assert table.read_text(encoding="utf-8").startswith("camera.integration_time,bias_K")
    assert picture.stat().st_size > 10_000


def test_a_design_is_drawn_and_shown_with_the_best_setting_first(heating):
    found = design(study_of(heating), {"camera.integration_time": TIMES[:3]}, draws=16)
    axes = on_given_axes(found)
    assert legend_of(axes) == legend_of(on_new_axes(found))
    time = found.settings[found.best]["camera.integration_time"]
    x, y = points_of(axes, f"best: integration time {1e6 * time:g} us")
    np.testing.assert_array_equal([x, y], found.objectives[[found.best]].T)
    columns, rows, sentences = in_a_notebook(found)
    assert columns == list(found.to_frame().columns)
    assert rows[0][0] == f"{time:.6g}" and rows[0][3] == "0"
    assert sentences == [*found.notes.warnings, *found.notes.assumed]
