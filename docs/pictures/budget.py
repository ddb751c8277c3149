"""Draws the picture of the page on uncertainty budgets: ``python docs/pictures/budget.py``.

The cut is the quick one, and 12 more with other friction, conductivity and fracture energy (about
10 minutes). It prints the page's numbers.
"""

from pathlib import Path

import matplotlib

from chipglow.quantities import changed
from chipglow.study import Study, study_budget

matplotlib.use("Agg")
INPUTS = {
    "cutting.friction.coefficient": {"standard": "0.05", "source": "assumed"},
    "cutting.workpiece_factors.conductivity": {"standard": "5 %", "source": "assumed"},
    "cutting.workpiece_factors.fracture_energy": {"standard": "23 %", "source": "fit"},
    "surface.chips.chip 2.body.mean": {"standard": "0.01", "source": "Table 1"},
    "surface.chips.chip 1.shear_band.mean": {"standard": "0.01", "source": "Table 1"},
    "camera.psf.numerical_aperture": {"standard": "5 %", "source": "assumed"},
}
AT = ("rake", "rake_mean", "band", "band_worst")


def main() -> None:
    """Compute and draw the budget."""
    factors = {"conductivity": 1.0, "fracture_energy": 1.0}
    changes = {"cutting.workpiece_factors": factors, "uncertainty": {"inputs": INPUTS}}
    study = changed(Study.quick(), changes)
    result = study_budget(study, AT, trials=3000, samples=128, scenes=12)
    print(result.summary().to_string(), result.groups().to_string(), sep="\n")
    print(result.to_frame().drop(columns="source").to_string())
    print(result.surrogates, result.budget.monte_carlo.trials)
    result.plot().savefig(Path(__file__).with_name("budget.png"), dpi=100)


if __name__ == "__main__":
    main()
