"""What softening does to the chip: the paper's cut with different laws of flow stress and damage.

    python benchmarks/softening.py [--cell 14] [--length 2.6] [NAME ...]

Cell in um, length of the cut in mm. Prints a Markdown table: forces, segments, degree of
segmentation, shear band. The TANH law has the constants of Ti-6Al-4V (Ducobu et al. 2017, a 1.1,
b 0.4, c 12, d 1) on the Johnson-Cook law of AISI 1045, for want of published ones for steel.
"""

import argparse
from dataclasses import asdict, replace
from math import nan
from typing import Final

from convergence import deviation
from experiments import cut

from chipglow.cutting import (
    AISI_1045,
    CuttingConditions,
    CuttingSimulation,
    HyperbolicTangent,
    JohnsonCookDamage,
    Numerics,
    OutputWindow,
    workpiece,
)

WINDOW = OutputWindow(start=0.9e-3, interval=1e-6, later_bands=0)


assert AISI_1045.damage is not None
DAMAGE: Final[JohnsonCookDamage] = AISI_1045.damage


def damaged(**factors: float) -> JohnsonCookDamage:
    """The damage of AISI 1045 with some constants so many times as large."""
    return replace(DAMAGE, **{name: one * getattr(DAMAGE, name) for name, one in factors.items()})


CASES = {
    "johnson-cook": replace(AISI_1045, damage=None),
    "circulating-damage": replace(AISI_1045, damage=damaged(d1=10.0, d2=10.0)),
    "three-tenths": replace(AISI_1045, damage=damaged(d1=3.0, d2=3.0)),
    "default": AISI_1045,
    "half-energy": replace(AISI_1045, damage=damaged(fracture_energy=0.5)),
    "double-energy": replace(AISI_1045, damage=damaged(fracture_energy=2.0)),
    "more-loss": replace(AISI_1045, damage=damaged(loss=1.5)),
    "tanh": replace(
        AISI_1045,
        damage=None,
        flow_stress=HyperbolicTangent(
            **asdict(workpiece("aisi-1045/jaspers-dautzenberg").flow_stress),
            hardening_limit=1.1,
            recovery_temperature=0.4,
            recovery_strain=12.0,
            softening_temperature=1.0,
        ),
    ),
}


def row(name: str, cell: float, length: float) -> list[str]:
    """Run one cut and return its row of the table."""
    simulation = CuttingSimulation(
        CuttingConditions(cutting_length=length),
        workpiece=CASES[name],
        numerics=Numerics(cell=cell),
    )
    window = replace(WINDOW, end=min(WINDOW.end, length))
    chip, history, seconds = cut(simulation, window)
    values = (
        (chip.cutting_mean / 1e3, "{:.0f}"),
        (chip.cutting_swing / 1e3, "{:.0f}"),
        (chip.thrust_mean / 1e3, "{:.0f}"),
        (chip.period * 1e6, "{:.0f}" + deviation(chip.period_uncertainty)),
        (chip.frequency / 1e3, "{:.1f}"),
        (chip.spacing * 1e6, "{:.0f}"),
        (chip.degree * 100 if chip.segments > 1 else nan, "{:.0f}"),
        (chip.band_width * 1e6, "{:.0f}"),
        (history.energy.closing_error[-1] * 100, "{:.2f}"),
        (seconds, "{:.0f}"),
    )
    return [name, *(text.format(value) if value == value else "–" for value, text in values)]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cell", type=float, default=14.0)
    length = 1e3 * CuttingConditions().cutting_length
    parser.add_argument("--length", type=float, default=length)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(CASES))
    given = parser.parse_args()
    if unknown := set(given.names) - set(CASES):
        parser.error(f"{sorted(unknown)[0]!r}, expected some of {', '.join(CASES)}")
    print(
        "| law | cutting force / (N/mm) | swing / (N/mm) | thrust / (N/mm) | period / us "
        "| frequency / kHz | spacing / um | degree / % | band / um "
        "| unaccounted work / % | time / s |"
    )
    print("|---" * 11 + "|")
    for name in given.names or CASES:
        print(
            "| " + " | ".join(row(name, given.cell * 1e-6, given.length * 1e-3)) + " |", flush=True
        )


if __name__ == "__main__":
    main()
