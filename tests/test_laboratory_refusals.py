"""What the laboratory refuses beside the declared limits, which test_part covers."""

from dataclasses import replace

import heated_chip
import measured_band
import numpy as np
import pytest
import xarray as xr
from command import refusal
from heated_chip import RASTER, REGIONS, table_1
from measured_band import TOOL, BandImage
from PIL import Image
from synthetic_edge import edge_radiance, gaussian_aperture, gaussian_edge, image_of, measurement_of

from chipglow.camera import Flag, Measurement
from chipglow.io import write_measurement
from chipglow.laboratory import chip, emissivity as em, registration as two
from chipglow.laboratory.comparison import StatedUncertainties, compare
from chipglow.laboratory.psf import aperture_image, edge_image, knife_edge
from chipglow.laboratory.registration.dot_matching import Arrangement, match_dots
from chipglow.scene import Area, Circle, Polygon, Raster, Region, ToolGeometry, areas
from chipglow.study import Study
from chipglow.study.surface_section import surfaces_of
from chipglow.surface import MapSurface

# A heated chip

ROOM = 293.0
EVEN = np.full(RASTER.shape, 0.5)
WHOLE = Area("all", "all", np.ones(RASTER.shape, bool), True)
SMALL = heated_chip.measured(np.full((5, 5), 0.5), raster=Raster(0.0, 0.0, 6e-6, 5, 5))
SATURATED = np.full((1, *RASTER.shape), Flag.SATURATED, np.uint8)
KNOWN = em.EmissivityLine.constant(0.42)


def heated(emissivity=0.5, kelvins=664.15, **more):
    return heated_chip.measured(np.full(RASTER.shape, emissivity), kelvins, **more)


def emissivity(*images, kelvins=664.15):
    return em.determine_emissivity(images, em.Heating(kelvins)).of(WHOLE)


def line(slope):
    """Emissivity of an object that was heated to 600 K and 800 K."""
    pairs = [(heated(0.42 + slope * (t - 700.0), t), t) for t in (600.0, 800.0)]
    return em.emissivity_line([emissivity(image, kelvins=t).line for image, t in pairs])


def temperature(image, known=KNOWN, around=None):
    return em.true_temperature([image], WHOLE, known, around)


def region(shape, name="a", feature=None):
    return Region(name, shape, feature or name)


def covered(*regions):
    return areas(regions, RASTER)


def box(left, top, right, bottom):
    return Polygon.rectangle((left, top), (right, bottom))


# A cut chip

STRAIGHT = TOOL.edge_point + np.array([[-30e-6, 30e-6], [-230e-6, 230e-6]])
CHIP = measured_band.measured([BandImage().temperature()])
COLD = measured_band.measured([np.full(measured_band.RASTER.shape, 500.0)])
OWN = measured_band.measured([BandImage().temperature()], relative_uncertainty=0.01)
NEAR = TOOL.signed_distance(*np.meshgrid(CHIP.raster.x, CHIP.raster.y))
APART = np.where((NEAR > 0) & (NEAR < 30e-6), Flag.UNDER_RANGE, 0).astype(np.uint8)[None]
NARROW = Raster(0.0, 0.0, 6e-6, 60, 8)


def without_tool(measurement):
    data = measurement.data.copy()
    data.attrs = {k: v for k, v in data.attrs.items() if not k.startswith("tool_")}
    return Measurement(data)


def flagged(flags):
    data = CHIP.data.copy(deep=True)
    data["flags"].values[:] = flags
    return Measurement(data)


def profile(**wrong):
    return chip.band_profile(CHIP, **{"tool": TOOL, **wrong})


def grid(measurement=CHIP, tool=TOOL, **wrong):
    return chip.rake_grid(measurement, tool, **wrong)


def placed(**wrong):
    return chip.ToolUncertainty(**({"along": 1e-6, "across": 1e-6} | wrong))


def plain(radiance, raster=NARROW):
    return Measurement.from_radiance(radiance, measured_band.BAND, np.zeros(1), raster)


# Edges and apertures

EDGE = image_of(edge_radiance(gaussian_edge(10e-6), 5.0), 0.05)
HOLES = [gaussian_aperture(10e-6, size) for size in (60e-6, 80e-6, 100e-6)]
FLAT_HOLE = replace(HOLES[2], radiance=np.full_like(HOLES[2].radiance, 2.0))
EDGE_FILE = measurement_of(edge_radiance(gaussian_edge(10e-6), 5.0) * 100)
OUTSIDE = (slice(50, 60), slice(None))

# Two cameras

LINE = np.stack([np.linspace(0, 1e-4, 8), np.linspace(0, 2e-4, 8)], axis=1)
PLACES = np.random.default_rng(1).uniform(-400e-6, 400e-6, (8, 2))
PIXELS = PLACES @ np.diag([6e5, -6e5]) + 300.0
ONE_OFF = np.concatenate([LINE[:4], PLACES[:1]])
RAMP = np.add.outer(np.arange(60.0), np.arange(80.0))
SLOW, FAST = np.arange(30) / 600.0, np.arange(2400) / 30000.0
RANDOM = np.random.default_rng(3)
FIRST = Arrangement(RANDOM.uniform(5, 115, (30, 2)), (120, 120), 3.0)
SECOND = Arrangement(RANDOM.uniform(20, 460, (30, 2)), (480, 480), 12.0)


def registration(**changed):
    good = two.Registration(np.eye(3), np.zeros((9, 9)), "affine", "points", 4.0)
    return replace(good, **changed)


def clocks(times=SLOW, seen=SLOW**2, visible=FAST, bright=FAST**2):
    return two.align_times(times, seen, visible, bright)


REFUSED = {
    "reference: 19.85 °C must be over what is reflected, 19.85 °C": lambda: em.Heating(ROOM),
    "by 5 standard uncertainties of 3 K or more": lambda: em.Heating(300.0, ROOM, 3.0),
    "reference: 391 °C is below the camera's lower range limit of 426.85 °C": lambda: emissivity(
        heated(lower_limit=700.0)
    ),
    "image 2: has other pix": lambda: emissivity(heated(), SMALL),
    "all: 0 of its 1200 pixels .*1200 s": lambda: emissivity(heated(flags=SATURATED)),
    "are all the same": lambda: em.emissivity_line(2 * [emissivity(heated()).line]),
    "values has shape": lambda: MapSurface(EVEN[:3], RASTER),
    "goes from 1.01 to 1.01, expected 0 to 1": lambda: MapSurface(2.02 * EVEN, RASTER),
    "no pixel is known": lambda: MapSurface(np.nan * EVEN, RASTER),
    "temperature: there is no image": lambda: em.true_temperature([], WHOLE, KNOWN),
    r"darker than its reflection at 626\.85 °C": lambda: temperature(
        heated(), around=em.reflected_temperature(900.0)
    ),
    "use an emissivity that falls less": lambda: temperature(heated(0.9, 1000.0), line(-1.6e-3)),
    r"darker than its reflection at 19\.85 °C": lambda: temperature(heated(0.5, 283.0), line(4e-4)),
    "0 of its 1200 pixels can be used": lambda: temperature(heated(flags=SATURATED)),
    "emissivity: is 0.0, expected more than 0 to 1": lambda: em.EmissivityLine.constant(0.0),
    "emissivity: is nan": lambda: em.EmissivityLine.constant(float("nan")),
    "standard uncertainty is -1": lambda: em.EmissivityLine.constant(0.5, -1.0),
    "reflected: is 0": lambda: em.reflected_temperature(0.0),
    "reflected: standard uncertainty": lambda: em.reflected_temperature(ROOM, -1.0),
    "a: reaches over columns 30 to 41, expected": lambda: covered(region(box(30, 0, 41, 5))),
    "over rows -2 to 5, .*within the image's 0": lambda: covered(region(box(0, -2, 4, 5))),
    "reaches over rows 26 to 32": lambda: covered(region(Circle((20, 29), 3))),
    "region a: is empty": lambda: covered(region(box(3.6, 3.6, 4.4, 4.4))),
    "region a: another region": lambda: covered(*2 * [region(box(0, 0, 3, 3))]),
    "region b: another region, or a feature": lambda: covered(
        region(box(0, 0, 3, 3), "b", "b"), region(box(0, 0, 3, 3), "c", "b")
    ),
    "^tool: its edge at .* outside the image": lambda: profile(tool=TOOL.at((1.0, 0.0))),
    "width is -1e-06 m, expected 0 m or more": lambda: profile(width=-1e-6),
    "position is nan m": lambda: profile(position=np.nan),
    "frame 3, expected 0 to 0": lambda: profile(frames=[3]),
    "frame -1, expected 0 to 0": lambda: profile(reference=-1),
    "expected from the edge outward": lambda: profile(curve=STRAIGHT[::-1]),
    "expected 2 or more": lambda: profile(curve=STRAIGHT[:1]),
    "two points are the same": lambda: profile(curve=STRAIGHT[[0, 0, 1]]),
    "all finite": lambda: profile(curve=STRAIGHT * np.nan),
    "expected a curve in the image": lambda: profile(curve=STRAIGHT - np.array([2e-3, 0.0])),
    "no square on the rake face is inside the image": lambda: grid(tool=TOOL.at((5e-3, 0.0))),
    r"none of the \d+ squares .* touches the tool": lambda: grid(flagged(APART)),
    "pixels is 0.5, expected 1 or more": lambda: grid(pixels=0.5),
    "depth is 1e-05 m, expected a square's 1.8e-05 m": lambda: grid(depth=10e-6),
    "frame 2, expected 0 to 0": lambda: grid(frames=[2]),
    "frame none, expected 0 to 0": lambda: grid(frames=[]),
    "tool: the measurement contains no tool": lambda: chip.tool_of(without_tool(CHIP)),
    "tip: .* finite": lambda: ToolGeometry().at((0.0, np.nan)),
    "along: -1e-06 m, expected 0 m or more": lambda: placed(along=-1e-6),
    "across: nan m": lambda: placed(across=np.nan),
    "angle: inf rad": lambda: placed(angle=np.inf),
    "pivot: nan m is not finite": lambda: placed(pivot=np.nan),
    "the image is 8 pixels wide": lambda: chip.find_tool(plain(np.ones((1, *NARROW.shape)))),
    "^comparison: there is nothing": lambda: compare(COLD, {"same": COLD}, TOOL),
    "no simulation, expected 1 or more": lambda: compare(CHIP, {}, TOOL),
    "uncertainty: 5 K beside the uncertainty that the measurement states": lambda: compare(
        OWN, {"same": OWN}, TOOL, STRAIGHT, StatedUncertainties(temperature=5.0)
    ),
    "temperature: -1 K, expected 0 K or more": lambda: StatedUncertainties(-1.0),
    "emissivity: nan, expected 0 or more": lambda: StatedUncertainties(emissivity=np.nan),
    "position: -1e-06 m, expected 0 m": lambda: StatedUncertainties(position=-1e-6),
    "none is given": lambda: knife_edge([]),
    "expected 3 diameters or more": lambda: knife_edge([EDGE], [HOLES[0], HOLES[1], HOLES[1]]),
    "100 um: all pixels are as bright": lambda: knife_edge([EDGE], [*HOLES[:2], FLAT_HOLE]),
    "no aperture of 20 um within the image": lambda: knife_edge(
        [EDGE], [*HOLES[:2], replace(HOLES[2], diameter=20e-6)]
    ),
    "hole: diameter is -1.0 m, expected more": lambda: aperture_image(EDGE_FILE, -1.0, "hole"),
    "m: the region has 0 x 40 pixels, expected 8 x 8": lambda: edge_image(EDGE_FILE, "m", OUTSIDE),
    "2 for .*expected 3 or more": lambda: two.fit_points(PLACES[:2], PIXELS[:2], "similarity"),
    "3 for .*expected 4 or more": lambda: two.fit_points(PLACES[:3], PIXELS[:3], "affine"),
    "4 for .*expected 5 or more": lambda: two.fit_points(PLACES[:4], PIXELS[:4], "homography"),
    "infrared image they lie on a line": lambda: two.fit_points(LINE, PIXELS),
    "visible picture they lie on a line": lambda: two.fit_points(PLACES, 1e6 * LINE),
    "not finite": lambda: two.fit_points(np.where(PLACES[0] == PLACES, np.nan, PLACES), PIXELS),
    "leave the homography open": lambda: two.fit_points(ONE_OFF, 6e5 * ONE_OFF, "homography"),
    "its last element is 2, expected 1": lambda: registration(matrix=2 * np.eye(3)),
    "must have an inverse": lambda: registration(matrix=np.diag([1.0, 0.0, 1.0])),
    "covariance: expected finite": lambda: registration(covariance=np.zeros((3, 3))),
    "degrees_of_freedom 0.0 must be positive": lambda: registration(degrees_of_freedom=0.0),
    "visible signal: does not change": lambda: clocks(bright=np.ones(FAST.size)),
    "infrared signal: 3 frames, expected 6": lambda: clocks(SLOW[:3], SLOW[:3]),
    "ascending times": lambda: clocks(SLOW[::-1]),
    "29 values but 30 times": lambda: clocks(seen=SLOW[1:]),
    "of 30 in the infrared image and 30 in the visible": lambda: match_dots(FIRST, SECOND),
    "^image: has no contrast": lambda: two.find_dots(EVEN),
    "image: has no contrast": lambda: two.find_dots(np.nan * EVEN),
    "image: 0 dots are found": lambda: two.find_dots(RAMP),
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_impossible_is_refused_in_one_line(message):
    with pytest.raises(ValueError, match=message) as caught:
        REFUSED[message]()
    assert "\n" not in str(caught.value)


# Commands


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """A folder with a file of each kind."""
    path = tmp_path_factory.mktemp("laboratory")
    images = [BandImage(shift=shift, bend=1e-3).temperature() for shift in (-18e-6, 0.0)]
    cut = measured_band.measured(images)
    flat = np.random.default_rng(0).normal(100.0, 1.0, (40, 40))
    for name, measurement in (
        ("chip", cut),
        ("bare", without_tool(cut)),
        ("hot", heated_chip.measured(table_1())),
        ("small", SMALL),
        ("edge", EDGE_FILE),
        ("flat", measurement_of(flat)),
    ):
        write_measurement(measurement, path / f"{name}.nc")
    found = em.determine_emissivity([heated()], em.Heating(664.15))
    row = replace(found.of(WHOLE), name="other")
    em.write_emissivity(em.RegionEmissivities((found,), ((row,),)), path / "e.nc")
    with xr.open_dataset(path / "e.nc", engine="h5netcdf") as data:
        data.load().drop_vars("observations").to_netcdf(path / "old.nc", engine="h5netcdf")
    (path / "regions.yaml").write_text(REGIONS)
    (path / "away.yaml").write_text("tip: [5 mm, 0 mm]\n")
    (path / "curve.csv").write_text("x_um,y_um\n-30,40\n-230,240\n")
    (path / "point.csv").write_text("x_um,y_um\n1,2\n")
    (path / "points.csv").write_text("x_um,y_um,visible_column,visible_row\n9,20,3,4\n")
    picture = np.arange(9600, dtype=np.uint8).reshape(80, 120)
    Image.fromarray(picture).save(path / "visible.png")
    whole = (path / "visible.png").read_bytes()
    for name, content in (
        ("empty.png", b""),
        ("text.png", b"no picture"),
        ("cut.png", whole[: len(whole) // 2]),
        ("notes.txt", b"no camera"),
        ("empty.nc", b""),
    ):
        (path / name).write_bytes(content)
    return path


@pytest.fixture
def folder(laboratory, monkeypatch):
    monkeypatch.chdir(laboratory)
    return laboratory


HOT = "--regions regions.yaml --reference 391degC"
TWO = f"{HOT} --reference '500 degC' --out never.nc"
TEMPERATURE = "temperature hot.nc --regions regions.yaml --emissivity"
COMPARE = "compare chip.nc bare.nc --uncertainty '5 K'"
REGISTER = "register chip.nc visible.png"

COMMANDS = {
    f"emissivity hot.nc small.nc {TWO}": "small.nc: has other pixels, or another band, than hot.nc",
    f"emissivity hot.nc {TWO}": "--reference: 2 temperatures for 1 images",
    f"emissivity hot.nc {HOT} --set band=1": "--set",
    f"{TEMPERATURE} e.nc --emissivity-uncertainty 1 --table t.csv": "omit the option",
    f"{TEMPERATURE} e.nc": "has the name or feature of a known emissivity (other)",
    f"{TEMPERATURE} 0.4 --set 'pitch=6 um'": "describes nothing",
    "rake bare.nc": "tool: the measurement contains no tool",
    "rake chip.nc --frame 2": "--frame: '2', expected 0 to 1, or all",
    "rake chip.nc --frame 0 --at '1 us'": "--frame and --at cannot be combined",
    "rake chip.nc --at '1 s'": "--at: 1000000 us is not in the measurement, expected 0 us to 10 us",
    "rake chip.nc --tool away.yaml": "no square on the rake face is inside the image",
    "shearband chip.nc --at '3 s'": "--at: 3000000 us is not in the measurement, expected 0 us",
    "shearband chip.nc --reference '1 ms'": "--reference: 1000 us is not in the measurement",
    "shearband chip.nc --curve none.csv": "none.csv: No such file",
    "shearband chip.nc --curve point.csv": "1 points, expected 2 or more",
    f"{COMPARE} bare.nc bare.nc": "bare.nc: is given twice",
    f"{COMPARE} --reference '1 s'": "--reference: 1000000 us is not in the measurement, expected",
    "compare chip.nc curve.csv": "curve.csv: curve: unit: is missing",
    f"{COMPARE} --curve curve.csv --out .": "holds the input",
    "psf edge.nc --model lorentz": "'lorentz' was not fitted",
    "psf edge.nc --set 'band=3-5 um'": "--set",
    "psf edge.nc --region 5:35": "expected columns and rows such as 20:90,10:70",
    "psf edge.nc --region 5,0:35": "expected columns and rows such as 20:90,10:70",
    "psf edge.nc --region 0:4,0:5": "edge.nc: the region has 5 x 4 pixels",
    "psf flat.nc": "flat.nc: no edge stands out of the noise",
    "register chip.nc empty.png --points points.csv": "empty.png: is empty, expected a picture",
    "register chip.nc text.png --points points.csv": "text.png: expected a picture",
    "register chip.nc cut.png --points points.csv": "cut.png: is damaged or truncated",
    "register chip.nc notes.txt --points points.csv": "notes.txt",
    f"{REGISTER} --points points.csv": "points: 1 for the model 'affine'",
    f"{REGISTER} --dots --frame 2": "--frame: 2, expected 0 to 1",
    f"{REGISTER} --dots --visible-frame 1": "--visible-frame: 1, expected 0 to 0",
    REGISTER: "expected one of --points FILE, --dots and --map FILE",
    f"{REGISTER} --dots --points points.csv": "expected one of --points FILE, --dots and",
    f"{REGISTER} --map m.yaml --points points.csv": "expected one of --points FILE, --dots and",
    f"{REGISTER} --dots": "infrared image: 0 dots are found, expected a",
    f"{REGISTER} --dots --align '1um,2um'": "'1um,2um', expected x and y such as -90um:-10um,20um",
    f"{REGISTER} --dots --align 9um:1um,0um:5um": "expected ranges from the smaller to the larger",
    f"{REGISTER} --dots --align 0:9,0:5": "expected x and y such as -90um:-10um,20um:120um",
    f"{REGISTER} --pairs p.csv": "--pairs requires --align",
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_refuses_in_one_line_and_writes_nothing(folder, command):
    before = sorted(folder.iterdir())
    assert COMMANDS[command] in refusal(command)
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "bad.csv: there is no number in it"),
        ("x,y,u,v\n1,2,3,4\n", "bad.csv, line 1: 'x' has no unit, expected a name such as x_um"),
        (
            "x_um,y_um,visible_column,visible_row\n1,2,3\n",
            "line 2: has 3 cells separated by ',', expected 4",
        ),
        (
            "x_um,y_um,visible_column,visible_row\n1,2,3,nan\n",
            "line 2: visible_row is 'nan', expected a number",
        ),
        ("x_um,y_um,visible_column,visible_row\n900,2,3,4\n", "outside the infrared image"),
        ("x_um,y_um,visible_column,visible_row\n9,20,3,400\n", "outside the visible picture"),
    ],
)
def test_a_table_of_points_that_is_none_is_refused(folder, text, expected):
    (folder / "bad.csv").write_text(text)
    assert expected in refusal(f"{REGISTER} --points bad.csv")


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            {"kind": "measured", "file": "e.nc", "region": "nose"},
            "region: 'nose' is not in .*e.nc, expected one of other",
        ),
        ({"measured": {"heated": "e.nc"}}, "e.nc: is of the features all, expected chip body"),
        ({"measured": {"chip 1": "e.nc"}}, "measured: 'chip 1' is the name of another chip"),
    ],
)
def test_a_study_of_measured_emissivities_refuses(folder, section, message):
    with pytest.raises(ValueError, match=message):
        surfaces_of(Study(surface=section).surface, 1)


def test_files_of_emissivities_are_refused(folder):
    for name, message in (
        ("hot.nc", "hot.nc: not an emissivity map"),
        ("empty.nc", "empty.nc: not an emissivity map"),
        ("none.nc", "none.nc"),
    ):
        with pytest.raises((ValueError, FileNotFoundError), match=message):
            em.read_emissivity_map(name)
    with pytest.raises(ValueError, match="by an earlier version"):
        em.read_emissivity_lines("old.nc")
