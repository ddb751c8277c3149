"""The uncertainty budget of a study: of the error of single readings, scene included."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd
import xarray as xr
from numba import get_num_threads, set_num_threads

from chipglow.analysis import outside_warnings
from chipglow.analysis.single import (
    BELOW,
    EXPOSURE,
    MEASURED,
    RANDOM,
    REFERENCE,
    TEXTURE,
    SingleReadings,
)
from chipglow.camera import Camera
from chipglow.io import open_scene
from chipglow.quantities import Array, changed
from chipglow.scene import Scene
from chipglow.study.fitting import fit, surfaces_on
from chipglow.study.running import Progress, cut, fitted_study, silent
from chipglow.study.schema import Study
from chipglow.surface import Surface
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Budget, Estimate, Input, Inputs, budget, first_order
from chipglow.uncertainty.budget import SAMPLES, TRIALS, VALIDATED, check_numbers
from chipglow.uncertainty.surrogate import Surrogate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCENE, SURFACE, CAMERA = "scene", "surface", "camera"
"""Groups of inputs, unless the study names others."""

_SURROGATE: Final = "scene settings between the cut ones"
_EXTREME: Final = 1e-6
"""Probability of the values beyond those that are tried before anything is computed."""

_SCENES: Final = 16
"""Scenes to cut, unless stated."""

_NOMINAL_DRAWS: Final = 32
"""Draws of the random inputs over which the error of a cut scene is a mean."""


@dataclass(frozen=True, eq=False)
class StudyBudget:
    """The budget of a study's readings.

    Parameters
    ----------
    readings : tuple of str
        Names of the readings, the outputs of the budget: their errors in K.
    places : tuple of str
        Name of the place of each reading.
    budget : Budget
        The budget of these errors.
    study : Study
        The study.
    notes : Notes
        Assumptions and warnings.
    surrogates : mapping
        The surrogate of each reading over the settings of the scene; empty without such inputs.
    """

    readings: tuple[str, ...]
    places: tuple[str, ...]
    budget: Budget
    study: Study
    notes: Notes
    surrogates: Mapping[str, Surrogate]

    def summary(self) -> pd.DataFrame:
        """Return a row for each reading: error, uncertainty, and the interval by Monte Carlo."""
        estimate, trials = self.budget.estimate, self.budget.monte_carlo
        return pd.DataFrame(
            {
                "reading": list(self.readings),
                "error_K": estimate.values,
                "standard_uncertainty_K": estimate.standard_uncertainty,
                "degrees_of_freedom": estimate.degrees_of_freedom,
                "coverage_factor": estimate.coverage_factor(),
                "expanded_uncertainty_K": estimate.expanded_uncertainty(),
                "monte_carlo_mean_K": trials.mean,
                "monte_carlo_standard_uncertainty_K": trials.standard_uncertainty,
                "low_K": trials.low,
                "high_K": trials.high,
                "validated": self._validated(),
            }
        )

    def _validated(self) -> list[str]:
        """Return whether Monte Carlo validates the GUM's intervals, if its trials are enough."""
        trials = self.budget.monte_carlo
        agrees = trials.validates(self.budget.estimate, VALIDATED)
        verdicts = np.where(trials.is_stable, np.where(agrees, "yes", "no"), "undecided")
        return [str(one) for one in verdicts]

    @property
    def group_names(self) -> list[str]:
        """Groups of the inputs; those that every study has come first."""
        return list(dict.fromkeys([SCENE, SURFACE, CAMERA, *self.to_frame().group]))

    def to_frame(self) -> pd.DataFrame:
        """Return the budget in the form of the GUM: a row for each reading and input."""
        inputs, estimate = self.budget.inputs, self.budget.estimate
        lines = {part.name: part for part in inputs.inputs}
        freedoms = {one.cause.name: one.cause.degrees_of_freedom for one in estimate.components}
        rows = []
        for output, reading in enumerate(self.readings):
            total = estimate.standard_uncertainty[output] ** 2
            for name in estimate.names:
                parts = [lines[one] for one in name.split(", ")]
                one, is_set = parts[0], len(parts) == 1 and parts[0].has_slope
                sources = dict.fromkeys(self._source(part.name) for part in parts)
                is_student = one.distribution == "normal" and np.isfinite(one.degrees_of_freedom)
                contribution = float(estimate.contribution(name)[output])
                slope = self.budget.sensitivity[inputs.names.index(one.name), output]
                rows.append(
                    {
                        "reading": reading,
                        "input": name,
                        "group": one.group,
                        "distribution": "t" if is_student else one.distribution,
                        "value": one.value if is_set else np.nan,
                        "standard_uncertainty": one.standard_uncertainty if is_set else np.nan,
                        "unit": one.unit if is_set else "",
                        "sensitivity": slope if is_set else np.nan,
                        "degrees_of_freedom": freedoms[name],
                        "contribution_K": contribution,
                        "variance_percent": 100 * contribution**2 / total if total else 0.0,
                        "source": "; ".join(sources),
                    }
                )
        return pd.DataFrame(rows)

    def plot(self) -> "Figure":
        """Draw the largest contributions to the uncertainty of each reading, and their total.

        Returns a figure, as each reading has its own panel.
        """
        from chipglow.study.budget_figure import draw_budget

        return draw_budget(self)

    def _repr_html_(self) -> str:
        return result_html("StudyBudget", self.summary(), self.notes)

    def indices(self) -> xr.Dataset:
        """Return Sobol's indices over ``reading`` and ``group``."""
        return self.budget.indices.rename(output="reading").assign_coords(
            reading=list(self.readings)
        )

    def groups(self) -> pd.DataFrame:
        """Return a row for each reading and group: its part of the variance in percent."""
        frame = (100 * self.indices()).to_dataframe(["reading", "group"]).reset_index()
        return frame.rename(columns=lambda name: name.replace("_order", "_order_percent"))

    def _source(self, name: str) -> str:
        if name in self.study.uncertainty.inputs:
            return self.study.uncertainty.inputs[name].source or "not stated"
        return "predictions of left-out scenes" if name == _SURROGATE else "drawn at random"


def study_budget(
    study: Study,
    at: Sequence[str] = (),
    trials: int = TRIALS,
    samples: int = SAMPLES,
    scenes: int = _SCENES,
    progress: Progress | None = None,
) -> StudyBudget:
    """Return the uncertainty budget of the errors of single readings.

    Parameters
    ----------
    study : Study
        The study; its section `uncertainty` has the input quantities.
    at : sequence of str
        Places or readings, such as ``rake face`` or ``band``; all by default.
    trials : int
        Largest number of trials of the Monte Carlo.
    samples : int
        Base samples of Sobol's indices, a power of 2.
    scenes : int
        Number of scenes to cut if a setting of the cut is an input.
    progress : callable, optional
        Called with the current step and its completed fraction, 0 to 1.

    Returns
    -------
    StudyBudget
        Texture, pixel position, noise and exposure (the segments of a cut) are inputs too.

    Raises
    ------
    ValueError
        If an input is not a number of the study or takes impossible values, or the scene is a file
        and a setting of the cut is an input.

    Notes
    -----
    A distribution that reaches beyond the limits of its setting is truncated there
    (`chipglow.uncertainty.Limits`).

    The effect of the cut's settings is a surrogate: of the mean errors on scenes at a Latin
    hypercube of their distributions. Its cross-validated error is an input.
    """
    tell = progress or silent
    check_numbers(trials, samples)
    with _prepared(study, at, scenes, progress) as ready:
        generator = np.random.default_rng(study.seed)
        found = budget(ready.model, ready.inputs, generator, trials, samples, progress=tell)
        notes = ready.doubts(found.monte_carlo.mean)
    names, places = ready.readings.names, ready.readings.places
    return StudyBudget(names, places, found, study, notes, ready.surrogates)


@dataclass(frozen=True, eq=False)
class _Ready:
    """A study's inputs and the function of them, before the propagation."""

    readings: SingleReadings
    inputs: Inputs
    read: Callable[[Array], Array]
    surrogates: Mapping[str, Surrogate]
    notes: Notes

    @property
    def model(self) -> Callable[[Array], Array]:
        """The function from values of the inputs to the errors of the readings in K."""
        return _model(self.read, self.inputs.inputs, list(self.surrogates.values()))

    def doubts(self, means: Array) -> Notes:
        """Return the notes with warnings of readings without a temperature; means of errors."""
        names = self.readings.names
        middle = self.inputs.at(np.full((1, len(self.inputs)), 0.5))
        outside = self.read(middle)[0, :, BELOW:]
        doubts = [
            text
            for name, parts in zip(names, outside.tolist(), strict=True)
            for text in outside_warnings(name, *parts)
        ]
        doubts += [
            f"{name}: in some draws the place has no pixel, or is not in the image."
            for name, value in zip(names, means, strict=True)
            if not np.isfinite(value)
        ]
        return self.notes + Notes(warnings=doubts)


@contextmanager
def _prepared(
    study: Study, at: Sequence[str], scenes: int, progress: Progress | None
) -> Iterator[_Ready]:
    """Yield the inputs of a study and the function of them, all that can be checked checked."""
    tell = progress or silent
    stated = study.uncertainty.build(study)
    is_cut = [one.name.startswith("cutting.") for one in stated.inputs]
    if any(is_cut) and study.scene is not None:
        raise ValueError(
            f"uncertainty.inputs: {stated.names[is_cut.index(True)]}: the scene is a file, "
            "expected a study that cuts (without scene)"
        )
    check_draws(study, stated)
    with fitted_study(study, progress, False) as fitted:
        readings = readings_of(study, fitted.scene, at, tell)
        inputs = [
            replace(one, group=SCENE) if one.group == "cutting" else one for one in stated.inputs
        ]
        groups = {EXPOSURE: SCENE, TEXTURE: SURFACE}
        inputs += [Input(name, group=groups.get(name, CAMERA)) for name in readings.random]
        surrogates, notes = dict[str, Surrogate](), fitted.notes + Notes(stated.truncated)
        if any(is_cut):
            surrogates, lost = _surrogates(study, stated, scenes, readings.names, at, tell)
            notes = notes + lost
            inputs.append(Input(_SURROGATE, 0.0, 1.0, "normal", group=SCENE))
        known = Inputs(inputs, stated.correlations)
        read = reader(study, fitted.scene, readings, known.names)
        yield _Ready(readings, known, read, surrogates, notes)


def first_order_errors(
    study: Study, at: Sequence[str], progress: Progress | None = None
) -> tuple[dict[str, Estimate], Notes]:
    """Return the error in K of the first reading of each place, to first order, and the notes."""
    with _prepared(study, at, _SCENES, progress) as ready:
        errors, _ = first_order(ready.model, ready.inputs, np.random.default_rng(study.seed))
        notes = ready.doubts(errors.values)
    known = list(zip(ready.readings.names, ready.readings.places, strict=True))
    numbers = {name: next(n for n, one in enumerate(known) if name in one) for name in at}
    return {name: errors[number] for name, number in numbers.items()}, notes


def check_draws(study: Study, inputs: Inputs) -> None:
    """Raise a ValueError if an input takes values with which the study is impossible.

    Limits of single settings truncate the distributions; here settings contradict each other.
    """
    for one in [part for part in inputs.inputs if part.name in study.uncertainty.inputs]:
        ends = one.at(np.array([_EXTREME, 1 - _EXTREME])).tolist()
        name = one.name.partition(".")[0]
        for value in one.values or ends:
            if name == "cutting":
                _changed(study, "", {one.name: value})
            else:
                _changed(getattr(study, name), f"{name}.", {one.name: value})


def errors_of(numbers: Array) -> Array:
    """Return the errors in K of the numbers of readings, shape (..., number)."""
    return np.asarray(numbers[..., MEASURED] - numbers[..., REFERENCE])


def readings_of(
    study: Study,
    scene: Scene,
    at: Sequence[str],
    tell: Progress = silent,
    longest: float | None = None,
) -> SingleReadings:
    """Return the readings of single exposures of a scene by a study's camera."""
    return SingleReadings(scene, *_seen(study, scene), study.plan, at, tell, longest)


def _seen(
    study: Study, scene: Scene, drawn: Mapping[str, float] = MappingProxyType({})
) -> tuple[Mapping[str, Surface], Camera]:
    """Return a study's surfaces and camera on a scene, drawn settings in place of its stated."""
    surface, camera = (
        _changed(getattr(study, name), f"{name}.", drawn) for name in (SURFACE, CAMERA)
    )
    return surfaces_on(scene, surface, study.seed)[0], camera.on(scene.raster, study.seed)


def _changed(part: Any, prefix: str, drawn: Mapping[str, float]) -> Any:
    """Return a section, or a study with the prefix "", with the drawn settings."""
    own = {path.removeprefix(prefix): one for path, one in drawn.items() if path.startswith(prefix)}
    try:
        return changed(part, own) if own else part
    except ValueError as reason:
        raise ValueError(
            f"uncertainty.inputs: a draw is impossible: {prefix}{reason}; state a smaller or a "
            "bounded uncertainty (half_width)"
        ) from None


def reader(
    study: Study, scene: Scene, readings: SingleReadings, names: Sequence[str]
) -> Callable[[Array], Array]:
    """Return the function from values of inputs, (trial, input), to (trial, reading, number)."""
    optical = [name for name in names if name.startswith(("camera.", "surface."))]
    nominal = _seen(study, scene)

    def read(row: Array) -> Array:
        values = dict(zip(names, row.tolist(), strict=True))
        drawn = {name: values[name] for name in optical}
        surfaces, camera = _seen(study, scene, drawn) if drawn else nominal
        return readings.read(camera, surfaces, values)

    def read_all(rows: Array) -> Array:
        with ThreadPoolExecutor(
            get_num_threads(), initializer=set_num_threads, initargs=(1,)
        ) as pool:
            return np.stack(list(pool.map(read, rows)))

    return read_all


def _model(
    read: Callable[[Array], Array], inputs: Sequence[Input], surrogates: Sequence[Surrogate]
) -> Callable[[Array], Array]:
    """Return the function from values of the inputs to the errors of the readings in K."""
    names = [one.name for one in inputs]
    cutting = [number for number, name in enumerate(names) if name.startswith("cutting.")]
    best = np.array([inputs[i].value for i in cutting])
    widths = np.array([inputs[i].standard_uncertainty for i in cutting])

    def errors(rows: Array) -> Array:
        result = errors_of(read(rows))
        if surrogates:
            points = (rows[:, cutting] - best) / widths
            middle = np.zeros((1, len(cutting)))
            for number, one in enumerate(surrogates):
                result[:, number] += one.at(points) - one.at(middle)
                result[:, number] += one.error * rows[:, names.index(_SURROGATE)]
        return result

    return errors


def _surrogates(
    study: Study,
    stated: Inputs,
    scenes: int,
    names: Sequence[str],
    at: Sequence[str],
    tell: Progress,
) -> tuple[dict[str, Surrogate], Notes]:
    """Cut scenes at a Latin hypercube of the inputs; return the surrogate of each reading."""
    from scipy.stats import qmc  # slow to import, and few need it

    generator = np.random.default_rng(study.seed)
    values = stated.at(qmc.LatinHypercube(len(stated), seed=generator).random(scenes))
    draws = generator.random((_NOMINAL_DRAWS, len(RANDOM)))
    rows = [i for i, one in enumerate(stated.inputs) if one.name.startswith("cutting.")]
    best, widths = (
        np.array([getattr(stated.inputs[i], name) for i in rows])
        for name in ("value", "standard_uncertainty")
    )
    means = np.full((scenes, len(names)), np.nan)
    for number, value in enumerate(values):
        tell("scenes", number / scenes)
        one = changed(study, {stated.names[i]: float(value[i]) for i in rows})
        scene = fit(one, open_scene(cut(one))).scene
        try:
            readings = readings_of(one, scene, at)
        except ValueError:  # the scene shows no shear band or no contact
            continue
        surfaces, camera = _seen(one, scene)
        errors = []
        for draw in draws:
            read = readings.read(camera, surfaces, dict(zip(RANDOM, draw, strict=True)))
            errors.append(errors_of(read))
        mean = dict(zip(readings.names, np.mean(errors, axis=0), strict=True))
        means[number] = [mean.get(name, np.nan) for name in names]
        scene.data.close()
    tell("scenes", 1.0)
    points = (values[:, rows] - best) / widths
    found = {}
    for name, column in zip(names, means.T, strict=True):
        known = np.isfinite(column)
        found[name] = Surrogate.fit(points[known], column[known])
    lost = int(np.isnan(means).all(axis=1).sum())
    text = f"{lost} of {scenes} scenes show no shear band or no contact; they are left out."
    return found, Notes(warnings=[text] if lost else [])
