"""The verification suite: every case against what is known, as a table and as plots.

    python benchmarks/verification.py [--out docs/verification] [case ...]

Prints a Markdown table and ends with 1 if a check fails. With a folder it draws the plots there,
and writes the table as `table.md` if all cases were asked for. About a minute on one core.
"""

import sys
from contextlib import redirect_stdout
from pathlib import Path

from cases import cylinder, expansion, heat, motion, plasticity, surface_heat, taylor, upsetting
from common import arguments, print_head, print_row, timed

from chipglow.drawing.drawing import new_figure, style

CASES = {
    "momentum": motion.momentum,
    "waves": motion.waves,
    "vibration": motion.vibrations,
    "conduction": heat.conduction,
    "surface-flux": surface_heat.surface_flux,
    "moving-source": surface_heat.moving_source,
    "expansion": expansion.bent,
    "shear": plasticity.adiabatic_shear,
    "friction": plasticity.friction,
    "cylinder": cylinder.thick_cylinder,
    "upsetting": upsetting.rough_plates,
    "taylor": taylor.taylor_impact,
}

HEAD = "case", "what", "known", "computed", "error", "tolerance", "reason of the tolerance"


def number(value, unit=""):
    return f"{value:.4g} {unit}".strip()


def row(case, check):
    unit = check.unit if check.absolute else ""
    difference, tolerance = (
        number(each, unit) if check.absolute else f"{each * 100:.2g} %"
        for each in (check.error, check.tolerance)
    )
    known = f"{check.source}: {number(check.expected, check.unit)}"
    computed = number(check.computed, check.unit)
    reason = check.reason if check.holds else f"**FAILS** {check.reason}"
    return case.title, check.quantity, known, computed, difference, tolerance, reason


def main(given=None):
    given = arguments(__doc__, given, cases=tuple(CASES), out=Path)
    rows, failed = [], 0
    print_head(*HEAD)
    for name in given.cases:
        case, seconds, _ = timed(CASES[name])
        for check in case.checks:
            failed += not check.holds
            rows.append(row(case, check))
            print_row(*rows[-1])
        if given.out:
            given.out.mkdir(parents=True, exist_ok=True)
            with style():
                figure = new_figure(case.height)
                case.draw(figure)
                figure.savefig(given.out / f"{name}.png", dpi=120)
        print(f"{name}: {seconds:.1f} s", file=sys.stderr)
    if given.out and len(given.cases) == len(CASES):
        with (given.out / "table.md").open("w", encoding="utf-8") as file, redirect_stdout(file):
            print_head(*HEAD)
            for line in rows:
                print_row(*line)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
