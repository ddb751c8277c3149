"""A study's surfaces and tool on a scene that someone else may have made."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from chipglow.scene import Material, Scene
from chipglow.study.schema import Study
from chipglow.surface import FeatureSurface, Surface


@dataclass(frozen=True)
class Fitted:
    """A scene with a tool, surfaces that can follow it, and what had to be assumed for that.

    Parameters
    ----------
    scene : Scene
        The scene; it tells a tool.
    surfaces : mapping
        The study's surfaces by name.
    assumed : tuple of str
        A sentence for each assumption.
    """

    scene: Scene
    surfaces: Mapping[str, Surface]
    assumed: tuple[str, ...]


def fit(study: Study, scene: Scene) -> Fitted:
    """Fit a study to a scene that lacks material coordinates or a tool, as imports often do.

    Textures then move by the mean velocities of their features, as the paper's did, and the tool
    is that of the study's cutting section.

    Parameters
    ----------
    study : Study
        Says surfaces and tool.
    scene : Scene
        The scene.
    """
    surfaces = study.surface.build(study.seed)
    assumed = []
    if scene.tool is None:
        scene = scene.with_tool(study.cutting.tool.build())
        assumed.append(
            "The scene does not tell its tool: it is that of the study's section cutting.tool."
        )
    if not (scene.frame(0).material == Material.TOOL).any():
        assumed.append(
            "The scene shows no tool: beyond the rake face nothing shines into the blur of the "
            "chip, and errors there are larger than with a warm tool."
        )
    following = {
        name: surface
        for name, surface in surfaces.items()
        if isinstance(surface, FeatureSurface) and surface.follow == "material"
    }
    if following and not scene.has_material_coordinates:
        surfaces |= {name: replace(surface, follow="mean") for name, surface in following.items()}
        assumed.append(
            "The scene does not say where each point was before the cut: textures move with the "
            "mean velocity of their feature (surface.follow: mean)."
        )
    return Fitted(scene, surfaces, tuple(assumed))
