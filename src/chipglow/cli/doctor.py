"""The command ``chipglow doctor``: the installation and a numerical self-test."""

import os
import platform
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from math import expm1
from pathlib import Path
from typing import Final

import numba
import pandas as pd
from packaging.requirements import Requirement
from scipy.integrate import quad

import chipglow
from chipglow.cli.screen import current
from chipglow.cutting import SOLVER_VERSION
from chipglow.radiometry import Band
from chipglow.study import cache_folder, cached_scenes
from chipglow.text import install_command

_LEFT_OUT: Final = ("test", "dev", "docs", "import", "all")
"""Extras for developers, and those that only name others."""

_BAND: Final = (3.8e-6, 5.1e-6)
"""Limits in m of the band in which the radiance is checked: the paper's."""

_TEMPERATURES: Final = (600.0, 1000.0, 1500.0)
"""Temperatures in K at which the radiance is checked."""

_TOLERANCE: Final = 1e-6
"""Largest relative difference of a radiance from its integral by SciPy."""


def examine() -> None:
    """Print versions, packages, threads and cache; raise an error if something is wrong."""
    screen, packages = current(), _packages()
    columns = ["package", "installed", "needed"]
    screen.facts("machine", _machine())
    screen.heading()
    required = packages[packages["extra"] == ""]
    screen.table("packages", required, [*columns, "state"])
    screen.heading("\nOptional parts")
    screen.table("optional", packages[packages["extra"] != ""], ["extra", *columns, "advice"])
    largest = max(map(_radiance_difference, _TEMPERATURES))
    screen.heading()
    screen.say(
        f"In-band radiance at {_TEMPERATURES[0]:g} K to {_TEMPERATURES[-1]:g} K: within "
        f"{largest:.1g} of Planck's law, integrated by SciPy.",
        {"greatest_radiance_difference": largest},
    )
    wrong = required[required["state"] != ""]
    if not wrong.empty:
        names = ", ".join(f"{row.package} ({row.state})" for row in wrong.itertuples())
        raise ValueError(f"packages: {names}, expected python -m pip install --upgrade .")
    if not largest < _TOLERANCE:
        raise ValueError(f"in-band radiance: off by {largest:.1g}, expected below {_TOLERANCE:g}")


def _machine() -> Iterator[tuple[str, str]]:
    yield "chipglow", f"{version('chipglow')}, solver {SOLVER_VERSION}"
    yield "Python", f"{platform.python_version()}, {sys.executable}"
    yield "system", f"{platform.system()} {platform.release()}, {platform.machine()}"
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count()
    waiting = os.environ["OMP_WAIT_POLICY"]
    count = numba.config.NUMBA_NUM_THREADS
    yield "threads", f"{count} on {cores} available processors; {waiting} while they wait"
    folder, scenes = cache_folder(), cached_scenes()
    existing = next(each for each in (folder, *folder.parents) if each.exists())
    yield "cache", f"{folder}{_writable(existing, 'CHIPGLOW_CACHE')}"
    size, free = sum(scene.size for scene in scenes), shutil.disk_usage(existing).free
    yield "cached", f"{len(scenes)} scenes, {size / 1e6:.1f} MB; {free / 1e9:.1f} GB free"
    compiled = Path(numba.config.CACHE_DIR or chipglow.__path__[0])
    yield "compiled code", f"{compiled}{_writable(compiled, 'NUMBA_CACHE_DIR')}"


def _writable(folder: Path, variable: str) -> str:
    return "" if os.access(folder, os.W_OK) else f", not writable: set {variable}"


def _packages() -> pd.DataFrame:
    """Return the packages of chipglow's metadata, by the extra that requires them."""
    rows = []
    for text in requires("chipglow") or ():
        wanted = Requirement(text)
        extra = str(wanted.marker or "").partition("extra == ")[2].strip("\"'")
        if extra in _LEFT_OUT or wanted.name == "chipglow":
            continue
        installed = _installed(wanted.name)
        good = installed is not None and wanted.specifier.contains(installed, prereleases=True)
        rows.append(
            {
                "extra": extra,
                "package": wanted.name,
                "installed": installed or "–",
                "needed": str(wanted.specifier),
                "state": "" if good else "too old" if installed else "missing",
                "advice": "" if good else install_command(extra),
            }
        )
    return pd.DataFrame(rows)


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _radiance_difference(temperature: float) -> float:
    """Return the relative difference of the compiled radiance from Planck's law."""
    # First (per solid angle) and second radiation constant in W m²/sr and m K, CODATA 2018.
    c1, c2 = 1.191042972e-16, 0.01438776877

    def planck(wavelength: float) -> float:
        return c1 / wavelength**5 / expm1(c2 / (wavelength * temperature))

    exact = quad(planck, *_BAND, epsrel=1e-10)[0]  # far below `_TOLERANCE`
    return float(abs(Band(*_BAND).radiance(temperature) / exact - 1.0))
