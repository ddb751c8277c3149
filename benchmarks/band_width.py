"""How the width of the shear band and the camera's errors depend on the cell.

    python benchmarks/band_width.py [--study STUDY.yaml] [28 20 14 10 7]

For each cell (in um) the study is run, by default the quick one: mean and standard deviation over
its segments, textures and pixel phases. Scenes are kept in chipglow's cache. Prints a Markdown
table.
"""

import argparse
from pathlib import Path

from chipglow.quantities import changed
from chipglow.report import result_rows
from chipglow.study import Study, load_study, run

CELLS = (28.0, 20.0, 14.0, 10.0, 7.0)
SHOWN = {
    "band_width_um": "band",
    "band_error_degC": "error at the band's centre",
    "band_psf_fraction_percent": "PSF's fraction",
    "band_worst_error_degC": "largest beside the band",
    "rake_error_degC": "error at the rake face",
    "rake_psf_fraction_percent": "PSF's fraction",
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--study", type=Path, help="a study with a cut")
    parser.add_argument("cells", nargs="*", type=float, help="in um")
    given = parser.parse_args()
    study = load_study(given.study) if given.study else Study.quick()
    print("| cell / um | " + " | ".join(SHOWN.values()) + " |")
    print("|---" * (1 + len(SHOWN)) + "|")
    for cell in given.cells or CELLS:
        results = run(changed(study, {"cutting.numerics.cell": cell * 1e-6}))
        means = {row.key: row.cells["mean"] for row in result_rows(results)}
        print("| " + " | ".join([f"{cell:g}", *(means[key] for key in SHOWN)]) + " |", flush=True)


if __name__ == "__main__":
    main()
