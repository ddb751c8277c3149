"""How much of the paper's missing 100 °C at the rake face reflections explain.

    python benchmarks/reflections.py [--draws 40] [--angles 30 45 60 75] [--study STUDY.yaml]

Measures the hottest square of the row beside the rake face (the paper's Figure 7) in one instant of
the quick study, or of a study's cut or scene, with the light that rake face and chip's side reflect
on each other and without. What has to be explained is 100 °C with chip 2, and that and the
difference of the chips with chip 1. The wedge and the emissivities of chip and tool are drawn; the
tool is as warm as it was cut, or as the chip that it touches. Minutes.
"""

from dataclasses import dataclass, replace
from itertools import product
from math import pi, radians
from pathlib import Path

import numpy as np
from common import arguments, print_tables, spread

from chipglow.camera import Camera
from chipglow.io import open_scene
from chipglow.laboratory.chip import rake_grid
from chipglow.scene import Material, Scene
from chipglow.scene.lines import nearest
from chipglow.study import Study, cut, load_study
from chipglow.surface import CHIP_1, CHIP_2, Emissivity, Wedge

MISSING = 100.0
INSTANT = 0.5
CHIPS = {"chip 1": CHIP_1, "chip 2": CHIP_2}
ANGLES = (30.0, 75.0)
SHAPES = (30.0, 45.0, 60.0, 75.0)
RADII = (50e-6, 200e-6)
SEED = 17


@dataclass(frozen=True)
class Face:
    """One instant of a scene, and the camera that reads the row beside its rake face."""

    scene: Scene
    camera: Camera

    @classmethod
    def of(cls, scene, camera, hot_tool):
        """The scene at rest in the middle of its time, with a tool as warm as the chip or not."""
        frame = scene.frame(int(INSTANT * len(scene.times)))
        names = ("temperature", "material", "plastic_strain", "plastic_strain_rate")
        fields = {name: frame.needed(name) for name in names}
        if hot_tool:
            hot = with_hot_tool(scene, fields["temperature"], fields["material"])
            fields["temperature"] = hot
        still = {name: values[None] for name, values in fields.items()}
        return cls(Scene.from_fields(scene.raster, [0.0], still, scene.tool), camera)

    def peak(self, surface):
        """Hottest radiance temperature of the row of squares beside the face in K."""
        measured = self.camera.measure(self.scene, surface, 0.0)
        return float(np.nanmax(rake_grid(measured, measured.tool).frame_mean[0]))


def with_hot_tool(scene, temperature, material):
    """Temperatures with a tool that is as warm as the chip on the other side of its rake face."""
    tool, raster = scene.tool, scene.raster
    x, y = np.meshgrid(raster.x, raster.y)
    along = (np.stack([x, y], axis=-1) - tool.rake_foot) @ np.array(tool.rake_direction)
    beside = tool.rake_point(along) + raster.spacing * np.array(tool.rake_normal)
    touching = nearest(material, raster, beside) == Material.WORKPIECE
    changed = (material == Material.TOOL) & (along > 0) & touching
    return np.where(changed, nearest(temperature, raster, beside), temperature).astype(np.float32)


def flat(chip, body, tool):
    """A chip of even emissivities, which follows no texture."""
    return replace(
        chip,
        chip=Emissivity(body),
        shear_band=Emissivity(chip.shear_band.mean),
        workpiece=Emissivity(chip.workpiece.mean),
        tool=Emissivity(tool),
        follow="none",
    )


def drawn(emissivity, generator):
    value = generator.normal(emissivity.mean, emissivity.standard_deviation)
    return float(np.clip(value, 0.02, 0.98))


def differences(face, chip, draws):
    """Peaks without and with reflections for drawn shapes and emissivities, shape (draw, 2)."""
    generator = np.random.default_rng(SEED)
    found = []
    for _ in range(draws):
        wedge = Wedge(
            angle=radians(generator.uniform(*ANGLES)),
            bulge_radius=generator.uniform(*RADII),
            mirror=generator.uniform(0.0, 1.0),
        )
        bare = flat(chip, drawn(chip.chip, generator), drawn(chip.tool, generator))
        found.append((face.peak(bare), face.peak(bare.modified(wedge))))
    return np.array(found)


def explained(faces, draws):
    """Table of what reflections add to the peak, and of what has to be explained."""
    rows = [["tool", "chip", "without / °C", "with / °C", "added / K", "range / K", "missing / K"]]
    bare = {name: faces["as cut"].peak(flat(c, c.chip.mean, 0.58)) for name, c in CHIPS.items()}
    for tool, face in faces.items():
        for name, chip in CHIPS.items():
            without, reflecting = differences(face, chip, draws).T
            added = reflecting - without
            peaks = spread(without - 273.15), spread(reflecting - 273.15)
            more = spread(added), f"{added.min():.0f} to {added.max():.0f}"
            missing = f"{MISSING + bare['chip 2'] - bare[name]:.0f}"
            rows.append([tool, name, *peaks, *more, missing])
    return rows


def by_shape(faces, angles):
    """Table of what one wedge adds, by its angle and its kind of reflection."""
    rows = [["angle / °", *(f"{tool}, {name} / K" for tool in faces for name in CHIPS), "mirror"]]
    wedges = [
        (f"{angle:.0f}", Wedge(angle=radians(angle), mirror=mirror))
        for mirror in (0.0, 1.0)
        for angle in angles
    ]
    wedges.append(("90, 30 um behind", Wedge(angle=pi / 2, overhang=30e-6)))
    for label, wedge in wedges:
        row = [label]
        for face, chip in product(faces.values(), CHIPS.values()):
            bare = flat(chip, chip.chip.mean, chip.tool.mean)
            row.append(f"{face.peak(bare.modified(wedge)) - face.peak(bare):.0f}")
        rows.append([*row, f"{wedge.mirror:.0f}"])
    return rows


def main():
    given = arguments(__doc__, draws=40, angles=list(SHAPES), study=Path)
    study = Study.quick() if given.study is None else load_study(given.study)
    path = cut(study) if study.scene is None else study.scene
    scene, camera = open_scene(path), study.camera.build()
    tools = {"as cut": False, "as warm as the chip": True}
    faces = {name: Face.of(scene, camera, hot) for name, hot in tools.items()}
    print_tables([by_shape(faces, given.angles)])
    print_tables([explained(faces, given.draws)])


if __name__ == "__main__":
    main()
