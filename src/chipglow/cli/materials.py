"""The command ``chipglow materials``."""

from pathlib import Path
from typing import Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish


def materials(
    name: Annotated[
        str | None, opt.argument("NAME", "Material to show: a name, or your own file (.yaml).")
    ] = None,
    plot: Annotated[Path | None, opt.picture("Draw flow stress and heat properties")] = None,
) -> None:
    """List the materials, or show the properties of one with their sources."""
    import pandas as pd

    from chipglow.cutting import material_file, material_names
    from chipglow.text import Notes

    screen = current()
    if name is None:
        if plot is not None:
            raise ValueError("--plot requires the name of a material")
        files = {one: material_file(one) for one in material_names()}
        rows = [
            {
                "name": one,
                "kind": "tool" if file.tool else "workpiece",
                "sets": ", ".join(file.workpieces),
                "description": f"{file.name}: {file.description}",
            }
            for one, file in files.items()
        ]
        title = "The first of several sets is the default."
        screen.table("materials", pd.DataFrame(rows), title=title, unbroken=("name",))
        return
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
    screen.say(f"{material.name}: {material.description}")
    screen.heading()
    columns = ["field", "value", "note"]
    screen.table("properties", pd.DataFrame(rows), columns, unbroken=("field",))
    screen.heading()
    for count, source in enumerate(sources, 1):
        screen.heading(f"({count}) {source}")
    if plot is not None:
        from chipglow.cutting.material_figure import material_figure

        finish(Notes(), (plot, figure(material_figure, material)))
