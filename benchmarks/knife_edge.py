"""How often the knife edge's 95 % intervals hold the truth: the tables of docs/do/knife-edge.md.

python benchmarks/knife_edge.py [--repeats 60] [NAME ...]

A NAME is the beginning of a row's name, such as Moffat; all rows by default.
"""

import sys
from collections import Counter
from math import radians, sqrt
from pathlib import Path

import numpy as np
from common import arguments, print_head, print_row

from chipglow.camera import AnnularAperturePSF
from chipglow.laboratory.psf import knife_edge
from chipglow.laboratory.psf.psf_models import DefocusedDiscModel, GaussianTailModel

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import synthetic_edge as edges

STEP = 5.0
MIRROR = (0.28, 0.35)
OVAL = (14e-6, 8e-6)  # widths along 45 degrees and across
UP_TO_NYQUIST = np.arange(2, 33, 6)


def coverage(repeats, name, edge, fwhm, noise, saturation=None, gaussian=False):
    """Print the fraction of intervals of the width, and of the MTF, that hold the truth."""
    generator = np.random.default_rng(5)
    within, held, uncertainty = [], [], []
    for seed in range(repeats):
        normal = generator.uniform(3.0, 12.0) + generator.choice([0, 90, 180, 270])
        found = knife_edge([image(generator, edge, normal, noise, seed, saturation)])
        within.append(abs(found.fwhm - fwhm) < 1.96 * found.edge_uncertainty)
        uncertainty.append(found.edge_uncertainty)
        if gaussian:
            curves = found.edges[0].curves
            true = edges.gaussian_transfer(curves["frequency"].values, fwhm, normal)
            apart = np.abs(curves["mtf"].values - true) < 1.96 * curves["mtf_uncertainty"].values
            held.append(apart[UP_TO_NYQUIST])
    mtf = f", MTF {100 * np.mean(held):.0f} %" if held else ""
    width = f"u = {1e6 * np.mean(uncertainty):.2g} um"
    print(f"{name}, noise {noise}: {width}, width {100 * np.mean(within):.0f} %{mtf}", flush=True)


def image(generator, edge, normal, noise, seed, saturation=None):
    place = generator.uniform(-6e-6, 6e-6)
    radiance = edges.edge_radiance(edge, normal, position=place, step=STEP)
    return edges.image_of(radiance, noise * STEP, seed, saturation)


def mirror():
    """Edge and width of a mirror objective."""
    optics = edges.WAVELENGTH, *MIRROR
    return edges.annular_edge(*optics), AnnularAperturePSF(*optics).fwhm


def optics():
    """Kinds of optics: edge-spread function by the edge's normal, width, the edges' normals."""
    tail = GaussianTailModel().fwhm(np.array([8e-6, 0.2, 2.5]))
    blurred = DefocusedDiscModel().fwhm(np.array([16e-6, 8e-6]))
    kinds = {
        "Gaussian": (edges.gaussian_edge(10e-6), 10e-6),
        "Gaussian with tail": (edges.tailed_edge(8e-6, 0.2, 20e-6), tail),
        "diffraction": mirror(),
        "Moffat, exponent 2": (edges.moffat_edge(10e-6, 2.0), 10e-6),
        "Moffat, exponent 3": (edges.moffat_edge(10e-6, 3.0), 10e-6),
        "disc out of focus": (edges.disc_edge(12e-6), 24e-6),
        "blurred disc": (edges.blurred_disc_edge(16e-6, 8e-6), blurred),
        "ring (mirror out of focus)": (edges.ring_edge(6e-6, 12e-6), 24e-6),
    }
    for name, (edge, fwhm) in kinds.items():
        yield name, lambda normal, edge=edge: edge, fwhm, (0.0,)
    mean = sqrt(OVAL[0] * OVAL[1])
    yield "astigmatism at 45 deg, two edges", oval, mean, (0.0, 90.0)
    yield "astigmatism at 45 deg, three edges", oval, mean, (0.0, 90.0, 45.0)


def oval(normal):
    turned = radians(normal - 45.0)
    return edges.gaussian_edge(np.hypot(OVAL[0] * np.cos(turned), OVAL[1] * np.sin(turned)))


def kind_of_optics(repeats, name, edge_of, fwhm, normals):
    """How often the width is held for a kind of optics, and what the program says of it."""
    generator = np.random.default_rng(5)
    errors, uncertainties, said, models = [], [], [], Counter()
    for seed in range(repeats):
        tilted = [normal + generator.uniform(3.0, 12.0) for normal in normals]
        images = [
            image(generator, edge_of(normal), normal, 0.01, 3 * seed + k)
            for k, normal in enumerate(tilted)
        ]
        found = knife_edge(images)
        errors.append(found.fwhm - fwhm)
        round_ = len(normals) == 1
        uncertainties.append(found.edge_uncertainty if round_ else found.fwhm_uncertainty)
        said.append(any("No model fits" in warning for warning in found.notes.warnings))
        models[found.best.model.name] += 1
    held = np.abs(errors) < 1.96 * np.array(uncertainties)
    bias, uncertainty = f"{1e6 * np.mean(errors):+.2f}", f"{1e6 * np.mean(uncertainties):.2f}"
    told = f"{np.mean(held):.0%}", f"{np.mean(said):.0%}", models.most_common(1)[0][0]
    return name, f"{1e6 * fwhm:.2f}", bias, uncertainty, *told


def levels_of_noise():
    """Optics, noise and clipping: arguments of `coverage`."""
    gauss = (edges.gaussian_edge(10e-6), 10e-6)
    return (
        ("Gaussian", *gauss, 0.01, None, True),
        ("Gaussian", *gauss, 0.1, None, True),
        ("Gaussian, clipped at 90 %", *gauss, 0.01, 6.5, True),
        ("diffraction", *mirror(), 0.01),
        ("diffraction", *mirror(), 0.03),
        ("diffraction, clipped at 92 %", *mirror(), 0.01, 6.6),
    )


def main():
    given = arguments(__doc__, repeats=60, names=None)
    names = tuple(given.names) or ("",)
    for row in levels_of_noise():
        if row[0].startswith(names):
            coverage(given.repeats, *row)
    print_head("optics", "width / um", "bias / um", "u / um", "held", "said", "model")
    for row in optics():
        if row[0].startswith(names):
            print_row(*kind_of_optics(given.repeats, *row))


if __name__ == "__main__":
    main()
