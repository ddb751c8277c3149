"""The verification suite: every case against what is known, as a table and as plots.

    python benchmarks/verification.py [--out docs/verification] [case ...]

Prints a Markdown table and ends with 1 if a check fails. With a folder it draws the plots there,
and writes the table as `table.md` if all cases were asked for. About a minute on one core.
"""

import argparse
import sys
from pathlib import Path
from time import perf_counter

from cases import cylinder, expansion, heat, motion, plasticity, surface_heat, taylor, upsetting

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


HEADER = (
    "| case | what | known | computed | error | tolerance | reason of the tolerance |",
    "|---" * 7 + "|",
)


def number(value, unit=""):
    """A number in four digits with its unit."""
    return f"{value:.4g} {unit}".strip()


def row(case, check):
    """One line of the table."""
    unit = check.unit if check.absolute else ""
    return " | ".join(
        [
            case.title,
            check.quantity,
            f"{check.source}: {number(check.expected, check.unit)}",
            number(check.computed, check.unit),
            number(check.error, unit) if check.absolute else f"{check.error * 100:.2g} %",
            number(check.tolerance, unit) if check.absolute else f"{check.tolerance * 100:.2g} %",
            check.reason if check.holds else f"**FAILS** {check.reason}",
        ]
    )


def picture(case, folder):
    """Write a case's figure."""
    with style():
        figure = new_figure(case.height)
        case.draw(figure)
        figure.savefig(folder / f"{case.name}.png", dpi=120)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, help="folder for the table and the plots")
    parser.add_argument("cases", nargs="*", help=f"all by default: {', '.join(CASES)}")
    given = parser.parse_args(arguments)
    if unknown := sorted(set(given.cases) - set(CASES)):
        parser.error(f"case: expected some of {', '.join(CASES)}, got {', '.join(unknown)}")
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
    lines, failed = list(HEADER), 0
    print(*HEADER, sep="\n")
    for name in given.cases or CASES:
        start = perf_counter()
        case = CASES[name]()
        rows = [f"| {row(case, check)} |" for check in case.checks]
        failed += sum(not check.holds for check in case.checks)
        print(*rows, sep="\n", flush=True)
        lines += rows
        if given.out:
            picture(case, given.out)
        print(f"{name}: {perf_counter() - start:.1f} s", file=sys.stderr)
    if given.out and not given.cases:
        (given.out / "table.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
