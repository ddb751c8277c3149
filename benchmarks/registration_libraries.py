"""Registration of infrared and visible images: chipglow's `fit_images` beside image libraries.

    python benchmarks/registration_libraries.py [--pairs 56] [--only METHOD ...]

The pairs are the 56 of docs/do/registration.md, drawn by `dual_spectrum.py`. SimpleITK maximises
Mattes' mutual information of the images, or the correlation of their edges (gradients over the
contrast of their surroundings, as in `fit_images`), from coarse to fine by regular steps, first a
similarity, then the requested model, from the ten best of a grid of placements with the limits of
`fit_images`. scikit-image takes the peak of the cross-correlation of edges over the same turns and
scales. SimpleITK's settings are the best of 35 on ten other pairs, of seeds 8000 to 8009.

No library states an uncertainty. Its result counts as doubtful if a placement over 8 pixels away is
80 % as good, if the edges' correlation is low, or if it refuses. All pairs take half an hour.
"""

import argparse
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from itertools import islice, product
from math import cos, hypot, radians, sin
from typing import Any, Literal, TypeAlias

import numpy as np
from dual_spectrum import DualSpectrum, errors
from numpy.typing import NDArray
from scipy.ndimage import gaussian_gradient_magnitude
from skimage.filters import window
from skimage.registration import phase_cross_correlation
from skimage.transform import AffineTransform, warp

from chipglow.laboratory.registration import Registration, fit_images
from chipglow.scene import Raster
from chipglow.text import Notes

sitk: Any = import_module("SimpleITK") if find_spec("SimpleITK") else None

Image: TypeAlias = NDArray[np.float64]
Matrix: TypeAlias = NDArray[np.float64]
Model: TypeAlias = Literal["similarity", "affine"]
Place: TypeAlias = tuple[float, float, float, float]
Tried: TypeAlias = list[tuple[float, Matrix]]

SEEDS: tuple[tuple[range, Model], ...] = (
    (range(9000, 9012), "affine"),
    (range(9100, 9124), "affine"),
    (range(9200, 9220), "similarity"),
)
SCALES, TURNS, REACH, STEP = (0.8, 0.9, 1.0, 1.1, 1.25), (-4.0, 0.0, 4.0), 0.25, 4
LEAST_OVERLAP, STARTS, APART = 0.5, 10, 6.0
FAR, RIVAL, LOW = 8.0, 0.8, 0.03
LEVELS = [4, 2, 1]
BINS, COARSE, FINE, WINDOW = 32, 1.0, 0.6, 5.0


@dataclass(frozen=True)
class Pair:
    """Input of a method: images, raster of the pixels and model of the map."""

    infrared: Image
    raster: Raster
    visible: NDArray[np.uint8]
    model: Model

    @property
    def pitch(self) -> float:
        """Width of a visible pixel in pixels, if both images were equally wide."""
        return float(self.infrared.shape[1] / self.visible.shape[1])

    @property
    def middle(self) -> NDArray[np.float64]:
        rows, columns = self.infrared.shape
        return np.array([columns - 1, rows - 1]) / 2

    def placed(self, scale: float, turn: float, across: float, down: float) -> Matrix:
        """Return a similarity about the middle from pixel to visible pixel; turn in radians."""
        linear = scale * np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
        return self.to_pixels(linear, self.middle + np.array([across, down]) - linear @ self.middle)

    def to_pixels(self, linear: Matrix, offset: NDArray[np.float64]) -> Matrix:
        """Return the matrix from pixel to visible pixel for a map in units of pixels."""
        matrix = np.eye(3)
        rows, columns = self.visible.shape
        matrix[:2, :2] = linear / self.pitch
        matrix[:2, 2] = (offset - self.middle) / self.pitch + np.array([columns - 1, rows - 1]) / 2
        return matrix

    def registration(self, matrix: Matrix, warnings: Iterable[str]) -> Registration:
        """Return a map from pixels to visible pixels as one from m, without covariance."""
        step = self.raster.spacing
        before = np.array(
            [[1 / step, 0, -self.raster.x[0] / step], [0, -1 / step, self.raster.y[0] / step]]
        )
        full = matrix @ np.vstack([before, [0, 0, 1]])
        none = np.zeros((9, 9))
        return Registration(
            full, none, self.model, "mutual-information", notes=Notes(warnings=list(warnings))
        )


def mapped(matrix: Matrix, places: NDArray[np.float64]) -> NDArray[np.float64]:
    return places @ matrix[:2, :2].T + matrix[:2, 2]


def distance(one: Matrix, other: Matrix, pair: Pair) -> float:
    """Return the greater distance of two maps in pixels at two corners."""
    corners = np.stack([np.zeros(2), 2 * pair.middle])
    apart = mapped(one, corners) - mapped(other, corners)
    return float(np.hypot(*apart.T).max()) * pair.pitch


def overlap(matrix: Matrix, pair: Pair) -> float:
    """Return the fraction of the pixels that lie on the visible picture."""
    rows, columns = np.indices(pair.infrared.shape)[:, ::8, ::8]
    column, row = mapped(matrix, np.stack([columns, rows], axis=-1).reshape(-1, 2)).T
    height, width = pair.visible.shape
    inside = (column > 0) & (row > 0) & (column < width - 1) & (row < height - 1)
    return float(inside.mean())


def best_first(tried: Tried) -> Tried:
    return sorted(tried, key=lambda entry: entry[0], reverse=True)


def rivals(tried: Tried, pair: Pair) -> Iterator[str]:
    """Yield a warning for each distant placement that is nearly as good as the first."""
    most, best = tried[0]
    for good, matrix in tried[1:]:
        if good > RIVAL * most and distance(best, matrix, pair) > FAR:
            yield "another placement fits nearly as well"


# SimpleITK


def itk_images(pair: Pair, edges: float = 0.0) -> tuple[Any, Any]:
    """Return both images in pixels, centred on each other, or their edges of a width."""
    fixed, moving = (
        sitk.GetImageFromArray(image.astype(np.float32)) for image in (pair.infrared, pair.visible)
    )
    moving.SetSpacing((pair.pitch, pair.pitch))
    rows, columns = pair.visible.shape
    moving.SetOrigin((pair.middle - pair.pitch * np.array([columns - 1, rows - 1]) / 2).tolist())
    if not edges:
        return fixed, moving
    noise = np.median(np.abs(pair.infrared - sitk.GetArrayFromImage(sitk.Median(fixed, [1, 1]))))
    faint = hypot(3 * 1.4826 * float(noise), 0.02 * float(pair.infrared.std()))
    return itk_contrast(fixed, edges, faint), itk_contrast(
        moving, edges, 0.5 * float(pair.visible.std())
    )


def itk_contrast(image: Any, edges: float, faint: float) -> Any:
    """Return the gradient's magnitude over the contrast of the surroundings."""
    smooth = sitk.SmoothingRecursiveGaussian
    variance = sitk.Abs(smooth(sitk.Square(image - smooth(image, WINDOW)), WINDOW))
    magnitude = sitk.GradientMagnitudeRecursiveGaussian(image, edges)
    return magnitude / sitk.Sqrt(variance + faint**2)


def itk_method(metric: str) -> Any:
    method = sitk.ImageRegistrationMethod()
    if metric == "information":
        method.SetMetricAsMattesMutualInformation(BINS)
    else:
        method.SetMetricAsCorrelation()
    method.SetMetricSamplingStrategy(method.NONE)
    method.SetInterpolator(sitk.sitkLinear)
    return method


def itk_similarity(place: Place, pair: Pair) -> Any:
    transform = sitk.Similarity2DTransform()
    transform.SetCenter(pair.middle.tolist())
    transform.SetParameters(place)
    return transform


def itk_scores(images: tuple[Any, Any], metric: str, pair: Pair) -> dict[Place, float]:
    """Return the metric of each placement of the grid at a quarter of the resolution."""
    coarse = [
        sitk.Shrink(sitk.SmoothingRecursiveGaussian(image, 2.0), [factor] * 2)
        for image, factor in zip(images, (STEP, round(STEP / pair.pitch)), strict=True)
    ]
    reach = int(REACH * pair.infrared.shape[1] / STEP)
    found: dict[Place, float] = {}
    for scale, turn in product(SCALES, TURNS):
        method = itk_method(metric)
        method.SetOptimizerAsExhaustive([0, 0, reach, reach], STEP)
        method.SetOptimizerScales([1.0] * 4)
        method.SetInitialTransform(itk_similarity((scale, radians(turn), 0.0, 0.0), pair), False)

        def note(method: Any = method) -> None:
            found[method.GetOptimizerPosition()] = -method.GetMetricValue()

        method.AddCommand(sitk.sitkIterationEvent, note)
        method.Execute(*coarse)
    return found


def itk_starts(scores: Mapping[Place, float], pair: Pair) -> list[Place]:
    """Return the best distinct placements that overlap enough, the best first."""
    kept: list[tuple[Place, Matrix]] = []
    for place in sorted(scores, key=scores.__getitem__, reverse=True):
        matrix = pair.placed(*place)
        if overlap(matrix, pair) >= LEAST_OVERLAP and all(
            distance(matrix, other, pair) > APART for _, other in kept
        ):
            kept.append((place, matrix))
        if len(kept) == STARTS:
            break
    return [place for place, _ in kept]


def itk_climb(
    images: tuple[Any, Any], transform: Any, metric: str, levels: list[int]
) -> tuple[float, bool]:
    """Optimise the transform; return the metric and whether the steps converged."""
    method = itk_method(metric)
    method.SetShrinkFactorsPerLevel(levels)
    method.SetSmoothingSigmasPerLevel([level // 2 for level in levels])
    method.SetOptimizerAsRegularStepGradientDescent(1.0, 1e-3, 200, 0.6)
    method.SetOptimizerScalesFromPhysicalShift()
    method.SetInitialTransform(transform, True)
    try:
        method.Execute(*images)
    except RuntimeError:
        return 0.0, False
    return -method.GetMetricValue(), method.GetOptimizerIteration() < 200


def itk_refined(
    images: tuple[Any, Any], place: Place, metric: str, pair: Pair
) -> tuple[float, Matrix, bool]:
    """Refine a placement; return the metric, the map and whether the steps converged."""
    transform = itk_similarity(place, pair)
    good, ended = itk_climb(images, transform, metric, LEVELS)
    if pair.model == "affine":
        affine = sitk.AffineTransform(2)
        affine.SetCenter(transform.GetCenter())
        affine.SetMatrix(transform.GetMatrix())
        affine.SetTranslation(transform.GetTranslation())
        good, ended = itk_climb(images, affine, metric, LEVELS[-1:])
        transform = affine
    corner, right, below = (
        np.array(transform.TransformPoint(point)) for point in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    )
    linear = np.stack([right - corner, below - corner], axis=1)
    return good, pair.to_pixels(linear, corner), ended


def itk_grid(pair: Pair) -> Registration:
    """Maximise mutual information from a grid of placements."""
    images = itk_images(pair)
    starts = itk_starts(itk_scores(images, "information", pair), pair)
    return itk_best(pair, images, starts, "information")


def itk_edges(pair: Pair) -> Registration:
    """Maximise the correlation of edges, from placements with a high product of both metrics."""
    information = itk_scores(itk_images(pair), "information", pair)
    correlation = itk_scores(itk_images(pair, COARSE), "edges", pair)
    scores = {place: information[place] * correlation[place] for place in correlation}
    starts = itk_starts(scores, pair)
    return itk_best(pair, itk_images(pair, FINE), starts, "edges")


def itk_best(pair: Pair, images: tuple[Any, Any], starts: list[Place], metric: str) -> Registration:
    climbed = [itk_refined(images, place, metric, pair) for place in starts]
    tried = best_first([(good, matrix) for good, matrix, _ in climbed])
    warnings = set(rivals(tried, pair))
    if metric == "edges" and tried[0][0] < LOW:
        warnings.add("the edges have little in common")
    return pair.registration(tried[0][1], warnings)


# scikit-image


def edge_images(pair: Pair) -> tuple[Image, Image]:
    """Return the edges of both images at the resolution of the pixels."""
    seen = gaussian_gradient_magnitude(pair.visible.astype(float), COARSE / pair.pitch)
    found = gaussian_gradient_magnitude(pair.infrared, COARSE)
    return found / found.std(), seen / seen.std()


def laid(image: Image, matrix: Matrix, pair: Pair) -> Image:
    """Resample a visible picture on the pixels."""
    inverse = AffineTransform(matrix=matrix)
    return np.asarray(warp(image, inverse, output_shape=pair.infrared.shape, mode="edge"))


def correlated(pair: Pair) -> Tried:
    """Return the shift by cross-correlation for each turn and scale, the best first."""
    hot, seen = edge_images(pair)
    taper = window(("tukey", 0.3), hot.shape)
    tried = []
    for scale, turn in product(SCALES, TURNS):
        matrix = pair.placed(scale, radians(turn), 0.0, 0.0)
        there = laid(seen, matrix, pair)
        fields = (taper * (field - field.mean()) for field in (hot, there))
        (down, right), error, _ = phase_cross_correlation(
            *fields, upsample_factor=10, normalization=None
        )
        shift = np.eye(3)
        shift[:2, 2] = -right, -down
        tried.append((1.0 - float(error) ** 2, matrix @ shift))
    return best_first(tried)


def skimage_correlation(pair: Pair) -> Registration:
    tried = correlated(pair)
    return pair.registration(tried[0][1], set(rivals(tried, pair)))


# The comparison


def own(pair: Pair) -> Registration:
    return fit_images(pair.infrared, pair.raster, pair.visible, pair.model).registration


METHODS: dict[str, Callable[[Pair], Registration | None]] = {
    "chipglow": own,
    "SimpleITK, information, grid": itk_grid,
    "SimpleITK, edges, grid": itk_edges,
    "scikit-image, correlation": skimage_correlation,
}


@dataclass(frozen=True)
class Outcome:
    """Error and stated uncertainty of a map in pixels; infinite for no map."""

    error: float
    stated: float
    doubtful: bool
    seconds: float


def judged(name: str, pair: Pair, truth: DualSpectrum) -> Outcome:
    begin = time.process_time()
    try:
        found = METHODS[name](pair)
    except (ValueError, RuntimeError):
        found = None
    seconds = time.process_time() - begin
    if found is None:
        return Outcome(np.inf, 0.0, True, seconds)
    return Outcome(*errors(found, truth), bool(found.notes.warnings), seconds)


def drawn_pairs() -> Iterator[tuple[Pair, DualSpectrum]]:
    for seeds, model in SEEDS:
        for seed in seeds:
            truth = DualSpectrum.drawn(seed)
            measured = truth.infrared
            yield Pair(measured.radiance[0], measured.raster, truth.visible, model), truth


def row(name: str, found: list[Outcome]) -> str:
    """Return a method's row of the table."""
    error = np.array([outcome.error for outcome in found])
    sure = np.array([not outcome.doubtful for outcome in found])
    beyond = sum(outcome.stated > 0 and outcome.error > 2 * outcome.stated for outcome in found)
    cells = [
        f"{np.mean(error < 1):.0%}",
        f"{np.mean(error < 3):.0%}",
        f"{np.median(error):.2f}",
        f"{np.mean(sure):.0%}",
        f"{np.mean(sure & (error >= 3)):.0%}",
        f"{error[sure].max():.1f}" if sure.any() else "-",
        f"{beyond}" if any(outcome.stated for outcome in found) else "none stated",
        f"{np.median([outcome.seconds for outcome in found]):.1f}",
    ]
    return f"| {name} | {' | '.join(cells)} |"


HEAD = (
    "| method | under 1 | under 3 | median | sure | sure, 3 or more | greatest, sure "
    "| over twice the stated | s |\n|" + "---|" * 9
)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--pairs", type=int, default=56, help="the first so many of the 56")
    parser.add_argument("--only", nargs="+", choices=METHODS, default=list(METHODS))
    given = parser.parse_args()
    names = [name for name in given.only if sitk or not name.startswith("SimpleITK")]
    if sitk is None:
        print("SimpleITK is not installed: left out (pip install SimpleITK)\n")
    else:
        sitk.ProcessObject.SetGlobalWarningDisplay(False)
        sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    warnings.simplefilter("ignore")
    pairs = list(islice(drawn_pairs(), given.pairs))
    print(f"{len(pairs)} pairs; errors are rms over the image, in infrared pixels\n")
    print(HEAD)
    for name in names:
        print(row(name, [judged(name, *pair) for pair in pairs]), flush=True)


if __name__ == "__main__":
    main()
