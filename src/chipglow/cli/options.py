"""Arguments and options that several commands have."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

MeasurementFile: TypeAlias = Annotated[
    Path,
    typer.Argument(
        metavar="MEASUREMENT",
        help="A measurement, a camera's file, or a YAML file that describes one.",
    ),
]
Settings: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="FIELD=VALUE",
        help="Set a field of the description of a camera's file, such as 'pitch=6 um'; may be "
        "repeated.",
    ),
]
ToolChoice: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|found",
        help="The tool, a YAML file with the keys of a study's cutting.tool and tip; or 'found', "
        "to look for the rake face in the image; by default what the measurement tells, as a "
        "simulated one does.",
    ),
]
