"""Time and memory to propagate 12 correlated components of uncertainty of an image.

Each pixel's radiance is that of its temperature and a common emissivity by Wien's law: a
function of two estimates that share a component. The package uncertainties does the same with an
array of its own numbers, on as many pixels as it is given (it takes minutes for all).
"""

import argparse
import time
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np

from chipglow.uncertainty import Estimate, propagate

COMPONENTS = 12
C2 = 14387.77 / 4.4


def made(shape: tuple[int, int]) -> tuple[np.ndarray, list[np.ndarray]]:
    generator = np.random.default_rng(0)
    effects = [generator.normal(0.0, 1.0, shape) for _ in range(COMPONENTS)]
    return generator.uniform(600.0, 1500.0, shape), effects


def with_chipglow(shape: tuple[int, int], derivatives: bool) -> np.ndarray:
    temperature, effects = made(shape)
    image = Estimate(temperature)
    for number, effect in enumerate(effects):
        image = image.with_component(f"cause {number}", effect)
    emissivity = Estimate(0.5).with_component("cause 0", 0.01)
    slopes: list[Callable[..., Any]] = [
        lambda t, e: e * np.exp(-C2 / t) * C2 / t**2,
        lambda t, e: np.exp(-C2 / t),
    ]
    found = propagate(
        lambda t, e: e * np.exp(-C2 / t),
        image,
        emissivity,
        derivatives=slopes if derivatives else None,
    )
    return found.standard_uncertainty


def with_uncertainties(shape: tuple[int, int]) -> np.ndarray:
    from uncertainties import ufloat, unumpy

    temperature, effects = made(shape)
    errors = [ufloat(0.0, 1.0) for _ in range(COMPONENTS)]
    image = temperature + sum(effect * error for effect, error in zip(effects, errors, strict=True))
    return unumpy.std_devs((0.5 + 0.01 * errors[0]) * unumpy.exp(-C2 / image))


def row(label: str, shape: tuple[int, int], found: Callable[[], np.ndarray]) -> np.ndarray:
    start = time.perf_counter()
    found()
    taken = time.perf_counter() - start
    tracemalloc.start()
    spread = found()
    peak = tracemalloc.get_traced_memory()[1] / 1e6
    tracemalloc.stop()
    per_pixel = taken / spread.size * 1e6
    size = f"{shape[1]} × {shape[0]}"
    print(f"| {label} | {size} | {taken:.3g} | {peak:.4g} | {per_pixel:.3g} |", flush=True)
    return spread


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, nargs=2, default=(640, 512), metavar=("WIDE", "HIGH"))
    parser.add_argument("--peer-size", type=int, nargs=2, default=(64, 51))
    arguments = parser.parse_args()
    shape, small = tuple(arguments.size[::-1]), tuple(arguments.peer_size[::-1])
    print("| program | pixels | time / s | memory / MB | time for a pixel / µs |")
    print("|---|---|---|---|---|")
    for label, derivatives in (("chipglow, derivatives", True), ("chipglow, differences", False)):
        row(label, shape, lambda derivatives=derivatives: with_chipglow(shape, derivatives))
    try:
        import uncertainties  # noqa: F401
    except ImportError:
        print("uncertainties is not installed.")
        return
    peer = row("uncertainties", small, lambda: with_uncertainties(small))
    away = np.abs(with_chipglow(small, True) / peer - 1).max()
    print(f"\nLargest relative difference of the standard uncertainties: {away:.1e}")


if __name__ == "__main__":
    main()
