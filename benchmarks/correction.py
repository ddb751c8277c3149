"""Corrected temperatures of known scenes: errors beside other methods, coverage of intervals.

python benchmarks/correction.py [--scenes 300] [--cuts 40] [--first 0] [--pixels 32]
    [--processes 2] [--minutes 60] [--rows FILE] [--join FILE ...]

Analytic scenes: a chip beside a tool with a straight outline, heated toward it, with a band, a
step, a plateau or a ridge of a random width. Cuts: eight exposures each of quick cutting
simulations at other speeds and feeds, beside the cutting edge and on the shear band; the surface
moves during the exposure. All are seen through an annular aperture and sampled at an eighth of a
pixel.

Three tables each: everything known but the noise; emissivity known to 5 % and the width of the
point spread function to 3 %; the outline stated up to half a pixel off. Baselines divide by the
emissivity, or restore the image before by Richardson-Lucy or a Wiener filter (scikit-image).
Behind coverages are 95 % intervals (Wilson), for pixels by the scatter between scenes.

The rows of finished scenes are added to FILE; a later run with the same FILE goes on where this
one ended, and no scene begins after the stated minutes. --join reads further such files, and with
--scenes 0 --cuts 0 only the tables of the files are printed. Cuts are kept in the cache.
"""

import csv
import multiprocessing
import os
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import time

import numpy as np
from common import arguments, print_tables
from correction_scenes import (
    BAND,
    CAMERA,
    DARK,
    EMISSIVITY,
    PITCH,
    VIEWS,
    TimeOverError,
    analytic,
    computed_cut,
    of_cut,
)
from numba import set_num_threads
from skimage import restoration

from chipglow.correction import correct

EMISSIVITY_KNOWN, WIDTH_KNOWN = 0.05, 0.03
"""Relative standard uncertainties of emissivity and width of the point spread function."""

BORDER = 5
"""Pixels at the border of the image that are not judged."""

CLEAR = 0.1
"""Relative step of the radiance from which on an outline is judged."""

LEVEL = 1.96
"""Standard deviations of a normal distribution that 95 % are within."""

PLACES = "rake face", "tool", "band", "rest"
METHODS = "emissivity alone", "Richardson-Lucy", "Wiener", "corrected"
CASES = "known", "emissivity 5 %, PSF 3 %", "outline off"
ANALYTIC, CUT = "analytic", "cut"
WORDS = "family", "kind", "case", "place"
NUMBERS = (
    *("seed", "view", "speed", "feed", "start", "width", "netd", "outline_off", "step", "pixels"),
    *(f"error {name}" for name in METHODS),
    *(f"square {name}" for name in METHODS),
    *("held", "half_width", "half_width_alone", "mean_error", "mean_half_width"),
)
"""Columns of a row: of its scene, and of one case and place. Errors are means over the pixels in K,
squares those of the squared errors, `held` is the fraction of pixels whose interval contains the
truth, half-widths are means over the pixels in K; the last two are of the mean of the place."""


def judged(task):
    """Return the rows of a scene; None if the time is over."""
    family, seed, view, pixels, end = task
    if time() > end:
        return None
    set_num_threads(1)
    one = analytic(seed, pixels) if family == ANALYTIC else of_cut(seed, view, pixels)
    draw = np.random.default_rng([57, seed, view] if view else [57, seed])
    error = 1 + EMISSIVITY_KNOWN * draw.normal(size=2)
    width = 1 + WIDTH_KNOWN * draw.normal()
    shift = draw.uniform(-0.5, 0.5) * PITCH
    plain = {"surroundings": DARK, "noise": one.netd, "seed": seed}
    wrong = tuple(np.array(EMISSIVITY) * error)
    spread = tuple(EMISSIVITY_KNOWN * np.array(EMISSIVITY))
    psf = replace(CAMERA.psf, numerical_aperture=CAMERA.psf.numerical_aperture / width)
    measured, camera = one.measurement, replace(CAMERA, psf=psf)
    doubtful = one.stated(wrong, spread)
    moved = one.stated(EMISSIVITY, shift=shift)
    results = (
        correct(measured, CAMERA, one.stated(EMISSIVITY), **plain),
        correct(measured, camera, doubtful, psf_uncertainty=WIDTH_KNOWN, **plain),
        correct(measured, CAMERA, moved, outline_uncertainty=0.5 * PITCH, **plain),
    )
    scene = {
        "family": family,
        "kind": one.kind,
        "seed": seed,
        "view": view,
        "width": one.width,
        "netd": one.netd,
        "outline_off": one.outline_off(shift, results[-1].data["outline_motion"][0].values),
        "step": one.step,
        **one.conditions,
    }
    assumed = EMISSIVITY, wrong, EMISSIVITY
    return [
        scene | {"case": case, "place": place} | row
        for case, result, emissivity in zip(CASES, results, assumed, strict=True)
        for place, row in rows_of(one, result, emissivity).items()
    ]


def rows_of(one, result, emissivity):
    """Return the numbers of each place."""
    data, truth = result.data.isel(time=0), one.truth
    shown = np.where(one.is_tool, *emissivity[::-1])
    kernel = CAMERA.psf.view_kernel(PITCH, *[one.image.shape[0] // 2 - 1] * 2)
    level = one.image.max()
    lucy = level * restoration.richardson_lucy(np.maximum(one.image, 0) / level, kernel, 20)
    wiener = level * restoration.wiener(one.image / level, kernel, 0.01, clip=False)
    images = [one.image / shown, lucy / shown, wiener / shown]
    values = [*(BAND.temperature(image) for image in images), data["temperature"].values]
    lower, upper = data["lower"].values, data["upper"].values
    # The radiance has an interval of this half-width, of the temperature by emissivity alone.
    known = BAND.radiance(values[0]) / BAND.slope(values[0])
    alone = LEVEL * EMISSIVITY_KNOWN * known
    inside = np.zeros(truth.shape, bool)
    inside[BORDER:-BORDER, BORDER:-BORDER] = True
    inside &= (data["zone"].values == one.is_tool) & np.isfinite(values[-1])
    rows = {}
    for place, mask in one.places.items():
        chosen = mask & inside
        rows[place] = {"pixels": int(chosen.sum())}
        if not chosen.any():
            continue
        errors = [(value - truth)[chosen] for value in values]
        mean = result.at(chosen)
        rows[place] |= {
            **{f"error {name}": np.nanmean(one) for name, one in zip(METHODS, errors, strict=True)},
            **{
                f"square {name}": np.nanmean(one**2)
                for name, one in zip(METHODS, errors, strict=True)
            },
            "held": ((lower <= truth) & (truth <= upper))[chosen].mean(),
            "half_width": ((upper - lower) / 2)[chosen].mean(),
            "half_width_alone": alone[chosen].mean(),
            "mean_error": float(mean.values) - truth[chosen].mean(),
            "mean_half_width": float(mean.expanded_uncertainty()),
        }
    return rows


def read_rows(path):
    """Return the rows of the complete scenes of a file by scene."""
    scenes = {}
    for row in csv.DictReader(whole_lines(path).splitlines()):
        if row["family"] == "family":  # the head of a file that was put behind another
            continue
        numbers = {name: float(row[name]) for name in NUMBERS}
        numbers |= {name: row[name] for name in WORDS}
        key = row["family"], int(row["seed"]), int(row["view"])
        scenes.setdefault(key, {})[row["case"], row["place"]] = numbers
    whole = len(CASES) * len(PLACES)
    return {key: list(rows.values()) for key, rows in scenes.items() if len(rows) == whole}


def whole_lines(path):
    """Return the text of a file without a last line that was cut off."""
    text = Path(path).read_text("utf-8")
    return text[: text.rfind("\n") + 1]


class Rows:
    """Rows of scenes by scene, and in a file if one is named."""

    def __init__(self, path):
        self.path, self.scenes = Path(path) if path else None, {}
        if self.path and self.path.exists():
            self.path.write_text(whole_lines(path), "utf-8")
            self.scenes = read_rows(path)
        elif self.path:
            self.path.write_text(",".join((*WORDS, *NUMBERS)) + "\n", "utf-8")

    def add(self, rows):
        """Keep the rows of a scene."""
        empty = dict.fromkeys(NUMBERS, np.nan)
        rows = [empty | row for row in rows]
        first = rows[0]
        self.scenes[first["family"], int(first["seed"]), int(first["view"])] = rows
        if self.path:
            with self.path.open("a", newline="", encoding="utf-8") as file:
                csv.DictWriter(file, (*WORDS, *NUMBERS), lineterminator="\n").writerows(rows)


def compute(kept, scenes, cuts, first, pixels, processes, end):
    """Compute the scenes that are not there, each cut before its scenes."""
    seeds = range(first, first + scenes)
    tasks = [(ANALYTIC, seed, 0, pixels, end) for seed in seeds]
    tasks = [task for task in tasks if task[:3] not in kept.scenes]
    views = {
        number: [
            (CUT, number, view, pixels, end)
            for view in range(VIEWS)
            if (CUT, number, view) not in kept.scenes
        ]
        for number in range(first, first + cuts)
    }
    views = {number: own for number, own in views.items() if own}
    if processes == 1:
        for number, own in views.items():
            tasks += own if cut_is_there((number, end)) else []
        for task in tasks:
            if rows := judged(task):
                kept.add(rows)
        return
    # Numerical libraries read these when a process starts: one thread each.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        pending = {pool.submit(cut_is_there, (number, end)): own for number, own in views.items()}
        pending |= {pool.submit(judged, task): None for task in tasks}
        while pending:
            for done in wait(pending, return_when=FIRST_COMPLETED).done:
                own, result = pending.pop(done), done.result()
                if own is not None and result:
                    pending |= {pool.submit(judged, task): None for task in own}
                elif own is None and result:
                    kept.add(result)


def cut_is_there(task):
    """Compute a cut; return whether it was in time."""
    number, end = task
    if time() > end:
        return False
    set_num_threads(1)
    try:
        computed_cut(number, end)
    except TimeOverError:
        return False
    return True


def column(rows, name):
    return np.array([row[name] for row in rows])


def weighted(rows, name):
    """Return the mean over the pixels of all rows."""
    return np.average(column(rows, name), weights=column(rows, "pixels"))


def fraction(values, weights=None):
    """Return a fraction in % with its 95 % interval (Wilson), by the scatter between scenes."""
    values = np.asarray(values, float)
    weights = np.ones(values.size) if weights is None else weights
    mean = np.average(values, weights=weights)
    count = float(values.size)
    variance = ((weights * (values - mean)) ** 2).sum() / weights.sum() ** 2
    if 0 < mean < 1 and variance > 0:
        count = mean * (1 - mean) / variance
    middle = (mean + LEVEL**2 / (2 * count)) / (1 + LEVEL**2 / count)
    spread = np.sqrt(mean * (1 - mean) / count + LEVEL**2 / (4 * count**2))
    half = LEVEL * spread / (1 + LEVEL**2 / count)
    return f"{100 * mean:.1f} % ({100 * (middle - half):.1f} to {100 * (middle + half):.1f})"


def print_case(case, rows):
    """Print the table of a case."""
    head = "place", *METHODS, "less", "bias", "better scenes", "held", "means held", "half-width"
    table = [(*head, "of emissivity 5 %", "scenes")]
    for place in PLACES:
        own = [row for row in rows if (row["case"], row["place"]) == (case, place)]
        own = [row for row in own if row["pixels"]]
        if not own:
            continue
        errors = [np.sqrt(weighted(own, f"square {name}")) for name in METHODS]
        better = column(own, "square corrected") <= column(own, "square emissivity alone")
        mean = np.abs(column(own, "mean_error")) <= column(own, "mean_half_width")
        half, alone = (weighted(own, name) for name in ("half_width", "half_width_alone"))
        cells = [place, *(f"{error:.1f} K" for error in errors)]
        cells += [f"{100 * (1 - errors[-1] / errors[0]):.0f} %"]
        cells += [f"{weighted(own, 'error corrected'):.1f} K", fraction(better)]
        cells += [fraction(column(own, "held"), column(own, "pixels")), fraction(mean)]
        table.append((*cells, f"{half:.1f} K", f"{half / alone:.2f}", str(len(own))))
    print(f"\n{case}")
    print_tables([table])


def print_widths(rows):
    """Print the coverage in the band by tenths of its width."""
    print("\nheld in the band by its width in pixels (emissivity 5 %, PSF 3 %)\n")
    rows = [row for row in rows if (row["case"], row["place"]) == (CASES[1], "band")]
    rows = [row for row in rows if row["pixels"] and np.isfinite(row["width"])]
    if not rows:
        return
    widths = column(rows, "width")
    edges = np.quantile(widths, np.linspace(0, 1, 11))
    for low, high in pairwise(edges):
        own = [row for row, width in zip(rows, widths, strict=True) if low <= width <= high]
        if own:
            held = fraction(column(own, "held"), column(own, "pixels"))
            print(f"{low:5.2f} to {high:5.2f}  {held} of {len(own)} scenes")


def print_outlines(rows):
    """Print how near outlines were found."""
    rows = [row for row in rows if (row["case"], row["place"]) == (CASES[2], "rest")]
    off = column([row for row in rows if row["step"] >= CLEAR], "outline_off")
    if off.size:
        print(f"\noutline found within 0.05 pixels: {fraction(off < 0.05)}", end="")
        print(f" of {off.size} with a step of the radiance of 10 % or more", end="")
        print(f"; median {np.median(off):.3f} pixels, largest {off.max():.2f}")


def main():
    numbers = {"scenes": 300, "cuts": 40, "first": 0, "pixels": 32, "processes": 2, "minutes": 60.0}
    args = arguments(__doc__, **numbers, rows="", join=[])
    end, kept = time() + 60 * args.minutes, Rows(args.rows)
    compute(kept, args.scenes, args.cuts, args.first, args.pixels, args.processes, end)
    scenes = dict(kept.scenes)
    for path in args.join:
        scenes |= read_rows(path)
    for family in (ANALYTIC, CUT):
        own = [rows for key, rows in scenes.items() if key[0] == family]
        rows = [row for of_scene in own for row in of_scene]
        if not rows:
            continue
        seeds = column(rows, "seed").astype(int)
        print(f"\n{len(own)} scenes ({family}) of seeds {seeds.min()} to {seeds.max()}")
        for case in CASES:
            print_case(case, rows)
        print_widths(rows)
        print_outlines(rows)


if __name__ == "__main__":
    main()
