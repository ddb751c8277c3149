"""Pictures and numbers of synthetic-laboratory.md: the commands of the page, and all repeats.

``python docs/pictures/synthetic_laboratory.py``; the repeats are those that
``python benchmarks/synthetic_laboratory.py`` kept, or are computed.
"""

import os
import shlex
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.cli import app
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION

HERE = Path(__file__).parent.resolve()
sys.path.insert(0, str(HERE.parents[1] / "benchmarks"))
from synthetic_laboratory import QUANTITIES, Laboratory, kept, table  # noqa: E402

SEED = 50
REPEATS = 100
CORRECTED = "--set flat_field.low=cold.hcc --set flat_field.high=hot.hcc --set bad_pixels=find"
CAMERA = f"{CORRECTED} --set pitch=6um --set calibration=calibration.yaml"
STACK = f"{CAMERA} --set unit=counts --set interval=2ms --set saturation=4094"
COMMANDS = (
    "calibrate points.csv --band 3.8-5.1um --common-uncertainty 0.4K --integration-time 10us "
    f"{CORRECTED} --out calibration.yaml --plot synthetic-calibration.png",
    f"convert chip-1.npy {STACK} --out chip-1.nc",
    "show chip-1.nc --plot synthetic-chip.png",
    "emissivity heated-1.hcc heated-2.hcc heated-3.hcc heated-4.hcc --regions regions.yaml "
    "--reference {reading}degC --reference-uncertainty 2K --reflected-uncertainty 2K "
    f"{CAMERA} --out emissivity.nc --plot synthetic-emissivity.png",
    f"psf edge-1.tif edge-2.tif {STACK} --out psf.nc --plot synthetic-psf.png",
    "temperature chip-1.npy chip-2.npy chip-3.npy chip-4.npy --regions regions.yaml "
    f"--emissivity emissivity.nc --calibration calibration.yaml {STACK}",
)


def main() -> None:
    """Type the commands, print what is asked of them, and draw the repeats."""
    with TemporaryDirectory() as folder:
        laboratory = Laboratory(SEED)
        laboratory.perform(Path(folder))
        print(f"{laboratory.optics.kind}: {laboratory.reference()}")
        os.chdir(folder)
        reading = laboratory.reading - 273.15
        for command in COMMANDS:
            print(f"\n$ chipglow {command}")
            app(shlex.split(command.format(reading=f"{reading:.2f}")), standalone_mode=False)
        for picture in Path(folder).glob("synthetic-*.png"):
            (HERE / picture.name).write_bytes(picture.read_bytes())
        os.chdir(HERE.parents[1])
    rows = [kept(seed) for seed in range(REPEATS)]
    for line in table(rows):
        print(*line, sep=" | ")
    draw(rows).savefig(HERE / "synthetic-repeats.png", dpi=150)


def draw(rows: list[Any]) -> Figure:
    """Errors of all repeats as fractions of their intervals."""
    kinds = np.array([Laboratory(seed).optics.kind for seed in range(REPEATS)])
    with style():
        figure = new_figure(3.4)
        axes: Axes = figure.subplots()
        axes.axvspan(-1, 1, color=GREY, alpha=0.15, linewidth=0)
        for line, name in enumerate(QUANTITIES):
            reference, value, expanded = np.array([row[name] for row in rows]).T
            place = line + np.linspace(-0.32, 0.32, REPEATS)
            for kind, colour in (("gaussian", BLUE), ("tail", GREEN), ("mirror", VERMILLION)):
                mine = kinds == kind
                fraction = (value - reference) / expanded
                axes.plot(
                    fraction[mine], place[mine], "o", color=colour, markersize=2.6,
                    label=f"{kind}: {mine.sum()}" if line == 0 else "",
                )  # fmt: skip
        axes.set_yticks(range(len(QUANTITIES)), list(QUANTITIES))
        axes.invert_yaxis()
        axes.set_xlabel("error over half the width of its 95 % interval")
        axes.legend(title="optics", loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


if __name__ == "__main__":
    main()
