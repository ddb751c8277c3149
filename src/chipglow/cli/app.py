"""The commands. Each imports what it needs when it runs, so that ``--help`` answers at once."""

import gc
import signal
import sys
import threading
from _thread import interrupt_main
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import typer

from chipglow.cli import options as opt
from chipglow.cli.band import band
from chipglow.cli.boundary import INTERRUPTED, Boundary
from chipglow.cli.budget import budget
from chipglow.cli.camera import calibrate, psf
from chipglow.cli.cameras import cameras
from chipglow.cli.chip import rake, shearband
from chipglow.cli.compare import compare
from chipglow.cli.correct import correct
from chipglow.cli.emissivity import emissivity, temperature
from chipglow.cli.materials import materials
from chipglow.cli.register import register
from chipglow.cli.screen import current
from chipglow.cli.shortage import was_short_of_memory
from chipglow.cli.sources import convert, import_source
from chipglow.cli.streams import tolerate_failures
from chipglow.cli.studies import cut, error, measure, reproduce, run, wavelengths
from chipglow.cli.sweep import design, sweep

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

_SOON: Final = 0.01
"""Time in s after which a Ctrl-C that came in a callback is tried again."""

app = typer.Typer(
    cls=Boundary,
    help="A virtual infrared camera for metal cutting.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)
cache_app = typer.Typer(help="List or delete cached scenes.", no_args_is_help=True)


def main() -> None:
    """Run the command ``chipglow``."""
    # Imported modules stay: collecting garbage among them takes a tenth of a short command.
    gc.set_threshold(10_000)
    tolerate_failures()
    # A terminated job cleans up as after Ctrl-C, unless nohup keeps it running.
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, signal.SIGTERM)
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    sys.unraisablehook = _ignored
    try:
        app()
    except KeyboardInterrupt:  # before the command begins
        print("chipglow: interrupted, nothing was written", file=sys.stderr)
        sys.exit(INTERRUPTED)


def _ignored(error: "UnraisableHookArgs") -> None:
    """Take an error that Python ignores, as it came in a callback of a library.

    Ctrl-C is repeated as soon as the callback has ended; a lack of memory is one line. Errors of
    ``__del__`` are not shown: Ctrl-C may have left the object incomplete.
    """
    if issubclass(error.exc_type, KeyboardInterrupt):
        again = threading.Timer(_SOON, _interrupt)
        again.daemon = True
        again.start()
    elif issubclass(error.exc_type, MemoryError) or was_short_of_memory():
        print("chipglow: not enough memory for a part of the page", file=sys.stderr)
    elif getattr(error.object, "__name__", "") != "__del__":
        sys.__unraisablehook__(error)


def _interrupt() -> None:
    """Interrupt the main thread, also while it waits where the system can."""
    if sys.platform == "win32":
        interrupt_main()
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"chipglow {version('chipglow')}")
        raise typer.Exit


def _use_json(wanted: bool) -> None:
    if wanted:
        current().json = True


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


def init(
    path: Annotated[Path, opt.argument("STUDY", "File to write.", writable=True)] = Path(
        "study.yaml"
    ),
    force: Annotated[bool, opt.flag("--force", "Replace an existing file.")] = False,
    of_import: Annotated[
        bool, opt.flag("--import", "Write the description of an import instead.")
    ] = False,
    of_measurement: Annotated[
        bool, opt.flag("--measurement", "Write the description of a camera file instead.")
    ] = False,
    schema: Annotated[
        bool, opt.flag("--schema", "Write its JSON schema, for editors that check YAML.")
    ] = False,
) -> None:
    """Write the paper's study as a commented YAML file."""
    from chipglow.io import atomic_path, import_description, import_text
    from chipglow.laboratory.recordings import MeasurementDescription, measurement_text
    from chipglow.study import Study, study_text
    from chipglow.text import json_schema

    if of_import and of_measurement:
        raise ValueError("--import and --measurement cannot be combined")
    if path.exists() and not force:
        raise FileExistsError(f"{path}: already exists; choose another name or pass --force")
    kinds: dict[str, tuple[type, Callable[[Any], str]]] = {
        "study": (Study, study_text),
        "import": (import_description(), import_text),
        "measurement": (MeasurementDescription, measurement_text),
    }
    kind, write = kinds["import" if of_import else "measurement" if of_measurement else "study"]
    with atomic_path(path) as temporary:
        temporary.write_text(json_schema(kind) if schema else write(kind()), encoding="utf-8")
    current().file(path)


def show(
    file: Annotated[Path, opt.argument("FILE", "Scene or measurement, a NetCDF file.")],
    at: Annotated[
        float | None, opt.time("Time of the frame, e.g. '400 us'. Default: the middle.")
    ] = None,
    plot: Annotated[Path | None, opt.picture("Draw the fields at that time")] = None,
) -> None:
    """Show the contents of a scene or measurement: samples, times, values and provenance."""
    from chipglow.cli.showing import show as show_file

    show_file(file, at, plot)


def open_app(
    path: Annotated[
        Path | None,
        opt.argument(
            "[PATH]",
            "Scene or measurement (NetCDF), camera file, file of another program, study or "
            "session (YAML), or results folder. Default: a small bundled scene.",
            show_default=False,
        ),
    ] = None,
    address: Annotated[
        str,
        opt.value(
            "ADDRESS",
            "Address to listen on. Other addresses than loopback admit anyone with the printed "
            "URL, unencrypted.",
        ),
    ] = "127.0.0.1",
    port: Annotated[int, opt.value("PORT", "Port; 0 for any free one.")] = 0,
    browser: Annotated[
        bool, opt.flag("--browser/--no-browser", "Open the page in a browser.")
    ] = True,
) -> None:
    """Open a file in a browser; change camera settings and see the error. Stop with Ctrl-C."""
    import webbrowser

    from chipglow.app import serve

    def announce(url: str) -> None:
        screen = current()
        screen.say(f"The app is at {url}\nCtrl-C stops it.", {"url": url})
        screen.close()
        if browser:
            webbrowser.open(url)

    serve(path, address, port, announce)


def doctor() -> None:
    """Check the installation and run a numerical self-test."""
    from chipglow.cli.doctor import examine

    examine()


def list_cached() -> None:
    """List the cached scenes, the latest first, with their sizes."""
    from datetime import datetime

    from chipglow.study import cache_folder, cached_scenes

    scenes, screen = cached_scenes(), current()
    for scene in scenes:
        when = datetime.fromtimestamp(scene.modified).strftime("%Y-%m-%d %H:%M")
        screen.heading(f"{when}  {_megabytes(scene.size):>10}  {scene.path.name}")
    total = sum(scene.size for scene in scenes)
    count = "1 scene" if len(scenes) == 1 else f"{len(scenes)} scenes"
    screen.say(f"{count}, {_megabytes(total)} in {cache_folder()}")
    screen.values({"scenes": {str(scene.path): scene.size for scene in scenes}, "bytes": total})


def clear_cached() -> None:
    """Delete the cached scenes."""
    from chipglow.study import cache_folder, clear_cache

    freed = clear_cache()
    current().say(f"{_megabytes(freed)} freed in {cache_folder()}", {"bytes": freed})


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


_Commands: TypeAlias = Mapping[str, tuple[Callable[..., None], str]]
"""Commands by name, each with the arguments of its example, the last line of its help."""

COMMANDS: Final[_Commands] = {
    "reproduce": (reproduce, "--quick --out results"),
    "init": (init, "study.yaml"),
    "run": (run, "study.yaml --out results"),
    "error": (error, "scene.nc --emissivity 0.7 --out results"),
    "band": (band, "--width 20um --rise 300K --speed 4m/s --camera study.yaml --plot band.png"),
    "cut": (cut, "study.yaml --out scene.nc"),
    "import": (
        import_source,
        "'chip_*.vtu' --set units.length=mm --set interval=1us --out scene.nc",
    ),
    "measure": (measure, "scene.nc --study study.yaml --chip 'chip 2' --out measured.nc"),
    "wavelengths": (wavelengths, "study.yaml --plot bands.png"),
    "sweep": (sweep, "study.yaml --vary camera.integration_time=2us,5us,10us --out sweep"),
    "budget": (budget, "study.yaml --at 'rake face' --out budget.csv --plot budget.png"),
    "design": (design, "study.yaml --vary camera.integration_time=2us,5us,10us --at 'rake face'"),
    "show": (show, "measured.nc --plot measured.png"),
    "app": (open_app, "scene.nc"),
    "materials": (materials, "aisi-1045"),
    "cameras": (cameras, "flir-a6751"),
    "doctor": (doctor, ""),
}

LABORATORY: Final[_Commands] = {
    "calibrate": (
        calibrate,
        "points.csv --band 3.8-5.1um --integration-time 10us --out calibration.yaml",
    ),
    "convert": (
        convert,
        "chip.hcc --set 'pitch=6 um' --set calibration=calibration.yaml --out chip.nc",
    ),
    "emissivity": (
        emissivity,
        "chip.nc --regions regions.yaml --reference 391degC --out emissivity.nc",
    ),
    "temperature": (temperature, "chip.nc --regions regions.yaml --emissivity emissivity.nc"),
    "correct": (correct, "measured.nc --study study.yaml --out corrected.nc --plot corrected.png"),
    "psf": (psf, "edge.nc --out psf.nc --plot psf.png"),
    "register": (register, "infrared.nc visible.png --points points.csv --out map.yaml"),
    "rake": (rake, "chip.nc --tool found --out rake.csv"),
    "shearband": (shearband, "chip.nc --plot band.png"),
    "compare": (compare, "measured.nc chip-1.nc chip-2.nc --out comparison"),
}

for panel, commands in ((None, COMMANDS), ("The laboratory", LABORATORY)):
    for name, (command, example) in commands.items():
        epilog = f"Example: chipglow {name} {example}"
        app.command(name, rich_help_panel=panel, epilog=epilog)(command)

cache_app.command("list")(list_cached)
cache_app.command("clear")(clear_cached)
app.add_typer(cache_app, name="cache")
