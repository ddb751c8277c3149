"""How the width of the shear band and the camera's errors depend on the cell.

    python benchmarks/band_width.py [28 20 14 10 7]

For each cell (in um) the paper's cut is made, and looked at as the paper's study does, with frames
and samples as coarse as those of the quick study: mean and standard deviation over its segments,
textures and pixel phases. Scenes are kept in chipglow's cache. Prints a Markdown table.
"""

import sys

from chipglow.quantities import changed
from chipglow.report import result_rows
from chipglow.study import Study, run

CELLS = (28.0, 20.0, 14.0, 10.0, 7.0)
SHOWN = {
    "band_width_um": "band",
    "band_error_degC": "error at the band's centre",
    "band_psf_fraction_percent": "PSF's fraction",
    "band_worst_error_degC": "largest beside the band",
    "rake_error_degC": "error at the rake face",
    "rake_psf_fraction_percent": "PSF's fraction",
}


def study_with(cell):
    """The quick study with another cell in um."""
    return changed(Study.quick(), {"cutting.numerics.cell": cell * 1e-6})


def row(cell):
    """Cut and look, and return the cell's row of the table."""
    found = {each.key: each.cells["mean"] for each in result_rows(run(study_with(cell)))}
    return [f"{cell:g}", *(found[key] for key in SHOWN)]


def main():
    cells = [float(text) for text in sys.argv[1:]] or CELLS
    print("| cell / um | " + " | ".join(SHOWN.values()) + " |")
    print("|---" * (1 + len(SHOWN)) + "|")
    for cell in cells:
        print("| " + " | ".join(row(cell)) + " |", flush=True)


if __name__ == "__main__":
    main()
