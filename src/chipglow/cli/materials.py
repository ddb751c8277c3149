"""The command ``chipglow materials``."""

from pathlib import Path

import pandas as pd

from chipglow.cli.screen import current, figure, finish
from chipglow.cutting import material_file, material_names
from chipglow.text import Notes


def list_materials() -> None:
    """List the materials of the library."""
    title = "The first of several sets is the default."
    frame = pd.DataFrame(map(_row, material_names()))
    current().table("materials", frame, title=title, unbroken=("name",))


def _row(name: str) -> dict[str, str]:
    material = material_file(name)
    return {
        "name": name,
        "kind": "tool" if material.tool else "workpiece",
        "sets": ", ".join(material.workpieces),
        "description": f"{material.name}: {material.description}",
    }


def show_material(name: str, plot: Path | None) -> None:
    """Print all properties of a material, with units and numbered sources; optionally draw it."""
    from chipglow.report.materials import material_figure

    material = material_file(name)
    sources = list(dict.fromkeys(number.source for number in material.properties))
    rows = [
        {
            "field": number.field,
            "value": number.text,
            "source": number.source,
            "note": f"({sources.index(number.source) + 1})",
        }
        for number in material.properties
    ]
    screen = current()
    screen.say(f"{material.name}: {material.description}")
    screen.heading()
    columns = ["field", "value", "note"]
    screen.table("properties", pd.DataFrame(rows), columns, unbroken=("field",))
    screen.heading()
    for count, source in enumerate(sources, 1):
        screen.heading(f"({count}) {source}")
    finish(Notes(), (plot, figure(material_figure, material)))
