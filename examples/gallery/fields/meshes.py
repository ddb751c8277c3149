"""Draws `import-mesh.png`, a mesh and its samples: ``python docs/import_mesh.py``."""

from pathlib import Path

import numpy as np
from pyvista import examples

from chipglow.drawing.drawing import new_figure, style
from chipglow.io.sources import Placement
from chipglow.io.sources.mesh import MeshSource
from chipglow.scene import Raster

RASTER = Raster(left=-0.1, top=5.1, spacing=0.01, rows=520, columns=120)
NODES = {"temperature": "sample_point_scalars"}
ELEMENTS = {"temperature": "sample_cell_scalars"}


def main() -> None:
    """Draw a cut with values of nodes, one with those of elements, and the visible surface."""
    path = Path(examples.hexbeamfile)
    side = Placement(horizontal="x", vertical="z")
    sources = {
        "nodes, section: 0.6 m": MeshSource(path, NODES, placement=side, section=0.6),
        "elements, section: 0.6 m": MeshSource(path, ELEMENTS, placement=side, section=0.6),
        "nodes, section: facing": MeshSource(path, NODES, placement=side, section="facing"),
    }
    with style():
        figure = new_figure(3.6)
        for axes, (title, source) in zip(figure.subplots(1, 3), sources.items(), strict=True):
            frame = next(source.frames(RASTER))
            left, right, bottom, top = RASTER.extent
            shown = axes.imshow(
                np.ma.masked_invalid(frame.fields["temperature"]),
                extent=(left, right, bottom, top),
                cmap="inferno",
            )
            axes.set_title(title, fontsize=8)
            axes.set_xlabel("x / m")
            axes.set_ylabel("z / m")
            figure.colorbar(shown, ax=axes, shrink=0.8, label="the value in the file")
        figure.savefig(Path(__file__).with_name("import-mesh.png"), dpi=150)


if __name__ == "__main__":
    main()
