"""Attribution: the error of each pixel divided among the effects that cause it (Shapley values)."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from math import comb, factorial
from typing import Annotated, Final, Literal, TypeAlias

import numpy as np
import xarray as xr

from chipglow.analysis.cut import middle_start
from chipglow.analysis.places import Place
from chipglow.camera import UNUSABLE, Camera
from chipglow.camera.chain import Chain, ExposedChain, expose_apart
from chipglow.camera.effect import Effect, joined
from chipglow.camera.exposure_kernels import Check
from chipglow.quantities import Array, Parameter, Part
from chipglow.scene import Raster, Scene
from chipglow.surface import Surface

REST: Final = "other effects"
MAX_EXACT: Final = 8
"""Number of effects up to which all combinations are computed."""

PERMUTATIONS: Final = 64
"""Sampled orders of more effects, unless stated: each effect is scattered by 1/8 of its spread."""

AttributionReference: TypeAlias = Literal["true-maximum", "maximum"]
_Coalition: TypeAlias = frozenset[str]
_EFFECTS: Final = tuple(
    one.value for one in Effect if one not in (Effect.MISREGISTRATION, Effect.DELAY)
)
"""Effects of a single camera."""

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
            "Effects: any of " + ", ".join(_EFFECTS) + ", or the kind of a term of the camera's "
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
    ] = PERMUTATIONS

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
    permutations: int = PERMUTATIONS,
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
        Any of `Effect`, or the ``kind`` of a term of the camera's optics or detector. The
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
    chain = Chain(camera, scene, surface)
    exposed = expose_apart(chain, start, reference, check)
    players = _players(exposed, plan.effects)
    variables = _divided(exposed, players, plan.permutations, seed, check)
    half = replace(camera, integration_time=camera.integration_time / 2)
    shorter = replace(chain, camera=half, field=chain.emissivity)
    gain = _size(exposed) - _size(shorter.at(start + half.integration_time / 2, reference, check))
    variables["gain_half_exposure"] = ("y", "x"), gain, _KELVIN
    pixels = camera.pixels(scene.raster)
    coordinates = {"effect": list(players), "other_effect": list(players)}
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


def _size(chain: ExposedChain) -> Array:
    """Return the absolute error of each pixel in K."""
    return np.abs(chain.reading() - chain.reference())


def _players(chain: ExposedChain, effects: Sequence[str]) -> dict[str, _Coalition]:
    """Return the effects of each player, in the order of the light.

    Those that are not named form one group.
    """
    groups = _groups(chain)
    kinds = chain.terms_of(Effect.OPTICS) | chain.terms_of(Effect.DETECTOR)
    for name in effects:
        if name not in {*_EFFECTS, *groups, *kinds}:
            known = ", ".join((*groups, *sorted(kinds)))
            raise ValueError(f"effects: {name!r} is unknown, expected any of {known}")
    if not effects:
        return groups
    named = frozenset(effects) & kinds
    players = {name: one - named for name, one in groups.items() if name in effects}
    players |= {name: frozenset({name}) for name in effects if name in named}
    rest = frozenset().union(*groups.values()) - frozenset().union(*players.values())
    return players | ({REST: rest} if rest else {})


def _groups(chain: ExposedChain) -> dict[str, _Coalition]:
    """Return the effects that the camera has; those that cannot be separated form a group.

    Terms stand in place of the effect that they are part of.
    """
    psf = chain.camera.psf
    blur = frozenset({Effect.PSF, Effect.FOOTPRINT})
    together = blur if psf is not None and "footprint" in psf.includes else frozenset()
    groups: dict[str, _Coalition] = {}
    for effect in chain.effects:
        if effect in chain.contained:
            continue
        name = joined(together) if effect in together else effect.value
        groups[name] = groups.get(name, frozenset()) | (chain.terms_of(effect) or {effect})
    return groups


def _divided(
    chain: ExposedChain,
    players: dict[str, _Coalition],
    permutations: int,
    seed: int,
    check: Check | None,
) -> dict[str, tuple[object, ...]]:
    """Return the variables of an attribution."""
    coalitions, pixels = list(players.values()), ("y", "x")

    @lru_cache(None)
    def read(on: _Coalition) -> Array:
        """Return the temperature in K, and 1 for each lost pixel, (2, y, x)."""
        if check:
            check()
        kelvins, flags = chain.read(on | chain.contained)
        values = np.stack([kelvins, flags & UNUSABLE != 0])
        return np.where(np.isnan(chain.reference()), np.nan, values)

    everything = frozenset().union(*coalitions)
    whole, lost = read(everything)
    light = [frozenset().union(*coalitions[:i]) for i in range(len(coalitions) + 1)]
    removal = [whole - read(everything - one)[0] for one in coalitions]
    values = {
        "reference": (pixels, chain.reference()),
        "measured": (pixels, whole),
        "waterfall": (("effect", *pixels), np.diff([read(on)[0] for on in light], axis=0)),
        "removal": (("effect", *pixels), np.stack(removal)),
    }
    if len(coalitions) <= MAX_EXACT:
        every = np.stack([read(on) for on in _subsets(coalitions)], axis=1)
        shapley, lost_by = (np.tensordot(shapley_matrix(len(coalitions)), one, 1) for one in every)
        pairs = np.tensordot(interaction_matrix(len(coalitions)), every[0], 1)
        values["interaction"] = ("effect", "other_effect", *pixels), pairs
    else:
        both, errors = sampled_shapley(read, coalitions, permutations, seed)
        (shapley, lost_by), error = np.moveaxis(both, 1, 0), errors[:, 0]
        values["standard_error"] = ("effect", *pixels), error
    values["contribution"] = ("effect", *pixels), shapley
    variables: dict[str, tuple[object, ...]] = {
        name: (*one, _KELVIN) for name, one in values.items()
    }
    variables["lost"] = pixels, lost, {"units": "1"}
    variables["lost_contribution"] = ("effect", *pixels), lost_by, {"units": "1"}
    return variables


def _subsets(players: Sequence[_Coalition]) -> Iterator[_Coalition]:
    """Yield all coalitions: bit i of the number of a coalition is set if player i is in it."""
    for number in range(2 ** len(players)):
        yield frozenset().union(*(one for i, one in enumerate(players) if number >> i & 1))
