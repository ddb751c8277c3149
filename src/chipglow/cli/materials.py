"""The command ``chipglow materials``: tables of materials and of their numbers."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from chipglow.cli.pictures import write_picture
from chipglow.cutting import material_file, material_names


def list_materials() -> None:
    """Print the library: names, sets of the flow stress, what they are."""
    table = Table("name", "kind", "sets (the first is the default)", "what", box=None)
    for name in material_names():
        material = material_file(name)
        kind = "tool" if material.tool else "workpiece"
        what = f"{material.name}: {material.description}"
        table.add_row(name, kind, ", ".join(material.workpieces), what)
    Console().print(table)


def show_material(name: str) -> None:
    """Print all numbers of a material, with units, and their sources as numbered notes."""
    material = material_file(name)
    sources = list(dict.fromkeys(number.source for number in material.properties))
    table = Table("field", "value", "source", box=None)
    for number in material.properties:
        table.add_row(number.field, number.text, f"({sources.index(number.source) + 1})")
    console = Console(highlight=False, markup=False)
    console.print(f"{material.name}: {material.description}\n")
    console.print(table)
    console.print()
    for count, source in enumerate(sources, 1):
        console.print(f"({count}) {source}")


def plot_material(name: str, path: Path) -> None:
    """Draw a material to a picture whose kind is that of the file's name."""
    from chipglow.report.materials import material_figure

    write_picture(material_figure(material_file(name)), path)
