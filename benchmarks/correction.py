"""Corrected temperatures of analytic scenes: errors beside other methods, coverage of intervals.

python benchmarks/correction.py [--scenes 300] [--first 0] [--pixels 32] [--processes 2]
    [--minutes 60]

A scene is a chip beside a tool with a straight outline, heated toward it, with a band, a step, a
plateau or a ridge of a random width, seen through an annular aperture and sampled at an eighth of
a pixel. It continues beyond the image. No scene begins after the stated minutes.
Three tables: everything known but the noise; emissivity known to 5 % and the width of the point
spread function to 3 %; the outline stated up to half a pixel off. Baselines divide by the
emissivity, or restore the image before by Richardson-Lucy or a Wiener filter (scikit-image).
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from time import time

import numpy as np
from common import arguments
from numba import set_num_threads
from skimage import restoration

from chipglow import AnnularAperturePSF, Band, Camera, Estimate, Measurement, Raster
from chipglow.camera import image_formation
from chipglow.correction import Zone, correct
from chipglow.scene import Polygon, Region

BAND = Band(3.8e-6, 5.1e-6)
PITCH, SAMPLES = 6e-6, 8
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), psf_order="optics", lower_limit=None)
EMISSIVITY = 0.42, 0.58
"""Of chip and tool: the paper's."""

EMISSIVITY_KNOWN, WIDTH_KNOWN = 0.05, 0.03
"""Relative standard uncertainties of emissivity and width of the point spread function."""

DARK = Estimate(np.array(200.0))
MARGIN = 16
"""Pixels by which a scene continues beyond its image on each side."""

BORDER = 5
"""Pixels at the border of the image that are not judged."""

CLEAR = 0.1
"""Relative step of the radiance from which on an outline is judged."""

KINDS = "band", "step", "plateau", "ridge", "plain"
PLACES = "rake face", "tool", "band", "rest"
METHODS = "emissivity alone", "Richardson-Lucy", "Wiener", "corrected"
CASES = "known", "emissivity 5 %, PSF 3 %", "outline off"


@dataclass(frozen=True)
class Scene:
    """A scene of one seed: temperatures on samples, places, and what the camera shows."""

    kelvins: np.ndarray
    to_tool: np.ndarray
    """Distance to the outline in m, positive in the tool; on samples."""
    from_band: np.ndarray
    """Distance from the middle of the band in m; on samples."""
    width: float
    """Full width at half maximum of the band in pixels."""
    netd: float
    outline: tuple[float, float, float]
    """Direction of the outline's normal and its position along it."""
    image: np.ndarray


def scene(seed, pixels):
    """Return a scene."""
    draw = np.random.default_rng([56, seed])
    samples = raster(pixels, SAMPLES, MARGIN)
    x, y = np.meshgrid(samples.x, samples.y)
    side = pixels * PITCH
    lean = np.deg2rad(draw.uniform(-25, 25))
    normal = np.cos(lean), np.sin(lean)
    place = side * draw.uniform(0.62, 0.77) - side / 2
    to_tool = (x - side / 2) * normal[0] + (y - side / 2) * normal[1] - place
    base, across, along = draw.uniform(780, 950), draw.normal(0, 60), draw.normal(0, 60)
    heat, chip_depth = draw.uniform(80, 350), draw.uniform(3, 12) * PITCH
    chip = base + across * (x / side - 0.5) + along * (y / side - 0.5)
    chip += heat * np.exp(np.minimum(to_tool, 0) / chip_depth)
    contact, tool_depth = base + heat - 450 + draw.normal(0, 20), draw.uniform(8, 25) * PITCH
    tool = 450 + contact * np.exp(-np.maximum(to_tool, 0) / tool_depth)
    width, rise = draw.uniform(1.5, 6.0), draw.uniform(100, 350)
    turn = draw.uniform(0, np.pi)
    middle = side * draw.uniform(0.25, 0.45), side * draw.uniform(0.3, 0.7)
    from_band = (x - middle[0]) * np.cos(turn) + (y - middle[1]) * np.sin(turn)
    chip += rise * profile(KINDS[seed % len(KINDS)], from_band / (width * PITCH / 2.355))
    netd = float(np.exp(draw.uniform(np.log(0.1), np.log(2.0))))
    kelvins = np.where(to_tool > 0, tool, chip)
    shining = np.where(to_tool > 0, *EMISSIVITY[::-1]) * BAND.radiance(kelvins)
    image = image_formation(CAMERA, samples, pixels=raster(pixels)).forward(shining)
    image = image + draw.normal(0, netd * float(BAND.slope(600.0)), image.shape)
    edge = slice(MARGIN * SAMPLES, -MARGIN * SAMPLES)
    fields = (field[edge, edge] for field in (kelvins, to_tool, from_band))
    return Scene(*fields, width, netd, (*normal, place), image)


def profile(kind, distance):
    """Return a band, a step, a plateau or a ridge over the distance in standard deviations."""
    if kind == "band":
        return np.exp(-(distance**2) / 2)
    if kind == "step":
        return 0.5 * (1 + np.tanh(distance))
    if kind == "plateau":
        return 0.5 * (np.tanh(1.5 * (distance + 3)) - np.tanh(1.5 * (distance - 3)))
    if kind == "ridge":
        return np.exp(-np.abs(distance))
    return np.zeros_like(distance)


def raster(pixels, parts=1, margin=0):
    count = (pixels + 2 * margin) * parts
    return Raster(-margin * PITCH, (pixels + margin) * PITCH, PITCH / parts, count, count)


def zones(one, pixels, emissivity, uncertainty=(0.0, 0.0), shift=0.0):
    """Return the zones as stated: emissivities, and the outline shifted along its normal in m."""
    side = pixels * PITCH
    normal = np.array(one.outline[:2])
    point = np.array([side / 2, side / 2]) + normal * (one.outline[2] + shift)
    along, far = 2 * side * np.array([-normal[1], normal[0]]), 3 * side * normal
    corners = point - along, point + along, point + along + far, point - along + far
    tool = Region("tool", Polygon(tuple(map(tuple, corners))), unit="m")
    return [
        Zone("chip", emissivity[0], None, uncertainty[0]),
        Zone("tool", emissivity[1], tool, uncertainty[1]),
    ]


def means(values):
    """Return the means over pixels of values on samples."""
    rows, columns = (count // SAMPLES for count in values.shape)
    return values.reshape(rows, SAMPLES, columns, SAMPLES).mean(axis=(1, 3))


def judged(arguments):
    """Return for each case and place: pixels, errors by method, and how intervals hold."""
    seed, pixels, end = arguments
    if time() > end:
        return None
    set_num_threads(1)
    one, draw = scene(seed, pixels), np.random.default_rng([57, seed])
    measured = Measurement.from_radiance(one.image[None], BAND, np.zeros(1), raster(pixels))
    error = 1 + EMISSIVITY_KNOWN * draw.normal(size=2)
    width = 1 + WIDTH_KNOWN * draw.normal()
    shift = draw.uniform(-0.5, 0.5) * PITCH
    plain = {"surroundings": DARK, "noise": one.netd, "seed": seed}
    wrong = tuple(np.array(EMISSIVITY) * error)
    spread = tuple(EMISSIVITY_KNOWN * np.array(EMISSIVITY))
    psf = replace(CAMERA.psf, numerical_aperture=CAMERA.psf.numerical_aperture / width)
    known = correct(measured, CAMERA, zones(one, pixels, EMISSIVITY), **plain)
    doubtful = correct(
        measured,
        replace(CAMERA, psf=psf),
        zones(one, pixels, wrong, spread),
        psf_uncertainty=WIDTH_KNOWN,
        **plain,
    )
    moved = zones(one, pixels, EMISSIVITY, shift=shift)
    fitted = correct(measured, CAMERA, moved, outline_uncertainty=0.5 * PITCH, **plain)
    found = fitted.data["outline_motion"][0].values[:2] @ np.array(one.outline[:2])
    rows = {
        "known": rows_of(one, known, EMISSIVITY),
        "emissivity 5 %, PSF 3 %": rows_of(one, doubtful, wrong),
        "outline off": rows_of(one, fitted, EMISSIVITY),
    }
    return one.width, rows, abs(found + shift) / PITCH, step_of(one)


def step_of(one):
    """Return the relative change of the radiance across the outline, averaged along it."""
    sides = [
        (shine * BAND.radiance(one.kelvins))[(side > 0) & (side < 0.3 * PITCH)].mean()
        for shine, side in zip(EMISSIVITY, (-one.to_tool, one.to_tool), strict=True)
    ]
    return abs(sides[1] / sides[0] - 1)


def rows_of(one, result, emissivity):
    """Return the row of each place."""
    data = result.data.isel(time=0)
    is_tool = means(np.where(one.to_tool > 0, 1.0, 0.0)) > 0.5
    own = np.repeat(np.repeat(is_tool, SAMPLES, 0), SAMPLES, 1) == (one.to_tool > 0)
    radiance = means(np.where(own, BAND.radiance(one.kelvins), 0.0)) / means(own.astype(float))
    truth = BAND.temperature(radiance)
    shown = np.where(is_tool, *emissivity[::-1])
    kernel = CAMERA.psf.view_kernel(PITCH, *[one.image.shape[0] // 2 - 1] * 2)
    level = one.image.max()
    lucy = level * restoration.richardson_lucy(np.maximum(one.image, 0) / level, kernel, 20)
    wiener = level * restoration.wiener(one.image / level, kernel, 0.01, clip=False)
    images = [one.image / shown, lucy / shown, wiener / shown]
    values = [*(BAND.temperature(image) for image in images), data["temperature"].values]
    held = (data["lower"].values <= truth) & (truth <= data["upper"].values)
    half = (data["upper"].values - data["lower"].values) / 2
    # The radiance has an interval of this half-width, of the temperature by emissivity alone.
    known = BAND.radiance(values[0]) / BAND.slope(values[0])
    alone = 1.96 * EMISSIVITY_KNOWN * known
    distance, band = means(one.to_tool), np.abs(means(one.from_band))
    inside = np.zeros(truth.shape, bool)
    inside[BORDER:-BORDER, BORDER:-BORDER] = True
    masks = {
        "rake face": ~is_tool & (distance > -PITCH),
        "tool": is_tool & (distance < PITCH),
        "band": ~is_tool & (distance < -3 * PITCH) & (band < (one.width / 4 + 0.3) * PITCH),
        "rest": ~is_tool & (distance < -2 * PITCH),
    }
    rows = {}
    for place, mask in masks.items():
        chosen = mask & inside & (data["zone"].values == is_tool)
        squares = [np.nansum((value - truth)[chosen] ** 2) for value in values]
        mean = np.nan
        if chosen.any():
            estimate = result.at(chosen)
            off = abs(float(estimate.values) - truth[chosen].mean())
            mean = off <= float(estimate.expanded_uncertainty())
        rows[place] = (
            int(chosen.sum()),
            squares,
            int(held[chosen].sum()),
            half[chosen].sum(),
            alone[chosen].sum(),
            mean,
        )
    return rows


def print_case(case, results):
    """Print the table of a case."""
    print(f"\n{case}\n")
    print(f"{'place':10} " + " ".join(f"{name:>17}" for name in METHODS), end="")
    print(f" {'less':>6} {'better scenes':>13} {'held':>7} {'mean held':>9} {'half-width':>10}")
    for place in PLACES:
        rows = [rows[case][place] for _, rows, *_ in results if rows[case][place][0]]
        if not rows:
            continue
        counts, squares, held, half, alone, mean = (
            np.array(column) for column in zip(*rows, strict=True)
        )
        errors = np.sqrt(squares.sum(axis=0) / counts.sum())
        better = (squares[:, -1] <= squares[:, 0]).mean()
        print(f"{place:10} " + " ".join(f"{error:15.1f} K" for error in errors), end="")
        print(
            f" {100 * (1 - errors[-1] / errors[0]):4.0f} % {100 * better:11.0f} % "
            f"{100 * held.sum() / counts.sum():5.1f} % {100 * mean.mean():7.1f} % "
            f"{half.sum() / counts.sum():8.1f} K, {half.sum() / alone.sum():.2f} of that of an "
            "emissivity of 5 %"
        )


def print_widths(results):
    """Print the coverage in the band by tenths of its width."""
    print("\nheld in the band by its width in pixels (emissivity 5 %, PSF 3 %)\n")
    widths = np.array([width for width, *_ in results])
    edges = np.quantile(widths, np.linspace(0, 1, 11))
    rows = [rows["emissivity 5 %, PSF 3 %"]["band"] for _, rows, *_ in results]
    for low, high in pairwise(edges):
        chosen = [row for row, width in zip(rows, widths, strict=True) if low <= width <= high]
        count, held = (sum(row[i] for row in chosen) for i in (0, 2))
        if count:
            print(f"{low:5.2f} to {high:5.2f}  {100 * held / count:5.1f} % of {count} pixels")


def main():
    args = arguments(__doc__, scenes=300, first=0, pixels=32, processes=2, minutes=60)
    end = time() + 60 * args.minutes
    tasks = [(args.first + number, args.pixels, end) for number in range(args.scenes)]
    if args.processes == 1:
        results = [judged(task) for task in tasks]
    else:
        with ProcessPoolExecutor(args.processes) as pool:
            results = list(pool.map(judged, tasks))
    results = [result for result in results if result is not None]
    print(f"{len(results)} scenes of {args.pixels} x {args.pixels} pixels, from {args.first}")
    for case in CASES:
        print_case(case, results)
    print_widths(results)
    off = np.array([off for _, _, off, step in results if step >= CLEAR])
    if off.size:
        print(f"\n{off.size} outlines with a step of the radiance of 10 % or more", end=": ")
        print(f"{100 * (off < 0.05).mean():.0f} % found within 0.05 pixels", end="")
        print(f"; median {np.median(off):.3f} pixels, largest {off.max():.2f}")


if __name__ == "__main__":
    main()
