"""The command ``chipglow psf``: point spread function by the knife edge."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli.options import Settings, argument, file_option, option, picture_option

if TYPE_CHECKING:
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.psf import KnifeEdge


def psf(
    edges: Annotated[
        list[Path],
        argument("EDGE...", "Images of a straight edge, preferably in several orientations."),
    ],
    apertures: Annotated[
        Path | None,
        option(
            "FILE",
            "YAML file that lists images of round apertures with their diameters, to determine "
            "the tails.",
        ),
    ] = None,
    region: Annotated[
        str | None,
        option("ROWS,COLUMNS", "Part of the images with only the edge, e.g. 10:70,20:90."),
    ] = None,
    model: Annotated[
        str | None,
        option(
            "NAME",
            "Model to write: gaussian, 'gaussian with tail', moffat, 'defocused disc', "
            "'annular aperture', 'elliptical gaussian' or radial. Default: the best fit.",
        ),
    ] = None,
    out: Annotated[
        Path | None, file_option("Point spread function to write, NetCDF (.nc).", ".nc")
    ] = None,
    plot: Annotated[Path | None, picture_option("Draw edges, spread and MTF")] = None,
    settings: Settings = None,
) -> None:
    """Determine the point spread function and MTF of a camera from images of an edge."""
    from chipglow.cli.finish import figure, finish
    from chipglow.cli.screen import current
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.psf import (
        aperture_image,
        knife_edge,
        load_apertures,
        load_edge,
        psf_kernel,
        write_psf,
    )
    from chipglow.laboratory.psf.figure import draw_knife_edge

    part = None if region is None else _region(region)
    given = settings or ()
    images = [load_edge(path, given, part) for path in edges]
    holes = [
        aperture_image(load_measurement(path, given), diameter, path.name)
        for path, diameter in (load_apertures(apertures) if apertures else ())
    ]
    found = knife_edge(images, holes)
    chosen = psf_kernel(found, model)
    _print(current(), found)
    finish(
        found.notes,
        (out, lambda path: write_psf(found, path, chosen)),
        (plot, figure(draw_knife_edge, found)),
    )


def _region(text: str) -> tuple[slice, slice]:
    """Rows and columns of a text such as 10:70,20:90."""
    try:
        rows, columns = (
            slice(*(int(number) if number.strip() else None for number in part.split(":")))
            for part in text.split(",")
        )
    except (ValueError, TypeError):
        raise ValueError(
            f"--region: {text!r}, expected rows and columns such as 10:70,20:90"
        ) from None
    return rows, columns


def _print(screen: "Screen", found: "KnifeEdge") -> None:
    from chipglow.laboratory.psf.summary import sentences

    fwhm = "fwhm_um ± fwhm_uncertainty_um"
    models = ["model", fwhm, "aicc", "bic", "weight", "reduced_chi_squared"]
    edges = ["image", "normal_deg ± normal_uncertainty_deg", fwhm, "line_fwhm_um"]
    edges += ["step_over_noise", "mtf_at_nyquist ± mtf_at_nyquist_uncertainty"]
    screen.table("models", found.to_frame(), models)
    screen.heading()
    screen.table("edges", found.edge_frame(), edges)
    screen.heading()
    for sentence in sentences(found):
        screen.say(sentence)
