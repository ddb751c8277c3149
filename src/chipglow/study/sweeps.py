"""Sweeps: a study at many settings, one file per point, continued after any interruption."""

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from hashlib import sha256
from importlib.metadata import version
from itertools import product
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias, get_args

import numpy as np
import pandas as pd
import xarray as xr

from chipglow.analysis import Analysis, headlines
from chipglow.io.atomic import atomic_path, exclusive
from chipglow.io.digest import content_digest
from chipglow.quantities import Quantity, adapter, changed, setting_at
from chipglow.study.running import Progress, cut, is_cut, run, scene_inputs
from chipglow.study.schema import Study
from chipglow.study.workers import Client, local_client, on_client
from chipglow.text import Notes, parse_yaml, result_html

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Method: TypeAlias = Literal["grid", "latin-hypercube", "sobol"]
"""All combinations of the values, or samples between the first and the last value."""

DESCRIPTION: Final = "sweep.json"
"""File in the folder of a sweep with its axes and points."""

NUMBERS: Final = ("reference", "error", "uncertainty", "psf_portion", "true_error")
"""Stored values of each reading in K; uncertainty: expanded, of the mean error."""

FRACTIONS: Final = ("below_range", "saturated")
"""Stored fractions of each reading's place below the lower range limit, and saturated."""

MOST_POINTS: Final = 100_000
"""Points of a sweep: each is a file in one folder, and a study in memory."""

SAMPLES: Final = 64
"""Sampled settings, unless stated: 2⁶, as Sobol's sequence is even for powers of 2."""

_POINTS: Final = "points"
_SCRATCH: Final = "workers"
"""Folder of the worker processes in that of a sweep, while they run."""

_RANGE: Final = re.compile(r"([^:]+):([^:]+)(?::(\d{1,18}))?")
_QUANTITY: Final = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@dataclass(frozen=True)
class Sweep:
    """A study at many settings, in its folder.

    Parameters
    ----------
    folder : Path
        Folder that contains a file for each computed point.
    axes : mapping
        Values of each varied setting by its path.
    settings : tuple of mapping
        Settings of each point, in SI where they have a unit.
    keys : tuple of str
        Names of the points' files: digests of study, scene and version.
    is_grid : bool
        Whether the points are all combinations of the values.
    quantities : mapping
        Quantity of each varied setting by its path; None without a unit.
    """

    folder: Path
    axes: Mapping[str, Sequence[Any]]
    settings: tuple[Mapping[str, Any], ...]
    keys: tuple[str, ...]
    is_grid: bool
    quantities: Mapping[str, Quantity | None]

    @classmethod
    def open(cls, folder: str | Path) -> "Sweep":
        """Open the sweep in a folder."""
        file = Path(folder) / DESCRIPTION
        try:
            return cls._stated(Path(folder), file.read_text(encoding="utf-8"))
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
            raise ValueError(f"{file}: is damaged; run the sweep again") from None

    @classmethod
    def _stated(cls, folder: Path, text: str) -> "Sweep":
        """Return the sweep that a text like that of `DESCRIPTION` states."""
        stated = json.loads(text)
        points, keys = tuple(stated["settings"]), tuple(stated["keys"])
        quantities = {
            path: None if one is None else Quantity(**one)
            for path, one in stated["quantities"].items()
        }
        return cls(folder, stated["axes"], points, keys, stated["is_grid"], quantities)

    @cached_property
    def records(self) -> tuple[Mapping[str, Any] | None, ...]:
        """Content of each point's file; None if the point is missing or its file is damaged."""
        return tuple(map(_record, (point_file(self.folder, key) for key in self.keys)))

    @property
    def missing(self) -> tuple[int, ...]:
        """Indices of the points that are not computed yet."""
        return tuple(i for i, one in enumerate(self.records) if one is None)

    @property
    def failed(self) -> dict[int, str]:
        """Reasons by the index of the point that failed."""
        every = enumerate(self.records)
        return {i: str(one["failed"]) for i, one in every if one is not None and "failed" in one}

    def to_frame(self) -> pd.DataFrame:
        """Return a table with one row per point and reading: settings in SI, and numbers in K."""
        rows = [
            {"point": i, **self.settings[i], "reading": name}
            | {f"{number}_K": numbers[number] for number in NUMBERS}
            | {name: numbers[name] for name in FRACTIONS}
            for i, readings in enumerate(self._readings)
            for name, numbers in readings.items()
        ]
        names = [*(f"{number}_K" for number in NUMBERS), *FRACTIONS]
        frame = pd.DataFrame(rows, columns=["point", *self.axes, "reading", *names])
        return frame.astype(dict.fromkeys(names, np.float64))

    def plot(self) -> "Figure":
        """Draw the error of each reading over the settings: a curve, or a map over two.

        Returns a figure, as each reading has its own panels.

        Raises
        ------
        ValueError
            If no point is computed.
        """
        from chipglow.study.sweep_figure import draw_sweep

        data = self.to_xarray()
        if not data.sizes["reading"]:
            raise ValueError("sweep: no point is computed, so there is nothing to draw")
        return draw_sweep(data, self.quantities)

    def _repr_html_(self) -> str:
        warnings = [f"Point {index} failed: {reason}" for index, reason in self.failed.items()]
        if self.missing:
            warnings.append(f"{len(self.missing)} of {len(self.keys)} points are not computed yet.")
        return result_html("Sweep", self.to_frame(), Notes(warnings=warnings))

    def to_xarray(self) -> xr.Dataset:
        """Return `NUMBERS` in K and `FRACTIONS` over settings and ``reading``; NaN if unknown.

        A grid has a dimension named by the path of each setting. Otherwise the dimension is
        ``point``, with the settings as coordinates. Settings with a unit are in SI.
        """
        names = list(dict.fromkeys(name for one in self._readings for name in one))
        values = np.array(
            [
                [[one.get(name, {}).get(number) for name in names] for one in self._readings]
                for number in (*NUMBERS, *FRACTIONS)
            ],
            np.float64,  # None becomes NaN
        )
        settings = {path: [one[path] for one in self.settings] for path in self.axes}
        dims: list[str] = ["point"]
        coordinates: dict[str, Any] = {path: ("point", one) for path, one in settings.items()}
        if self.is_grid:
            dims = list(self.axes)
            coordinates = {path: list(dict.fromkeys(one)) for path, one in settings.items()}
        shape = [len(coordinates[dim]) for dim in dims] if self.is_grid else [len(self.keys)]
        data = values.reshape(len(values), *shape, len(names))
        units = dict.fromkeys(NUMBERS, "K") | dict.fromkeys(FRACTIONS, "1")
        variables = {
            number: ((*dims, "reading"), one, {"units": unit})
            for (number, unit), one in zip(units.items(), data, strict=True)
        }
        return xr.Dataset(variables, coords=coordinates | {"reading": names})

    @property
    def _readings(self) -> list[Mapping[str, Mapping[str, float]]]:
        return [(record or {}).get("readings", {}) for record in self.records]


def sweep(
    study: Study,
    vary: Mapping[str, str | Sequence[Any]],
    out: str | Path,
    at: Sequence[str] = (),
    method: Method = "grid",
    samples: int = SAMPLES,
    seed: int = 0,
    client: Client | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Run a study at many settings; points that were computed before are not computed again.

    Parameters
    ----------
    study : Study
        The study; every point has its seed.
    vary : mapping
        Values by the path of a setting such as ``camera.integration_time``: a sequence, or text
        such as ``2 us, 5 us`` or ``6 um:20 um:8`` (first, last, number).
    out : str or Path
        Folder of the results, of an earlier sweep or new.
    at : sequence of str
        Readings to keep, such as ``rake`` and ``band``; all by default.
    method : {"grid", "latin-hypercube", "sobol"}
        All combinations of the values, or samples between the first and the last value of each.
    samples, seed : int
        Number of samples, and the seed of their choice.
    client : distributed.Client, optional
        Client of a Dask cluster that computes the points.
    workers : int, optional
        Without a client: number of processes on this machine, by default one per core; 0 computes
        in this process.
    progress : callable, optional
        Called with the current step and the fraction of it that is complete.

    Returns
    -------
    Sweep
        The results; points that failed are in `Sweep.failed`, with the reason.

    Raises
    ------
    ValueError
        If a path or a value is impossible for all points, the folder contains other files, or
        another sweep is running in it.
    ConnectionError
        If the workers do not start or are lost; the computed points are kept.
    """
    tell, folder = progress or (lambda step, done: None), Path(out)
    axes = {path: axis(values) for path, values in vary.items()}
    points = list(points_of(axes, method, samples, seed))
    # None of these is kept of a point, and each takes longer than the rest.
    left_out = {"analysis.psf_widths": ("8 um",), "attribution": None, "correction": False}
    study = changed(study, left_out)
    studies = studies_at(study, points)
    settings = [{path: in_si(study, path, one[path]) for path in one} for one in points]
    quantities = {path: quantity_of(study, path) for path in axes}
    digest = cache(content_digest)  # each file is read once
    keys = [_key(one, at, digest) for one in studies]
    description = {
        "axes": {path: list(map(str, values)) for path, values in axes.items()},
        "settings": settings,
        "keys": keys,
        "is_grid": method == "grid",
        "quantities": {path: one and asdict(one) for path, one in quantities.items()},
    }
    text = json.dumps(description, indent=1)
    _check_folder(folder)
    running = f"{folder}: another sweep is running there; wait for its end or choose another folder"
    with exclusive(folder / _POINTS, running):
        with atomic_path(folder / DESCRIPTION) as temporary:
            temporary.write_text(text, encoding="utf-8")
        tasks = {
            key: (one, tuple(at), path)
            for key, one in zip(keys, studies, strict=True)
            if not _is_done(path := point_file(folder, key))
        }
        _compute(list(tasks.values()), client, workers, tell, folder.resolve() / _SCRATCH)
    return Sweep._stated(folder, text)


@dataclass(frozen=True)
class Impossible:
    """A point at which there is no study, with the reason."""

    reason: str


def _compute(
    tasks: Sequence[tuple[Study | Impossible, tuple[str, ...], Path]],
    client: Client | None,
    workers: int | None,
    tell: Progress,
    scratch: Path,
) -> None:
    """Compute the scenes of points that are not in the cache, then the points."""
    new = [one for one, *_ in tasks if isinstance(one, Study) and one.scene is None]
    scenes = {json.dumps(scene_inputs(one)): one for one in new}
    cuts = [(one,) for one in scenes.values() if not is_cut(one)]
    with local_client(client, workers, max(len(tasks), len(cuts)), scratch) as computing:
        for step, function, arguments in (("cuts", _cut, cuts), ("points", compute_point, tasks)):
            for count, _ in enumerate(on_client(computing, function, arguments), 1):
                tell(step, count / len(arguments))


def axis(values: str | Sequence[Any]) -> list[Any]:
    """Return the values of a varied setting: a list, or a text with a list or a range."""
    if not isinstance(values, str):
        return list(values)
    if (ends := _RANGE.fullmatch(values)) is None:
        return [parse_yaml(one) for one in values.split(",")]
    first, last, count = ends.groups()
    number = int(count or 2)
    if number > MOST_POINTS:
        raise ValueError(f"{values}: makes {number} values, expected up to {MOST_POINTS}")
    return [between(first, last, part) for part in np.linspace(0.0, 1.0, number)]


def between(first: object, last: object, part: float) -> str | float:
    """Return the value at a fraction of the way between two values with the same unit."""
    low, high = (_QUANTITY.fullmatch(str(end)) for end in (first, last))
    if low is None or high is None or low[2] != high[2]:
        raise ValueError(f"{first}:{last}: a range needs two numbers with the same unit")
    value = float(low[1]) + part * (float(high[1]) - float(low[1]))
    if low[2]:
        return f"{value:.12g} {low[2]}"
    return int(value) if value.is_integer() and "." not in low[1] + high[1] else value


def point_file(folder: Path, key: str) -> Path:
    """Return the file of a point."""
    return folder / _POINTS / f"{key}.json"


def compute_point(study: Study | Impossible, at: Sequence[str], path: Path) -> None:
    """Analyse a study and write its readings; an error is written with its reason."""
    if _is_done(path):
        return
    try:
        if isinstance(study, Impossible):
            raise ValueError(study.reason)
        record = _numbers(run(study), at)
    except Exception as error:
        record = {"failed": f"{type(error).__name__}: {error}"}
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(record, indent=1), encoding="utf-8")


def _numbers(analysis: Analysis, at: Sequence[str]) -> dict[str, Any]:
    known = headlines(analysis.data)
    kept = {name: one for name, one in known.items() if not at or name in at or one.place in at}
    if missing := [name for name in at if not any(name in (k, o.place) for k, o in kept.items())]:
        raise ValueError(f"{', '.join(missing)}: not read, expected any of {', '.join(known)}")
    readings = {}
    for name, one in kept.items():
        values = (
            one.reference.mean,
            one.error.mean,
            one.error.expanded_uncertainty,
            one.psf_portion.mean,
            one.true_error.mean,
        )
        place = analysis.data.sel(reading=name)
        fractions = (float(place[fraction]) for fraction in FRACTIONS)
        numbers = map(_finite, (*values, *fractions))
        readings[name] = dict(zip((*NUMBERS, *FRACTIONS), numbers, strict=True))
    return {"readings": readings}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _cut(study: Study) -> None:
    """Compute the scene of a study; an error is left to its points."""
    try:
        cut(study)
    except Exception:
        return


def points_of(
    axes: Mapping[str, Sequence[Any]], method: Method, samples: int, seed: int
) -> Iterator[dict[str, Any]]:
    """Yield the settings of each point as a study takes them."""
    if not axes:
        raise ValueError("vary: name at least one setting")
    count = prod(map(len, axes.values())) if method == "grid" else samples
    if not 1 <= count <= MOST_POINTS:
        raise ValueError(f"vary: makes {count} points, expected 1 to {MOST_POINTS}")
    if method == "grid":
        for values in product(*axes.values()):
            yield dict(zip(axes, values, strict=True))
        return
    from scipy.stats import qmc  # slow to import, and few need it

    makers = {"latin-hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}
    if method not in makers:
        raise ValueError(f"method: {method!r} is unknown, expected one of {get_args(Method)}")
    generator = np.random.default_rng(seed)
    for row in makers[method](len(axes), seed=generator).random(samples):
        parts = zip(axes.items(), row, strict=True)
        yield {path: between(values[0], values[-1], part) for (path, values), part in parts}


def studies_at(study: Study, points: Sequence[Mapping[str, Any]]) -> list[Study | Impossible]:
    """Return the study of each point, or why it is impossible."""
    studies: list[Study | Impossible] = []
    for point in points:
        try:
            studies.append(changed(study, point))
        except (ValueError, LookupError) as error:
            studies.append(Impossible(f"{point_text(point)}: {error}"))
    reasons = [one.reason for one in studies if isinstance(one, Impossible)]
    if len(reasons) == len(studies):
        raise ValueError(reasons[0])
    return studies


def point_text(point: Mapping[str, Any]) -> str:
    """Return a point's settings as text, as they were given."""
    return ", ".join(f"{path} = {value}" for path, value in point.items())


def in_si(study: Study, path: str, value: Any) -> Any:
    """Return the value of a setting in SI; as it was given without a unit or if it is a range."""
    quantity = quantity_of(study, path)
    try:
        return quantity.parse(value) if quantity and isinstance(value, str) else value
    except ValueError:
        return value


def quantity_of(study: Study, path: str) -> Quantity | None:
    """Return the quantity of a setting; None without a unit, or if the study lacks the setting."""
    try:
        return setting_at(study, path).parameter.quantity
    except LookupError:
        return None


def _key(
    study: Study | Impossible, at: Sequence[str], digest: Callable[[str], str] = content_digest
) -> str:
    """Return the digest of all that determines a point's numbers."""
    if isinstance(study, Impossible):
        return _digest(study.reason)
    content = adapter(Study).dump_python(study, mode="json")
    del content["title"], content["wavelengths"], content["uncertainty"]
    if study.scene is None:
        content["cutting"] = scene_inputs(study)
    return _digest([_contents(content, digest), sorted(at), version("chipglow")])


def _contents(value: Any, digest: Callable[[str], str]) -> Any:
    """Return a value with the content of each file, a full path, in place of its name."""
    if isinstance(value, Mapping):
        return {key: _contents(one, digest) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_contents(one, digest) for one in value]
    if isinstance(value, str) and Path(value).is_absolute() and Path(value).is_file():
        return digest(value)
    return value


def _digest(content: Any) -> str:
    return sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:32]


def _check_folder(folder: Path) -> None:
    """Refuse a folder with other files than those of a sweep, and make that of the points."""
    is_sweep = (folder / DESCRIPTION).exists()
    if not is_sweep and any(one.name != _POINTS for one in folder.rglob("*")):
        raise ValueError(f"{folder}: contains no sweep; choose a new or empty folder")
    (folder / _POINTS).mkdir(parents=True, exist_ok=True)


def _record(path: Path) -> Mapping[str, Any] | None:
    """Return the content of a point's file; None if it is missing or damaged."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError, RecursionError):
        return None
    if not isinstance(record, dict):
        return None
    readings = record.get("readings")
    if isinstance(readings, dict):
        is_whole = all(map(_has_numbers, readings.values()))
    else:
        is_whole = isinstance(record.get("failed"), str)
    return record if is_whole else None


def _has_numbers(reading: Any) -> bool:
    """Return whether a stored reading has all numbers, finite or None."""
    return (
        isinstance(reading, dict)
        and reading.keys() == {*NUMBERS, *FRACTIONS}
        and all(one is None or isinstance(one, float) for one in reading.values())
    )


def _is_done(path: Path) -> bool:
    """Return whether a point was computed; one that failed is computed again."""
    record = _record(path)
    return record is not None and "failed" not in record
