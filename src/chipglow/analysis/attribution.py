"""Attribution: the error of each pixel divided among the effects that cause it (Shapley values)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from math import comb, factorial
from typing import Annotated, Final, Literal, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis.cut import middle_start
from chipglow.analysis.images import Array, ExposureImages, read_temperature, reference_temperature
from chipglow.analysis.places import Place
from chipglow.camera import UNUSABLE, Camera, Exposure, range_flags
from chipglow.camera.exposure import View, expose
from chipglow.camera.exposure_kernels import Check
from chipglow.camera.optics.sampling import integrate, largest
from chipglow.quantities import Parameter, Part
from chipglow.scene import Raster, Scene
from chipglow.surface import EmissivityField, ModifiedSurface, Surface, UniformSurface

EFFECTS: Final = (
    "emissivity",
    "reflection",
    "exposure",
    "psf",
    "optics",
    "footprint",
    "detector",
    "digitiser",
)
"""Effects in the order of the light, from the surface to the counts.

``detector`` is that of the detector's terms such as noise, ``digitiser`` that of full well,
saturation and rounding to counts.
"""

REST: Final = "other effects"
BLUR: Final = "psf and footprint"
"""Group of a point spread function that includes the pixel's footprint."""

MAX_EXACT: Final = 8
"""Number of effects up to which all combinations are computed."""

AttributionReference: TypeAlias = Literal["true-maximum", "maximum"]
_Coalition: TypeAlias = frozenset[str]
_Value: TypeAlias = Callable[[_Coalition], Array]
_KELVIN: Final = {"units": "K"}


@dataclass(frozen=True)
class AttributionPlan(Part):
    """Effects among which the error of each pixel is divided.

    Raises
    ------
    ValueError
        If an effect is named twice.
    """

    effects: Annotated[
        tuple[str, ...],
        Parameter(
            "Effects: any of " + ", ".join(EFFECTS) + ", or the kind of a term of the camera's "
            "optics or detector; the others form a group. Empty: all that the camera has."
        ),
    ] = ()
    reference: Annotated[
        AttributionReference,
        Parameter(
            "Reading without any effect: the largest true temperature in the pixel's square during "
            "the exposure (true-maximum), or the largest radiance temperature (maximum), which "
            "contains emissivity and reflection."
        ),
    ] = "true-maximum"
    permutations: Annotated[
        int,
        Parameter(
            f"Orders of the effects that are sampled if there are over {MAX_EXACT}.", least=4
        ),
    ] = 64

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(set(self.effects)) < len(self.effects):
            raise ValueError(f"effects: {list(self.effects)}, each effect can be named only once")


def attribute(
    scene: Scene,
    camera: Camera,
    surface: Surface,
    start: float | None = None,
    effects: Sequence[str] = (),
    reference: AttributionReference = "true-maximum",
    permutations: int = 64,
    seed: int = 0,
    check: Check | None = None,
) -> xr.Dataset:
    """Divide the error of each pixel of one exposure among the effects that cause it.

    Parameters
    ----------
    scene : Scene
        The true fields.
    camera : Camera
        The camera.
    surface : Surface
        The surface.
    start : float, optional
        Start of the exposure in s; by default in the middle of the scene's longest part.
    effects : sequence of str
        Any of `EFFECTS`, or the ``kind`` of a term of the camera's optics or detector. The
        effects that are not named form one group. By default all that the camera has.
    reference : {"true-maximum", "maximum"}
        The reading without any effect: the largest true temperature in the pixel's square during
        the exposure; or the largest radiance temperature, which contains emissivity and reflection.
    permutations : int
        Orders of the effects that are sampled if there are more than `MAX_EXACT`.
    seed : int
        Seed of the sampled orders.
    check : callable, optional
        Called periodically. An exception raised here ends the computation.

    Returns
    -------
    xarray.Dataset
        Over ``effect``, ``y`` and ``x`` of the pixels, in K: ``contribution``, the Shapley values,
        whose sum over the effects is ``measured`` minus ``reference``; ``waterfall``, the changes
        when the effects are switched on in the order of the light; ``removal``, the reading minus
        the reading without the effect (of the PSF: the paper's case 1 − case 2). Over ``effect``
        and ``other_effect``: ``interaction``, the pairwise interaction index. A pixel below the
        range limit reads the temperature of its radiance; ``lost`` pixels are below the limit or
        unusable, and ``lost_contribution`` divides those whose reference is above it among the
        effects. ``gain_half_exposure``: decrease
        of the absolute error if the exposure is halved. Sampled contributions have a
        ``standard_error``, and no interactions.

    Raises
    ------
    ValueError
        If an effect is unknown to the camera or named twice, or the exposure is not within the
        scene.

    Notes
    -----
    Switched off, an effect is ideal: emissivity 1; no surroundings; the hottest moment of the
    exposure; no blur; the hottest sample of the pixel's square; none of the detector's terms; no
    full well, saturation or rounding to counts. The Shapley value of an effect is the mean change
    of the reading when it is switched on, over all orders of the effects. All combinations have the
    same detector noise.
    """
    plan = AttributionPlan(tuple(effects), reference, permutations)
    if start is None:
        start = middle_start(scene, camera.frame_duration(scene.raster))
    field = camera.prepare(surface, scene)
    model = _Model(camera, _sources(scene, camera, surface, field, start, check), plan, check)
    variables = _divided(model, plan.permutations, seed)
    half = replace(camera, integration_time=camera.integration_time / 2)
    (shorter,) = half.expose_fields(scene, (field,), start + half.integration_time / 2, check)
    gain = _size(camera, model.sources.exposures[0], reference) - _size(half, shorter, reference)
    variables["gain_half_exposure"] = ("y", "x"), gain, _KELVIN
    pixels = camera.pixels(scene.raster)
    coordinates = {"effect": list(model.players), "other_effect": list(model.players)}
    return xr.Dataset(
        variables,
        coords=coordinates | {name: (name, getattr(pixels, name), {"units": "m"}) for name in "yx"},
        attrs={"start": start, "reference_kind": reference},
    )


def read_attribution(
    data: xr.Dataset, place: Place, images: Sequence[Array], pixels: Raster
) -> tuple[Array, dict[str, Array]]:
    """Return contributions at the readings of a place, (reading, effect), and along its lines.

    The readings are at the positions at which the place reads the reference and the measured
    image, `images`, of a peak at that of the reference; their last column is the gain of half the
    exposure. The lines by name are of shape (effect, point).
    """
    first, gain = len(images), data.gain_half_exposure.values
    stack = np.concatenate([np.stack(images), data.contribution.values, gain[None]])
    lines = place.sampled(stack, pixels)
    read = place.read_parts(stack, pixels, lines)[:, first:]
    return read, {name: along[first:-1] for name, along in lines.items()}


def shapley_matrix(count: int) -> Array:
    """Return the matrix from the values of all coalitions to Shapley values, (n, 2ⁿ).

    Bit i of a coalition's index is set if player i is in it.
    """
    matrix = np.zeros((count, 2**count))
    for player, coalition in np.ndindex(matrix.shape):
        size = coalition.bit_count()
        inside = coalition >> player & 1
        weight = 1 / (count * comb(count - 1, size - inside)) if size - inside < count else 0.0
        matrix[player, coalition] = weight if inside else -weight
    return matrix


def interaction_matrix(count: int) -> Array:
    """Return the matrix from values of coalitions to the interaction index of pairs, (n, n, 2ⁿ)."""
    matrix = np.zeros((count, count, 2**count))
    for i, j in combinations(range(count), 2):
        for coalition in range(2**count):
            both = (coalition >> i & 1) + (coalition >> j & 1)
            others = coalition.bit_count() - both
            weight = factorial(others) * factorial(count - 2 - others) / factorial(count - 1)
            matrix[[i, j], [j, i], coalition] = -weight if both == 1 else weight
    return matrix


def sampled_shapley(
    value: _Value, players: Sequence[_Coalition], permutations: int, seed: int
) -> tuple[Array, Array]:
    """Return Shapley values from random orders and their reverses, and their standard errors."""
    generator = np.random.default_rng(seed)
    pairs: list[Array] = []
    for _ in range(max(permutations // 2, 2)):
        order = generator.permutation(len(players)).tolist()
        pairs.append((_walk(value, players, order) + _walk(value, players, order[::-1])) / 2)
    return np.mean(pairs, axis=0), np.std(pairs, axis=0, ddof=1) / np.sqrt(len(pairs))


def _walk(value: _Value, players: Sequence[_Coalition], order: list[int]) -> Array:
    """Return the change of the value as the players join in an order, by player."""
    on: _Coalition = frozenset()
    values = [value(on)]
    for player in order:
        on |= players[player]
        values.append(value(on))
    changes = np.empty((len(players), *values[0].shape))
    changes[order] = np.diff(values, axis=0)
    return changes


def _size(camera: Camera, exposure: Exposure, reference: AttributionReference) -> Array:
    """Return the absolute error of each pixel in K."""
    images = ExposureImages(exposure, reference)
    return np.abs(images.measured(camera) - images.reference(camera))


@dataclass(frozen=True, eq=False)
class _Sources:
    """Exposures of a scene with its surface, without reflection, and as a blackbody."""

    exposures: tuple[Exposure, ...]
    reflects: bool

    def of(self, on: _Coalition) -> Exposure:
        seen, unreflecting, black = self.exposures
        if "emissivity" not in on:
            return black
        return seen if "reflection" in on else unreflecting


def _sources(
    scene: Scene,
    camera: Camera,
    surface: Surface,
    field: EmissivityField,
    start: float,
    check: Check | None,
) -> _Sources:
    band, plain = camera.band, _unreflecting(surface)
    views = [
        View(field, band, camera.reflected),
        View(plain.prepare(scene, band), band),
        View(UniformSurface(1.0).prepare(scene, band), band),
    ]
    delays = camera.row_delays(scene.raster)
    exposures = expose(scene, views, start, camera.integration_time, delays, check)
    return _Sources(exposures, plain is not surface or camera.reflected is not None)


def _unreflecting(surface: Surface) -> Surface:
    """Return the surface without reflections between tool and chip."""
    if not isinstance(surface, ModifiedSurface):
        return surface
    kept = [one for one in surface.modifiers if one.effect != "reflections"]
    return surface if len(kept) == len(surface.modifiers) else surface.bare.modified(*kept)


class _Model:
    """The reading of a camera with some of its effects switched on.

    A coalition contains names of `EFFECTS`, and kinds of terms that the plan names.
    """

    def __init__(
        self, camera: Camera, sources: _Sources, plan: AttributionPlan, check: Check | None = None
    ) -> None:
        self.check = check
        seen = sources.exposures[0]
        self.camera, self.sources, self.start = camera, sources, seen.start
        self.reference = reference_temperature(camera, seen, plan.reference)
        is_contained = plan.reference == "maximum"
        self.contained = frozenset({"emissivity", "reflection"} if is_contained else ())
        detector = camera.detector
        self.noises = frozenset(one.kind for one in (detector.terms if detector else ()))
        self.named = (self.noises | {one.kind for one in camera.optics}) & set(plan.effects)
        self.players = self._players(plan.effects)
        self._image = lru_cache(None)(self._formed)
        self._read = lru_cache(None)(self._reading)

    def temperature(self, on: _Coalition) -> Array:
        """Return the measured temperature in K."""
        kelvins, _ = self._read(on | self.contained)
        return np.where(np.isnan(self.reference), np.nan, kelvins)

    def lost(self, on: _Coalition) -> Array:
        """Return 1 for the pixels below the range limit or unusable, and 0 elsewhere."""
        _, flags = self._read(on | self.contained)
        return np.where(np.isnan(self.reference), np.nan, flags & UNUSABLE != 0)

    def _players(self, effects: Sequence[str]) -> dict[str, _Coalition]:
        """Return the effects of each player, in the order of the light."""
        groups = self._groups()
        for name in effects:
            if name not in {*EFFECTS, *groups, *self.named}:
                known = ", ".join((*groups, *sorted(self.noises | self.named)))
                raise ValueError(f"effects: {name!r} is unknown, expected any of {known}")
        if not effects:
            return groups
        players = {name: one for name, one in groups.items() if name in effects}
        players |= {name: frozenset({name}) for name in effects if name in self.named}
        rest = frozenset().union(*groups.values()) - frozenset().union(*players.values())
        return players | ({REST: rest} if rest else {})

    def _groups(self) -> dict[str, _Coalition]:
        """Return the effects that the camera has; those that cannot be separated form a group."""
        camera, psf = self.camera, self.camera.psf
        present = {
            "reflection": self.sources.reflects,
            "psf": psf is not None,
            "optics": bool(camera.optics),
            "detector": camera.detector is not None and bool(camera.detector.terms),
            "digitiser": camera.detector is not None,
        }
        groups: dict[str, _Coalition] = {}
        for name in EFFECTS:
            if present.get(name, True) and name not in self.contained:
                blurs = name in ("psf", "footprint") and psf and "footprint" in psf.includes
                group = BLUR if blurs else name
                groups[group] = groups.get(group, frozenset()) | {name}
        return groups

    def _reading(self, on: _Coalition) -> tuple[Array, NDArray[np.uint8]]:
        """Return temperatures and flags."""
        if not on - self.contained:
            return self.reference, range_flags(self.reference, self.camera.lower_limit)
        image = self._image(on - {"detector", "digitiser"} - self.noises)
        return read_temperature(self._switched(on), image, self.start)

    def _formed(self, on: _Coalition) -> Array:
        """Return the radiance of the pixels before the detector in W/(m² sr)."""
        if self.check:
            self.check()
        exposure, camera = self.sources.of(on), self._switched(on)
        hottest = exposure.peak_radiance.astype(np.float64)
        radiance = exposure.mean_radiance if "exposure" in on else hottest
        gather = integrate if "footprint" in on else largest
        return camera.form_image(radiance, exposure.raster, gather)

    def _switched(self, on: _Coalition) -> Camera:
        """Return the camera with the parts and terms that are on."""
        camera, detector = self.camera, self.camera.detector

        def is_on(kind: str, effect: str) -> bool:
            return (kind if kind in self.named else effect) in on

        optics = tuple(one for one in camera.optics if is_on(one.kind, "optics"))
        if detector is not None:
            terms = tuple(one for one in detector.terms if is_on(one.kind, "detector"))
            detector = replace(detector, terms=terms)
            if "digitiser" not in on:
                detector = detector.undigitised() if terms else None
        psf = camera.psf if "psf" in on else None
        order = camera.psf_order if psf else "optics"
        return replace(camera, psf=psf, psf_order=order, optics=optics, detector=detector)


def _divided(model: _Model, permutations: int, seed: int) -> dict[str, tuple[object, ...]]:
    """Return the variables of an attribution."""
    players = list(model.players.values())
    count, pixels = len(players), ("y", "x")
    everything = frozenset().union(*players)
    whole, lost = model.temperature(everything), model.lost(everything)
    light = [frozenset().union(*players[:i]) for i in range(count + 1)]
    removal = [whole - model.temperature(everything - one) for one in players]
    values = {
        "reference": (pixels, model.reference),
        "measured": (pixels, whole),
        "waterfall": (("effect", *pixels), np.diff([*map(model.temperature, light)], axis=0)),
        "removal": (("effect", *pixels), np.stack(removal)),
    }
    if count <= MAX_EXACT:
        coalitions = [
            frozenset().union(*(one for i, one in enumerate(players) if number >> i & 1))
            for number in range(2**count)
        ]
        kelvins = np.stack([model.temperature(one) for one in coalitions])
        shapley = np.tensordot(shapley_matrix(count), kelvins, 1)
        lost_by = np.tensordot(shapley_matrix(count), [*map(model.lost, coalitions)], 1)
        pairs = np.tensordot(interaction_matrix(count), kelvins, 1)
        values["interaction"] = ("effect", "other_effect", *pixels), pairs
    else:
        shapley, error = sampled_shapley(model.temperature, players, permutations, seed)
        lost_by, _ = sampled_shapley(model.lost, players, permutations, seed)
        values["standard_error"] = ("effect", *pixels), error
    values["contribution"] = ("effect", *pixels), shapley
    variables: dict[str, tuple[object, ...]] = {
        name: (*one, _KELVIN) for name, one in values.items()
    }
    variables["lost"] = pixels, lost, {"units": "1"}
    variables["lost_contribution"] = ("effect", *pixels), lost_by, {"units": "1"}
    return variables
