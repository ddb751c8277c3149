"""The commands. Each imports what it needs when it runs, so that ``--help`` answers at once."""

import gc
import signal
import sys
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated, Final

import typer

from chipglow.cli.boundary import Boundary
from chipglow.cli.calibrate import calibrate
from chipglow.cli.compare import compare
from chipglow.cli.convert import convert
from chipglow.cli.emissivity import emissivity
from chipglow.cli.options import Force, file_option, folder_option, picture_option
from chipglow.cli.psf import psf
from chipglow.cli.rake import rake
from chipglow.cli.register import register
from chipglow.cli.screen import current
from chipglow.cli.shearband import shearband
from chipglow.cli.temperature import temperature
from chipglow.cli.wavelengths import wavelengths

PAPER_FOLDER: Final = Path("chipglow-paper")
ERROR_FOLDER: Final = Path("chipglow-error")

app = typer.Typer(
    cls=Boundary,
    help="A virtual infrared camera for metal cutting.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)
cache_app = typer.Typer(help="Scenes that were computed before.", no_args_is_help=True)
app.add_typer(cache_app, name="cache")

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a YAML file.")]
ResultFolder = Annotated[
    Path, folder_option("Folder of the results; earlier results are replaced.")
]
Yes = Annotated[
    bool, typer.Option("--yes", help="Do not ask before a cut of many minutes or gigabytes.")
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on with the same cut where an earlier run was ended.")
]


def main() -> None:
    """Run the command ``chipglow``."""
    # What is imported stays: to look through it for garbage again and again takes a tenth of a
    # short command.
    gc.set_threshold(10_000)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            # A terminal that knows no µ or − shall show a question mark, not end the command.
            stream.reconfigure(errors="replace")
    # A job that is ended from outside tidies up as after Ctrl-C, unless nohup keeps it running.
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, signal.SIGTERM)
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    app()


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"chipglow {version('chipglow')}")
        raise typer.Exit


def _use_json(wanted: bool) -> None:
    if wanted:
        current().for_programs()


@app.callback()
def _chipglow(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
    json: Annotated[
        bool,
        typer.Option(
            "--json",
            callback=_use_json,
            expose_value=False,
            help="Print the results as one JSON object.",
        ),
    ] = False,
) -> None:
    pass


@app.command()
def reproduce(
    quick: Annotated[
        bool, typer.Option("--quick", help="On a coarse cell and coarse samples, in a minute.")
    ] = False,
    steady_tool: Annotated[
        bool,
        typer.Option(
            "--steady-tool",
            help="Beside it the same with a tool that has been cutting for long; twice the time.",
        ),
    ] = False,
    out: ResultFolder = PAPER_FOLDER,
    force: Force = False,
    resume: Resume = False,
    yes: Yes = False,
) -> None:
    """Do the paper's study anew and set its figures beside the paper's."""
    from chipglow.cli.results import write_results
    from chipglow.report import QUICK
    from chipglow.study import Study

    if quick:
        write_results(Study.quick(), out, force, resume, yes, [QUICK], steady_tool)
    else:
        write_results(Study(), out, force, resume, yes, steady_tool=steady_tool)


@app.command()
def init(
    path: Annotated[
        Path, typer.Argument(metavar="STUDY", help="The file to write.", writable=True)
    ] = Path("study.yaml"),
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    of_import: Annotated[
        bool, typer.Option("--import", help="Write the description of an import instead.")
    ] = False,
    of_measurement: Annotated[
        bool,
        typer.Option("--measurement", help="Write the description of a camera's file instead."),
    ] = False,
    schema: Annotated[
        bool,
        typer.Option("--schema", help="Write its JSON schema, for editors that check YAML."),
    ] = False,
) -> None:
    """Write the paper's study as a commented YAML file."""
    from chipglow.io import atomic_path, import_description, import_text
    from chipglow.laboratory.measurement import MeasurementDescription, measurement_text
    from chipglow.study import Study, study_text
    from chipglow.text import json_schema

    if of_import and of_measurement:
        raise ValueError("--measurement: expected only one of --import and --measurement")
    if path.exists() and not force:
        raise FileExistsError(f"{path}: is there already, expected a new name or --force")
    with atomic_path(path) as temporary:
        if of_import:
            imported = import_description()
            text = json_schema(imported) if schema else import_text(imported())
        elif of_measurement:
            measurement = MeasurementDescription
            text = json_schema(measurement) if schema else measurement_text(measurement())
        else:
            text = json_schema(Study) if schema else study_text(Study())
        temporary.write_text(text, encoding="utf-8")
    current().file(path)


@app.command()
def run(
    study: StudyFile,
    out: ResultFolder,
    force: Force = False,
    resume: Resume = False,
    yes: Yes = False,
) -> None:
    """Run a study: cut, look, analyse, report."""
    from chipglow.cli.results import write_results
    from chipglow.study import load_study

    write_results(load_study(study), out, force, resume, yes)


@app.command()
def error(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="The scene, a NetCDF file.")],
    study: Annotated[
        Path | None,
        typer.Option(
            metavar="STUDY",
            help="Says surface, camera and places; what it leaves out is the paper's.",
        ),
    ] = None,
    emissivity: Annotated[
        float | None,
        typer.Option(metavar="NUMBER", help="One emissivity, in the place of the study's surface."),
    ] = None,
    out: ResultFolder = ERROR_FOLDER,
    force: Force = False,
) -> None:
    """Give a camera's error on any scene: of a cut, a weld, a melt pool, a plate."""
    from chipglow.cli.results import write_errors
    from chipglow.cli.scene_error import study_of

    write_errors(study_of(scene, study, emissivity), out, force)


@app.command()
def cut(
    study: StudyFile,
    out: Annotated[Path, file_option("The scene to write, NetCDF.")],
    preview: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            writable=True,
            help="A movie to write, .mp4 or .gif: temperature, plastic strain and strain rate of "
            "the whole cut; with --resume, of what is still to come; of a cut that was computed "
            "before, the part that was recorded.",
        ),
    ] = None,
    resume: Resume = False,
    yes: Yes = False,
) -> None:
    """Do only the cutting simulation of a study."""
    from chipglow.cli.cutting import cut_study
    from chipglow.study import load_study

    cut_study(load_study(study), out, preview, resume, yes)
    current().file(out)
    if preview is not None:
        current().file(preview)


@app.command("import")
def import_source(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="A mesh, grid, point cloud or movie; or a YAML file that describes an import.",
        ),
    ],
    out: Annotated[
        Path | None,
        file_option("The scene to write, NetCDF; without it, only say what is there."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="FIELD=VALUE",
            help="Set a field of the description, such as units.length=mm; may be repeated.",
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on where an earlier import was ended.")
    ] = False,
) -> None:
    """Make a scene of someone else's fields."""
    from chipglow.cli.importing import import_fields
    from chipglow.io import load_import

    import_fields(load_import(source, settings or ()), out, resume)


@app.command()
def measure(
    scene: Annotated[Path, typer.Argument(metavar="SCENE", help="The scene, a NetCDF file.")],
    study: Annotated[
        Path, typer.Option(metavar="STUDY", help="The study that says surface and camera.")
    ],
    out: Annotated[Path, file_option("The measurement to write, NetCDF.")],
    start: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="When the first exposure starts, such as '400 us'; by default with the scene.",
        ),
    ] = None,
    chip: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Which of the study's chips; by default the first."),
    ] = None,
) -> None:
    """Do only the camera of a study: look at a scene."""
    from chipglow.cli.measuring import measure_scene
    from chipglow.study import load_study

    measure_scene(scene, load_study(study), out, start, chip)


app.command()(wavelengths)


@app.command()
def show(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A scene or a measurement, a NetCDF file.")
    ],
    at: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="When, such as '400 us'; by default in the middle."),
    ] = None,
    plot: Annotated[Path | None, picture_option("Draw the fields at that time")] = None,
) -> None:
    """Show what is in a scene or a measurement: samples, times, values, where it comes from."""
    from chipglow.io import is_measurement

    if is_measurement(file):
        from chipglow.cli.showing_measurement import show_measurement

        show_measurement(file, at, plot)
    else:
        from chipglow.cli.showing import check_shown, show_scene

        check_shown(file)
        show_scene(file, at, plot)


@app.command("app")
def open_app(
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="[PATH]",
            help="A scene or a measurement, NetCDF, or a folder of results; by default a small "
            "scene that comes with the program.",
            show_default=False,
        ),
    ] = None,
    address: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help="Where to listen; another than this machine's own lets others in who have the "
            "printed address, unencrypted.",
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(metavar="PORT", help="0 for any that is free.")] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Turn the camera's knobs in a browser and see the error change; ends with Ctrl-C."""
    from chipglow.cli.serving import serve_app

    serve_app(path, address, port, browser)


@app.command()
def materials(
    name: Annotated[
        str | None,
        typer.Argument(metavar="NAME", help="Show this one: a name, or your own file (.yaml)."),
    ] = None,
    plot: Annotated[Path | None, picture_option("Draw flow stress and heat properties")] = None,
) -> None:
    """List the materials, or show the numbers of one with their sources."""
    from chipglow.cli.materials import list_materials, plot_material, show_material

    if name is None:
        if plot is not None:
            raise ValueError("--plot: expected the name of a material to draw")
        list_materials()
        return
    show_material(name)
    if plot is not None:
        plot_material(name, plot)


@app.command()
def doctor() -> None:
    """Examine this machine: versions, optional parts, threads, cache, GPU, and one number."""
    from chipglow.cli.doctor import examine

    examine()


for command in (
    calibrate, convert, emissivity, temperature, psf, register, rake, shearband, compare,
):  # fmt: skip
    app.command(rich_help_panel="The laboratory")(command)


@cache_app.command("list")
def list_cache() -> None:
    """Show the cached scenes, the latest first, and their size."""
    from datetime import datetime

    from chipglow.study import cache_folder, cached_scenes

    scenes, screen = cached_scenes(), current()
    for scene in scenes:
        when = datetime.fromtimestamp(scene.modified).strftime("%Y-%m-%d %H:%M")
        screen.heading(f"{when}  {_megabytes(scene.size):>10}  {scene.path.name}")
    total = sum(scene.size for scene in scenes)
    screen.say(f"{len(scenes)} scenes, {_megabytes(total)} in {cache_folder()}")
    screen.values({"scenes": {str(scene.path): scene.size for scene in scenes}, "bytes": total})


@cache_app.command("clear")
def clear() -> None:
    """Delete the cached scenes."""
    from chipglow.study import cache_folder, clear_cache

    freed = clear_cache()
    current().say(f"{_megabytes(freed)} freed in {cache_folder()}", {"bytes": freed})


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
