"""The picture of the page on Pyxel.

    python docs/pictures/pyxel_exposure.py EXPOSURE.yaml

runs the page's pipeline, in the folder with its study, and draws photons and counts.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pyxel

HERE = Path(__file__).parent


def main() -> None:
    """Run the pipeline and draw its first read-out."""
    found = pyxel.run_mode(pyxel.load(sys.argv[1]))["bucket"]
    panels = {"photon": ("photons / 10⁶", 1e-6), "image": ("counts", 1.0)}
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for one, (name, (label, scale)) in zip(axes, panels.items(), strict=True):
        shown = one.imshow(scale * found[name].values[0], cmap="inferno")
        figure.colorbar(shown, ax=one, label=label)
        one.set(xlabel="column", ylabel="row", title=f"Pyxel's {name}")
    figure.savefig(HERE / "pyxel.png", dpi=120)


if __name__ == "__main__":
    main()
