"""The choice of settings: those with the smallest bias and uncertainty of single readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.analysis.outside import MOST_OUTSIDE
from chipglow.analysis.single import BELOW, RANDOM, SATURATED
from chipglow.quantities import Array, Brief, Quantity, setting_at
from chipglow.scene import Scene
from chipglow.study.budgets import check_draws, errors_of, reader, readings_of
from chipglow.study.running import Progress, fitted_study, silent
from chipglow.study.schema import Study
from chipglow.study.sweeps import (
    SAMPLES,
    Impossible,
    Method,
    axis,
    in_si,
    point_text,
    points_of,
    quantity_of,
    studies_at,
)
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Input, Inputs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DRAWS: Final = 1024
"""Draws of the inputs for the last settings, unless stated."""

_KEPT: Final = 4
"""A round keeps one setting of this many, and draws this many times as often."""

_FEWEST_DRAWS: Final = 16
"""Fewest draws of a search."""

_FEWEST_KEPT: Final = 4
"""Fewest settings that a round of a search keeps."""

_COVERAGE_FACTOR: Final = 2.0
"""Standard deviations of an expanded uncertainty."""


@dataclass(frozen=True, eq=False, repr=False)
class Design(Brief):
    """Settings of a study with bias and uncertainty of its readings.

    Parameters
    ----------
    settings : tuple of mapping
        The settings in SI by path; the first are the study's own.
    readings : tuple of str
        Names of the readings.
    bias, expanded_uncertainty : ndarray
        Mean error and twice the standard deviation of the errors in K, shape (setting, reading);
        NaN for an impossible setting.
    below, saturated : ndarray
        Mean fractions of a reading's place below the lower range limit and saturated, likewise.
    draws : ndarray
        Readings of each setting.
    reasons : mapping
        Why a setting, by its number, is impossible or beyond a limit.
    notes : Notes
        Assumptions and warnings.
    quantities : mapping
        Quantity of each varied setting by its path; None without a unit.
    """

    settings: tuple[Mapping[str, Any], ...]
    readings: tuple[str, ...]
    bias: Array
    expanded_uncertainty: Array
    below: Array
    saturated: Array
    draws: NDArray[np.int64]
    reasons: Mapping[int, str]
    notes: Notes
    quantities: Mapping[str, Quantity | None]

    @property
    def objectives(self) -> Array:
        """Largest absolute bias and largest expanded uncertainty in K, shape (setting, 2)."""
        return np.stack(
            [np.abs(self.bias).max(axis=1), self.expanded_uncertainty.max(axis=1)], axis=1
        )

    @property
    def regret(self) -> Array:
        """Bias and uncertainty together, less those of the best setting, in K.

        The sum bounds the error of a reading that is not corrected (JCGM 100:2008, F.2.4.5). NaN
        for a setting that was excluded before the last two rounds, except the study's own.
        """
        total = self.objectives.sum(axis=1)
        least = np.nan if self.best is None else total[self.best]
        compared = self._compared
        compared[0] = True
        return np.where(compared, total - least, np.nan)

    @property
    def best(self) -> int | None:
        """Index of the best setting; None if none is within the limits."""
        last = self._compared & (self.draws == self.draws.max())
        total = np.where(last, self.objectives.sum(axis=1), np.inf)
        return int(total.argmin()) if last.any() else None

    @property
    def is_pareto(self) -> NDArray[np.bool_]:
        """Whether no other setting of the last two rounds has less bias and less uncertainty."""
        return np.asarray(_ranks(self.objectives, self._compared) == 0)

    @property
    def _compared(self) -> NDArray[np.bool_]:
        """Whether a setting is within the limits and was drawn in one of the last two rounds."""
        allowed = np.array([number not in self.reasons for number in range(len(self.settings))])
        return np.asarray(allowed & (_KEPT * self.draws >= self.draws.max()))

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each setting, the best first; the largest values of the readings."""
        bias, uncertainty = self.objectives.T
        frame = pd.DataFrame(list(self.settings)).assign(
            bias_K=bias,
            expanded_uncertainty_K=uncertainty,
            regret_K=self.regret,
            below_range=self.below.max(axis=1),
            saturated=self.saturated.max(axis=1),
            draws=self.draws,
            pareto=self.is_pareto,
            own=np.arange(len(self.settings)) == 0,
            excluded=[self.reasons.get(number, "") for number in range(len(self.settings))],
        )
        order = np.lexsort([frame.regret_K, frame.excluded != ""])
        return frame.iloc[order]

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw bias and uncertainty of each setting, the Pareto front, and the best setting.

        New axes are made by default.
        """
        from chipglow.study.design_figure import plot_design

        return plot_design(self, ax)

    def _repr_html_(self) -> str:
        return result_html("Design", self.to_frame(), self.notes)


def design(
    study: Study,
    vary: Mapping[str, str | Sequence[Any]],
    at: Sequence[str] = (),
    method: Method = "grid",
    samples: int = SAMPLES,
    draws: int = DRAWS,
    below: float = MOST_OUTSIDE,
    saturated: float = MOST_OUTSIDE,
    progress: Progress | None = None,
) -> Design:
    """Find the settings with the smallest bias and uncertainty of single readings.

    Parameters
    ----------
    study : Study
        The study; its section `uncertainty` has the input quantities.
    vary : mapping
        Values by the path of a setting of camera or surface, as in `sweep`.
    at : sequence of str
        Places or readings; all by default. The largest bias and uncertainty of them count.
    method, samples
        As in `sweep`.
    draws : int
        Draws of the inputs for the last settings.
    below, saturated : float
        Largest fractions of a place below the lower range limit, and saturated.
    progress : callable, optional
        Called with the current step and its completed fraction, 0 to 1.

    Raises
    ------
    ValueError
        If a path is not of camera or surface, all settings are impossible, or draws are below 16.

    Notes
    -----
    All settings see the same moments, the middles of exposures of the longest integration time that
    the scene allows, with the same draws. Distributions are truncated as in `study_budget`.

    Successive halving (Karnin et al., 2013) by quarters: all settings have the same few draws, the
    first of a Sobol sequence; the best quarter (4 or more, and the study's own) has four times as
    many, and so on. The Pareto front passes first, then the sum of bias and uncertainty decides.
    Uncertain settings of the cut are left out: the scene is the study's.
    """
    tell = progress or silent
    for path in vary:
        if path.partition(".")[0] not in ("camera", "surface"):
            raise ValueError(f"vary: {path!r}, expected a path in camera, surface")
    if draws < _FEWEST_DRAWS:
        raise ValueError(f"draws: {draws}, expected {_FEWEST_DRAWS} or more")
    axes = {path: axis(values) for path, values in vary.items()}
    points = list(points_of(axes, method, samples, study.seed))
    studies = [study, *studies_at(study, points)]
    every = [{path: setting_at(study, path).value for path in axes}, *points]
    settings = [{path: in_si(study, path, one[path]) for path in one} for one in every]
    unique = [n for n, one in enumerate(settings) if one not in settings[:n]]
    labels = ["own settings", *map(point_text, points)]
    cases = {labels[n]: studies[n] for n in unique}
    quantities = {path: quantity_of(study, path) for path in axes}
    with fitted_study(study, progress, False) as fitted:
        search = _Search(cases, fitted.scene, tuple(at), study.seed)
        counts = [draws]
        while counts[0] >= _FEWEST_DRAWS * _KEPT:
            counts.insert(0, counts[0] // _KEPT)
        for number, count in enumerate(counts):
            kept = search.kept(max(len(unique) // _KEPT**number, _FEWEST_KEPT), below, saturated)
            for done, one in enumerate(kept):
                tell(f"round {number + 1} of {len(counts)}", done / len(kept))
                search.extend(one, count)
            tell(f"round {number + 1} of {len(counts)}", 1.0)
        notes = fitted.notes + Notes(_inputs(study).truncated)
    if any(path.startswith("cutting.") for path in study.uncertainty.inputs):
        notes = notes + Notes(["The scene is exact: uncertain settings of the cut are left out."])
    return search.result([settings[n] for n in unique], below, saturated, notes, quantities)


class _Search:
    """Values of the readings at each setting, as far as they are drawn."""

    def __init__(
        self, cases: Mapping[str, Study | Impossible], scene: Scene, at: tuple[str, ...], seed: int
    ) -> None:
        self.labels, self.studies = list(cases), list(cases.values())
        self.scene, self.at, self.seed = scene, at, seed
        self.reasons = {
            n: one.reason for n, one in enumerate(self.studies) if isinstance(one, Impossible)
        }
        self.names: tuple[str, ...] = ()
        self.numbers: dict[int, Array] = {}
        self.longest = self._longest()

    def extend(self, number: int, draws: int) -> None:
        """Read at a setting until it has this many draws."""
        from scipy.stats import qmc  # slow to import, and few need it

        study = self.studies[number]
        if isinstance(study, Impossible):
            return
        try:
            inputs = _inputs(study)
            check_draws(study, inputs)
            readings = readings_of(study, self.scene, self.at, longest=self.longest)
            earlier = self.numbers.get(number, np.zeros((0, len(readings.names), SATURATED + 1)))
            sequence = qmc.Sobol(len(inputs), seed=np.random.default_rng(self.seed))
            numbers = sequence.random_base2((draws - 1).bit_length())
            rows = inputs.at(numbers[len(earlier) : draws])
            read = reader(study, self.scene, readings, inputs.names)
            self.numbers[number] = np.concatenate([earlier, read(rows)])
        except ValueError as error:
            if not number:  # the study itself
                raise
            self.reasons[number] = f"{self.labels[number]}: {error}"
            return
        self.names = readings.names

    def _longest(self) -> float | None:
        """Return the longest integration time for which the scene shows all places."""
        own, *others = self.studies
        if isinstance(own, Impossible):
            return None
        names = readings_of(own, self.scene, self.at).names
        times = {one.camera.integration_time for one in others if isinstance(one, Study)}
        for time in sorted(times, reverse=True):
            if time <= own.camera.integration_time:
                break
            try:
                if readings_of(own, self.scene, self.at, longest=time).names == names:
                    return time
            except ValueError:  # the scene is shorter
                continue
        return own.camera.integration_time

    def kept(self, count: int, below: float, saturated: float) -> list[int]:
        """Return the numbers of the best settings, and the study's own; at first all."""
        if not self.numbers:
            return list(range(len(self.studies)))
        found = self.result([{}] * len(self.studies), below, saturated, Notes(), {})
        allowed = np.array([n not in found.reasons for n in range(len(self.studies))])
        ranks = _ranks(found.objectives, allowed)
        order = np.lexsort([found.objectives.sum(axis=1), ranks, ~allowed])
        return sorted({0, *(n for n in order[:count].tolist() if allowed[n])})

    def result(
        self,
        settings: Sequence[Mapping[str, Any]],
        below: float,
        saturated: float,
        notes: Notes,
        quantities: Mapping[str, Quantity | None],
    ) -> Design:
        """Return bias, uncertainty and excluded settings as they are known."""
        shape = len(settings), len(self.names)
        bias, spread, lost, full = (np.full(shape, np.nan) for _ in range(4))
        draws, reasons = np.zeros(len(settings), np.int64), dict(self.reasons)
        for n, numbers in self.numbers.items():
            errors = errors_of(numbers)
            draws[n], bias[n] = len(errors), errors.mean(axis=0)
            spread[n] = _COVERAGE_FACTOR * errors.std(axis=0, ddof=1)
            lost[n], full[n] = numbers[..., [BELOW, SATURATED]].mean(axis=0).T
            for parts, most, state in (
                (lost[n], below, "below the lower range limit"),
                (full[n], saturated, "saturated"),
            ):
                if parts.max() > most:
                    worst = self.names[parts.argmax()]
                    reasons[n] = f"{self.labels[n]}: {worst}: {parts.max():.0%} of it is {state}"
            if not np.isfinite(bias[n]).all():
                reasons[n] = f"{self.labels[n]}: a place is not in every image"
        return Design(
            settings=tuple(settings),
            readings=self.names,
            bias=bias,
            expanded_uncertainty=spread,
            below=lost,
            saturated=full,
            draws=draws,
            reasons=reasons,
            notes=notes,
            quantities=quantities,
        )


def _inputs(study: Study) -> Inputs:
    """Return the uncertain settings of camera and surface, and the random inputs."""
    stated = study.uncertainty.build(study)
    optical = [one for one in stated.inputs if not one.name.startswith("cutting.")]
    names = {one.name for one in optical}
    pairs = [pair for pair in stated.correlations if names.issuperset(pair[:2])]
    return Inputs([*optical, *map(Input, RANDOM)], pairs)


def _ranks(objectives: Array, allowed: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the number of the Pareto front of each setting, from 0; -1 if it is not allowed."""
    other = objectives[:, None]
    is_better = np.all(other <= objectives, axis=-1) & np.any(other < objectives, axis=-1)
    ranks, rest, front = np.full(len(objectives), -1), allowed, 0
    while rest.any():
        first = rest & ~is_better[rest].any(axis=0)
        ranks[first] = front
        rest, front = rest & ~first, front + 1
    return ranks
