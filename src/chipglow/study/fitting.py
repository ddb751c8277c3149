"""A study's surfaces and tool on an existing scene."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias

from chipglow.analysis import Plan
from chipglow.quantities import ROUNDING, ZERO_CELSIUS, Part, own_settings
from chipglow.quantities.units import LENGTH
from chipglow.scene import Material, Raster, Scene
from chipglow.study.schema import Study
from chipglow.study.surface_section import FeaturesSection, SurfaceSection, surfaces_of
from chipglow.surface import (
    EmissivityTrend,
    FeatureSurface,
    FeatureTrends,
    MapSurface,
    ModifiedSurface,
    Surface,
    TrendSurface,
    bare_surface,
)
from chipglow.text import Notes
from chipglow.text.template import yaml_line

Follow: TypeAlias = Literal["material", "mean", "none"]

_FRAMES_NEEDED: Final = 5
"""Frames of a scene within an exposure below which it is a warning."""

_CELLS_NEEDED: Final = 10
"""Cells within the feed below which it is a warning."""

_HOW_FINELY: Final = {
    "cutting": {"numerics", "window", "field_of_view", "cutting_length", "surroundings"},
    "surface": {"kind", "measured_in", "maps", "measured", "follow", "restore_standard_deviation"},
    "camera": {"offset_right", "offset_down"},
    "analysis": set(Plan.declared()) - {"reference", "rake_chip", "band_chip"},
}
"""Fields whose defaults do not belong to the paper's experiment."""


@dataclass(frozen=True)
class Fitted:
    """A scene with the study's tool if it lacks one, the study's surfaces, and the assumptions."""

    scene: Scene
    surfaces: Mapping[str, Surface]
    notes: Notes


def fit(study: Study, scene: Scene) -> Fitted:
    """Fit a study to a scene that lacks material coordinates or a tool, as imports often do."""
    notes = Notes()
    assumed = notes.assumed
    said = "cutting" in study.given and "tool" in study.cutting.given
    if scene.tool is None and said:
        scene = scene.with_tool(study.cutting.tool.build())
        assumed.append("The scene has no tool: the study's section cutting.tool defines it.")
    if scene.tool is not None and not (scene.frame(0).material == Material.TOOL).any():
        assumed.append(
            "The scene shows no tool: no radiation from beyond the rake face blurs into the chip, "
            "so errors there are larger than with a warm tool."
        )
    surfaces, follow = surfaces_on(scene, study.surface, study.seed)
    if follow != "material":
        moving = {
            "mean": "textures move with the mean velocity of their feature",
            "none": "textures stay where they are, as it has no velocity either",
        }
        assumed.append(
            f"The scene does not state the position of each point before the cut: {moving[follow]} "
            f"(surface.follow: {follow})."
        )
    assumed.extend(_measured_at(surfaces))
    assumed.extend(uncovered(surfaces, scene.raster))
    notes.warnings.extend(_too_coarse(study, scene))
    return Fitted(scene, surfaces, notes)


def surfaces_on(
    scene: Scene, section: SurfaceSection, seed: int
) -> tuple[dict[str, Surface], Follow]:
    """Return a section's surfaces, and how their textures follow the material as far as known."""
    surfaces = surfaces_of(section, seed)
    if scene.has_material_coordinates:
        return surfaces, "material"
    follow: Literal["mean", "none"] = "mean" if "velocity_x" in scene.fields else "none"
    changed = {name: _following(surface, follow) for name, surface in surfaces.items()}
    return changed, follow if changed != surfaces else "material"


def _following(surface: Surface, follow: Literal["mean", "none"]) -> Surface:
    """Return a surface whose textures do not follow the material."""
    if isinstance(surface, ModifiedSurface):
        return replace(surface, bare=_following(surface.bare, follow))
    if isinstance(surface, FeatureSurface) and surface.follow == "material":
        return replace(surface, follow=follow)
    return surface


def _measured_at(surfaces: Mapping[str, Surface]) -> Iterator[str]:
    for name, surface in surfaces.items():
        trends: list[EmissivityTrend] = []
        if isinstance(bare := bare_surface(surface), TrendSurface):
            trends.append(bare.trend)
        for one in surface.modifiers if isinstance(surface, ModifiedSurface) else ():
            if isinstance(one, FeatureTrends):
                trends.extend(one.trends.values())
        for low, high in dict.fromkeys(trend.measured for trend in trends):
            text = f"The emissivity of {name!r} was measured at {low - ZERO_CELSIUS:.0f} °C"
            if low == high:
                yield f"{text}: it is taken to be the same at all temperatures."
            else:
                yield f"{text} to {high - ZERO_CELSIUS:.0f} °C: its straight line is extrapolated."


def _too_coarse(study: Study, scene: Scene) -> Iterator[str]:
    exposure, spacing = study.camera.integration_time, scene.frame_spacing
    if len(scene.times) > 1 and exposure < _FRAMES_NEEDED * spacing * (1 - ROUNDING):
        yield (
            f"Each frame of the scene represents {spacing * 1e6:.3g} us of the exposure's "
            f"{exposure * 1e6:.3g} us: motion within that time is neglected. Use a scene with more "
            "frames."
        )
    cutting = study.cutting
    cells = cutting.feed / cutting.numerics.cell
    if study.scene is None and cells < _CELLS_NEEDED * (1 - ROUNDING):
        yield (
            f"The feed is {cells:.3g} cells: too coarse for forces and shear bands; use "
            f"{_CELLS_NEEDED} or more (cutting.numerics.cell)."
        )


def uncovered(surfaces: Mapping[str, Surface], scene: Raster) -> Iterator[str]:
    """Yield a sentence on each part of the scene outside of the emissivity maps."""
    for name, outer in surfaces.items():
        surface = bare_surface(outer)
        if not isinstance(surface, MapSurface):
            continue
        fraction = surface.known_fraction(scene)
        if fraction == 0.0:
            raise ValueError(
                f"surface: the map {name!r} lies at {_place(surface.raster)}, expected the scene's "
                f"place, {_place(scene)} (the tip of the emissivity's measurement puts it there)"
            )
        if fraction < 1.0:
            yield (
                f"The emissivity map {name!r} covers {100 * fraction:.3g} % of the scene; "
                f"elsewhere its emissivity is {surface.elsewhere:g}. "
                f"It lies at {_place(surface.raster)}, the scene at {_place(scene)}."
            )


def _place(raster: Raster) -> str:
    left, right, bottom, top = (f"{1e6 * edge:.4g}" for edge in raster.extent)
    return f"x {left} to {right} um, y {bottom} to {top} um"


def left_to_the_paper(study: Study) -> Iterator[str]:
    """Yield the omitted settings, which have the paper's values, one sentence per section."""
    if study.is_papers:
        return
    without, plan = dict(_HOW_FINELY), study.analysis
    of_a_cut = plan.cut and not plan.all_places
    if study.scene:
        del without["cutting"]
    if not isinstance(study.surface, FeaturesSection):
        del without["surface"]
    if not (of_a_cut and isinstance(study.surface, FeaturesSection)):
        without["analysis"] = without["analysis"] | {"rake_chip", "band_chip"}
    for name, fields in without.items():
        section = getattr(study, name)
        unset = list(_unset(section, type(section)(), fields, ""))
        for origin, papers in (("The paper's values", True), ("chipglow's defaults", False)):
            left = [text for text, is_papers in unset if is_papers == papers]
            if left:
                yield f"{origin} of omitted settings of {name}: {', '.join(left)}."
    if of_a_cut and "psf_widths" not in plan.given:
        low, *_, high = (LENGTH.text(width) for width in study.plan.psf_widths)
        yield f"PSF widths from {low} to {high}, around the camera's own (analysis.psf_widths)."


def _unset(
    section: Part, papers: Part | None, without: set[str], prefix: str
) -> Iterator[tuple[str, bool]]:
    """Yield the omitted settings, and whether the paper's study has such a section."""
    for one in own_settings(section):
        if one.name in without or one.plain in ("none", []):
            continue
        if one.name not in section.given | section.derived:
            yield f"{prefix}{one.name} {_written(one.plain)}", papers is not None
        elif one.is_section:
            inner = getattr(papers, one.name, None)
            same = inner if type(inner) is type(one.value) else None
            yield from _unset(one.value, same, {"kind"}, f"{prefix}{one.name}.")


def _written(value: Any) -> str:
    """Return a value in one line, without what is none."""
    if isinstance(value, dict):
        value = {key: inner for key, inner in value.items() if inner not in ("none", None, {}, [])}
    return yaml_line(value)
