"""The command ``chipglow psf``: point spread function by the knife edge."""

from pathlib import Path
from typing import Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish


def psf(
    edges: Annotated[
        list[Path],
        opt.argument("EDGE...", "Images of a straight edge, preferably in several orientations."),
    ],
    apertures: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "YAML file that lists images of round apertures with their diameters, to determine "
            "the tails.",
        ),
    ] = None,
    region: Annotated[
        str | None,
        opt.value("ROWS,COLUMNS", "Part of the images with only the edge, e.g. 10:70,20:90."),
    ] = None,
    model: Annotated[
        str | None,
        opt.value(
            "NAME",
            "Model to write: gaussian, 'gaussian with tail', moffat, 'defocused disc', "
            "'annular aperture', 'elliptical gaussian' or radial. Default: the best fit.",
        ),
    ] = None,
    out: Annotated[
        Path | None, opt.file("Point spread function to write, NetCDF (.nc).", ".nc")
    ] = None,
    plot: Annotated[Path | None, opt.picture("Draw edges, spread and MTF")] = None,
    settings: opt.Settings = None,
) -> None:
    """Determine the point spread function and MTF of a camera from images of an edge."""
    from chipglow.laboratory import psf as lab
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.psf.figure import draw_knife_edge
    from chipglow.laboratory.psf.summary import sentences

    window = None if region is None else _region(region)
    images = [lab.load_edge(path, settings or (), window) for path in edges]
    holes = [
        lab.aperture_image(load_measurement(path, settings or ()), diameter, path.name)
        for path, diameter in (lab.load_apertures(apertures) if apertures else ())
    ]
    result = lab.knife_edge(images, holes)
    kernel = lab.psf_kernel(result, model)
    screen, fwhm = current(), "fwhm_um ± fwhm_uncertainty_um"
    columns = ["model", fwhm, "aicc", "bic", "weight", "reduced_chi_squared"]
    screen.table("models", result.to_frame(), columns)
    screen.heading()
    columns = ["image", "normal_deg ± normal_uncertainty_deg", fwhm, "line_fwhm_um"]
    columns += ["step_over_noise", "mtf_at_nyquist ± mtf_at_nyquist_uncertainty"]
    screen.table("edges", result.edge_frame(), columns)
    screen.heading()
    for sentence in sentences(result):
        screen.say(sentence)
    finish(
        result.notes,
        (out, lambda path: lab.write_psf(result, path, kernel)),
        (plot, figure(draw_knife_edge, result)),
    )


def _region(text: str) -> tuple[slice, slice]:
    """Parse rows and columns such as 10:70,20:90."""
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
