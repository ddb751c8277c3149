"""The command ``chipglow doctor``: the installation and a numerical self-test."""

import os
import platform
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Final

import pandas as pd
from packaging.requirements import Requirement

from chipglow.cli.screen import Screen, current
from chipglow.cutting import SOLVER_VERSION
from chipglow.radiometry import Band
from chipglow.study import cache_folder, cached_scenes

_LEFT_OUT: Final = ("test", "dev", "docs", "import")
"""Extras for developers, and the one that only names others."""

_BAND: Final = (3.8e-6, 5.1e-6)
_TEMPERATURES: Final = (600.0, 1000.0, 1500.0)
_TOLERANCE: Final = 1e-6


def examine() -> None:
    """Print versions, optional packages, threads, cache and GPU; raise if something is wrong."""
    screen = current()
    screen.facts("machine", _machine())
    screen.heading()
    packages = _packages()
    columns = ["package", "installed", "needed"]
    screen.table("packages", packages[packages["extra"] == ""], [*columns, "state"])
    screen.heading("\nOptional parts")
    optional = packages[packages["extra"] != ""]
    screen.table("optional", optional, ["extra", *columns, "advice"])
    _say_differences(screen, packages)


def _machine() -> Iterator[tuple[str, str]]:
    yield "chipglow", f"{version('chipglow')}, solver {SOLVER_VERSION}"
    yield "Python", f"{platform.python_version()}, {sys.executable}"
    yield "system", f"{platform.system()} {platform.release()}, {platform.machine()}"
    yield "threads", _threads()
    yield "GPU", _gpu()
    yield from _cache()
    yield "compiled code", _compiled_folder()


def _threads() -> str:
    import numba

    count = numba.config.NUMBA_NUM_THREADS
    cores = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count()
    asked = ", by NUMBA_NUM_THREADS" if "NUMBA_NUM_THREADS" in os.environ else ""
    waiting = os.environ["OMP_WAIT_POLICY"]
    return f"{count}{asked}; {cores} processors may be used; {waiting} while they wait"


def _gpu() -> str:
    from numba import cuda

    if not cuda.is_available():
        return "none found; chipglow needs none"
    return f"{cuda.get_current_device().name.decode()}; chipglow computes on the processor"


def _cache() -> Iterator[tuple[str, str]]:
    folder, scenes = cache_folder(), cached_scenes()
    there = next(each for each in (folder, *folder.parents) if each.exists())
    writable = "" if os.access(there, os.W_OK) else ", which can't be written: set CHIPGLOW_CACHE"
    size = sum(scene.size for scene in scenes)
    yield "cache", f"{folder}{writable}"
    free = shutil.disk_usage(there).free
    yield "in it", f"{len(scenes)} scenes, {size / 1e6:.1f} MB; {free / 1e9:.1f} GB are free"


def _compiled_folder() -> str:
    import numba

    import chipglow

    chosen = numba.config.CACHE_DIR
    folder = Path(chosen) if chosen else Path(chipglow.__file__).parent
    if os.access(folder, os.W_OK):
        return f"kept in {folder}"
    return f"{folder} can't be written, so each run compiles anew: set NUMBA_CACHE_DIR"


def _packages() -> pd.DataFrame:
    """Return the packages of chipglow's metadata, by the extra that requires them."""
    rows = []
    for text in requires("chipglow") or ():
        wanted = Requirement(text)
        extra = _extra_of(wanted)
        if extra in _LEFT_OUT or wanted.name == "chipglow":
            continue
        here = _installed(wanted.name)
        good = here is not None and wanted.specifier.contains(here, prereleases=True)
        rows.append(
            {
                "extra": extra,
                "package": wanted.name,
                "installed": here or "–",
                "needed": str(wanted.specifier),
                "state": "" if good else "too old" if here else "missing",
                "advice": "" if good else f"pip install 'chipglow[{extra}]'",
            }
        )
    return pd.DataFrame(rows)


def _extra_of(wanted: Requirement) -> str:
    """Return the extra of a requirement; empty for mandatory packages."""
    marker = str(wanted.marker or "")
    return marker.partition("extra == ")[2].strip("\"'")


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _say_differences(screen: Screen, packages: pd.DataFrame) -> None:
    worst = max(map(_radiance_difference, _TEMPERATURES))
    screen.heading()
    screen.say(
        f"In-band radiance at {_TEMPERATURES[0]:g} K to {_TEMPERATURES[-1]:g} K: within "
        f"{worst:.1g} of Planck's law, integrated by SciPy.",
        {"greatest_radiance_difference": worst},
    )
    wrong = packages[(packages["extra"] == "") & (packages["state"] != "")]
    if not wrong.empty:
        names = ", ".join(f"{row.package} ({row.state})" for row in wrong.itertuples())
        raise ValueError(f"packages: {names}, expected pip install --upgrade chipglow")
    if not worst < _TOLERANCE:
        raise ValueError(f"in-band radiance: off by {worst:.1g}, expected under {_TOLERANCE:g}")


def _radiance_difference(temperature: float) -> float:
    """Return the relative difference of the compiled radiance from Planck's law."""
    from math import expm1

    from scipy.integrate import quad

    c1, c2 = 1.191042972e-16, 0.01438776877

    def planck(wavelength: float) -> float:
        return c1 / wavelength**5 / expm1(c2 / (wavelength * temperature))

    exact = quad(planck, *_BAND, epsrel=1e-10)[0]
    return float(abs(Band(*_BAND).radiance(temperature) / exact - 1.0))
