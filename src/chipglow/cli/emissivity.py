"""The commands ``chipglow emissivity`` and ``temperature``: of regions of a heated object."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from chipglow.cli import options as opt
from chipglow.cli.batch import common_notes, for_each, load_measurements
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.camera import Measurement
    from chipglow.laboratory import emissivity as lab
    from chipglow.surface import Origin
    from chipglow.text import Notes


def emissivity(
    images: Annotated[list[Path], opt.argument("IMAGE...", "Measurements of the heated object.")],
    reference: Annotated[
        list[float],
        opt.temperature(
            "True temperature of the object, e.g. 391degC: once for all images, or once per image. "
            "Images at one temperature are repetitions."
        ),
    ],
    regions: opt.RegionsFile,
    reflected: Annotated[
        float,
        opt.temperature(
            "Temperature of the surroundings that the object reflects. Default: 293 K."
        ),
    ] = 293.0,
    reference_uncertainty: Annotated[
        float, opt.kelvins("Standard uncertainty of the true temperature, e.g. '2 K'.")
    ] = 0.0,
    reflected_uncertainty: opt.ReflectedUncertainty = None,
    camera_uncertainty: opt.CameraUncertainty = None,
    drift: opt.Drift = None,
    metal: Annotated[
        str, opt.value("NAME", "Metal of the object, e.g. 'Ti-6Al-4V': stored with the emissivity.")
    ] = "",
    out: Annotated[Path | None, opt.file("Write maps and regions, NetCDF.")] = None,
    table: Annotated[Path | None, opt.file("Write the table of regions, CSV.")] = None,
    plot: Annotated[Path | None, opt.picture("Draw image, regions and map")] = None,
    settings: opt.Settings = None,
) -> None:
    """Determine emissivity from images of an object of known temperature."""
    from chipglow.io.result_file import write_frame
    from chipglow.laboratory import emissivity as lab
    from chipglow.laboratory.emissivity.figure import draw_emissivity

    if len(reference) not in (1, len(images)):
        raise ValueError(
            f"--reference: {len(reference)} temperatures for {len(images)} images, "
            "expected one for all or one for each"
        )
    heatings = [
        lab.Heating(
            kelvins,
            reflected,
            reference_uncertainty,
            reflected_uncertainty or 0.0,
            camera_uncertainty,
            drift,
        )
        for kelvins in (reference if len(reference) > 1 else reference * len(images))
    ]
    named = lab.load_regions(regions)
    measurements = load_measurements(images, settings or ())
    names = list(map(str, images))
    result = lab.determine_emissivities(measurements, heatings, named, names, metal)
    _print_tables(result)
    _print_study(result, out)
    whole = {row.name for row in result.rows[0] if row.whole}
    lines = [line for line in result.lines if line.name in whole]
    finish(
        sum((one.notes for one in measurements), result.notes),
        (out, partial(lab.write_emissivity, result)),
        (table, partial(write_frame, result.to_frame())),
        (plot, figure(draw_emissivity, result.maps[0], named, lines)),
    )


def _print_tables(result: "lab.RegionEmissivities") -> None:
    from chipglow.laboratory.emissivity.emissivity import BUDGET
    from chipglow.quantities import ZERO_CELSIUS

    screen = current()
    columns = ["region", "pixels", "mean", "standard_deviation", "standard_uncertainty"]
    columns += ["expanded_uncertainty", "coverage_factor"]
    parts = {"parts of u": "region"} | {cause: f"{cause}_uncertainty" for cause in BUDGET}
    for kelvins, rows in result.to_frame().groupby("reference_K", sort=False):
        screen.heading(f"\nObject at {kelvins - ZERO_CELSIUS:.6g} °C")
        screen.table("regions", rows, columns)
        screen.heading()
        screen.table(None, rows, parts)
    if result.lines:
        screen.heading("\nOver the temperature, with standard uncertainties")
        over_temperature = {
            "region": "region",
            "emissivity": "emissivity ± emissivity_uncertainty",
            "at / °C": "temperature_degC",
            "change in 100 K": "change_in_100_K ± change_in_100_K_uncertainty",
            "sd about line": "residual",
        }
        screen.table("lines", result.line_frame(), over_temperature)


def _print_study(result: "lab.RegionEmissivities", out: Path | None) -> None:
    from chipglow.laboratory import emissivity as lab
    from chipglow.quantities import ZERO_CELSIUS

    text, head = lab.surface_text(result), "For a study"
    if text and len(result.maps) > 1:
        if out is not None and "chips" in text:
            text = lab.measured_text(out)
        else:
            head += f" at {result.maps[0].heating.reference - ZERO_CELSIUS:.6g} °C"
    if text:
        current().heading(f"\n\n{head}:\n\n{text}")
        current().values({"study": text})


def temperature(
    images: Annotated[
        list[Path],
        opt.argument(
            "IMAGE...",
            "Measurements of the object, taken as repetitions or, by --each, one by one.",
        ),
    ],
    regions: opt.RegionsFile,
    emissivity: Annotated[
        str | None,
        opt.value(
            "FILE|NUMBER",
            "Output of chipglow emissivity for regions of the same names (NetCDF), or one "
            "emissivity for all, e.g. 0.42. Default: as the file of the regions states.",
        ),
    ] = None,
    emissivity_uncertainty: Annotated[
        float | None, opt.value("NUMBER", "Standard uncertainty of an emissivity given as number.")
    ] = None,
    calibration: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Calibration of the camera, YAML. It states how its errors in the emissivity and in "
            "these images are correlated.",
        ),
    ] = None,
    reflected: Annotated[
        float | None,
        opt.temperature(
            "Temperature of the surroundings that the object reflects. Default: as in the "
            "determination of the emissivity, with the same error, as the file of the regions "
            "states, or 293 K."
        ),
    ] = None,
    reflected_uncertainty: opt.ReflectedUncertainty = None,
    camera_uncertainty: opt.CameraUncertainty = None,
    drift: opt.Drift = None,
    each: Annotated[
        bool, opt.flag("--each", "Determine the temperatures of each image by itself.")
    ] = False,
    study: Annotated[
        Path | None,
        opt.value(
            "STUDY",
            "Study of this measurement, with places of the regions' names, seen on its first chip: "
            "its errors by blur, pixels and motion correct the temperatures.",
        ),
    ] = None,
    table: Annotated[Path | None, opt.file("Write the table of regions, CSV.")] = None,
    settings: opt.Settings = None,
) -> None:
    """Determine the true temperature of regions of known emissivity."""
    from chipglow.io.result_file import write_frame
    from chipglow.laboratory import emissivity as lab
    from chipglow.laboratory.recordings import load_calibration, load_measurement

    if each and study is not None:
        raise ValueError("--each and --study cannot be combined: a study is of one measurement")
    described = lab.load_places(regions)
    named, surroundings = lab.load_regions(regions), described.surroundings()
    if reflected is not None or reflected_uncertainty is not None:
        surroundings = lab.reflected_temperature(
            reflected or lab.LABORATORY, reflected_uncertainty or 0.0
        )
    fitted = None if calibration is None else load_calibration(calibration)
    lines = emissivities_of(emissivity, emissivity_uncertainty, described)
    origin = origin_of(emissivity, described)

    def found(
        measurements: "list[Measurement]", names: list[str]
    ) -> "tuple[lab.RegionTemperatures, Notes]":
        result = lab.true_temperatures(
            measurements, named, lines, surroundings, fitted, drift, names, camera_uncertainty
        )
        notes = sum((one.notes for one in measurements), result.notes)
        return result, notes + lab.doubts(origin, measurements)

    if each:
        results = for_each(
            images, lambda image: found([load_measurement(image, settings or ())], [str(image)])
        )
        frame = _each(results)
        notes = common_notes({image: those for image, (_, those) in results.items()})
    else:
        measurements = load_measurements(images, settings or ())
        result, notes = found(measurements, list(map(str, images)))
        _print(result)
        frame = result.to_frame()
        if study is not None:
            notes += _correct(result, measurements[0], frame, study)
    finish(notes, (table, partial(write_frame, frame)))


def _each(results: "dict[Path, tuple[lab.RegionTemperatures, Notes]]") -> "pd.DataFrame":
    """Print the temperatures of each image and return them, a row for each image and region."""
    import pandas as pd

    frames = []
    for image, (result, _) in results.items():
        frame = result.to_frame()
        frame.insert(0, "image", str(image))
        frames.append(frame)
    whole = pd.concat(frames, ignore_index=True)
    current().table("regions", _celsius(whole), {"image": "image"} | _TEMPERATURES)
    return whole


def _correct(
    result: "lab.RegionTemperatures", image: "Measurement", frame: "pd.DataFrame", study: Path
) -> "Notes":
    """Print the corrected temperatures and their budgets, and add them to the frame."""
    import pandas as pd

    from chipglow.cli.progress import progress_bars
    from chipglow.quantities import ZERO_CELSIUS
    from chipglow.study import corrected_temperatures, load_study

    screen = current()
    with progress_bars() as progress:
        corrected, notes = corrected_temperatures(result, image, load_study(study), progress)
    rows = list(corrected.values())
    estimates = {name: row.estimate for name, row in corrected.items()}
    values = {
        "temperature_K": [float(row.estimate.values) for row in rows],
        "uncertainty_K": [float(row.estimate.standard_uncertainty) for row in rows],
        "coverage_factor": [float(row.estimate.coverage_factor()) for row in rows],
        "expanded_uncertainty_K": [float(row.estimate.expanded_uncertainty()) for row in rows],
        "low_K": [float(row.distribution.low) for row in rows],
        "high_K": [float(row.distribution.high) for row in rows],
    }
    for name, column in values.items():
        frame[f"corrected_{name}"] = column
    frame["simulated_radiance_temperature_K"] = [row.simulated for row in rows]
    frame["residual_K"] = [row.residual for row in rows]
    frame["residual_uncertainty_K"] = [row.residual_uncertainty for row in rows]
    shown = frame.assign(
        corrected_temperature_degC=frame.corrected_temperature_K - ZERO_CELSIUS,
        corrected_low_degC=frame.corrected_low_K - ZERO_CELSIUS,
        corrected_high_degC=frame.corrected_high_K - ZERO_CELSIUS,
        correction_K=frame.corrected_temperature_K - frame.true_temperature_K,
    )
    columns = {
        "region": "region",
        "correction / K": "correction_K",
        "corrected ± u / °C": "corrected_temperature_degC ± corrected_uncertainty_K",
        "U 95 % / K": "corrected_expanded_uncertainty_K",
        "k": "corrected_coverage_factor",
        "lower 95 % / °C": "corrected_low_degC",
        "upper 95 % / °C": "corrected_high_degC",
        "image - study ± u / K": "residual_K ± residual_uncertainty_K",
    }
    screen.heading("\nCorrected for blur, pixels and motion")
    screen.table("corrected", shown, columns)
    parts = pd.DataFrame(
        {"region": name, "input": part, "contribution_K": float(estimate.contribution(part))}
        for name, estimate in estimates.items()
        for part in estimate.names
    ).dropna()
    screen.heading()
    screen.table("budget", parts.sort_values(["region", "contribution_K"], ascending=[True, False]))
    return notes.about(str(study))


def emissivities_of(
    text: str | None, uncertainty: float | None, described: "lab.PlacesDescription | None"
) -> "lab.EmissivityLine | dict[str, lab.EmissivityLine]":
    """Return the emissivities of an option: a file's by their names, or one number for all.

    Without the option they are those that the file of the regions states.
    """
    from chipglow.laboratory import emissivity as lab

    if text is not None and _is_number(text):
        return lab.EmissivityLine.constant(float(text), uncertainty or 0.0)
    if uncertainty is not None:
        raise ValueError("--emissivity-uncertainty: the file states it, omit the option")
    if text is not None:
        return lab.read_emissivity_lines(Path(text))
    if described is None or not described.states_emissivity:
        raise ValueError(
            "--emissivity: is missing; give a file of chipglow emissivity or a number, or state "
            "emissivities in the file of the regions"
        )
    return described.known()


def origin_of(emissivity: str | None, described: "lab.PlacesDescription | None") -> "Origin | None":
    """Return band and metal of the emissivities of an option, or of what it is by default."""
    from chipglow.laboratory import emissivity as lab

    if emissivity is None:
        emissivity = None if described is None else described.emissivity_file
    if emissivity is None or _is_number(emissivity):
        return None
    return lab.read_origin(emissivity)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _print(result: "lab.RegionTemperatures") -> None:
    from chipglow.laboratory.emissivity.temperature import TEMPERATURE_BUDGET

    screen, rows = current(), result.to_frame()
    screen.table("regions", _celsius(rows), _TEMPERATURES)
    screen.heading()
    parts = {cause: f"{cause}_uncertainty_K" for cause in TEMPERATURE_BUDGET}
    screen.table(None, rows, {"parts of u / K": "region"} | parts)


def _celsius(rows: "pd.DataFrame") -> "pd.DataFrame":
    from chipglow.quantities import ZERO_CELSIUS

    names = ("radiance_temperature", "true_temperature", "low", "high")
    return rows.assign(**{f"{name}_degC": rows[f"{name}_K"] - ZERO_CELSIUS for name in names})


_TEMPERATURES: Final = {
    "region": "region",
    "pixels": "pixels",
    "radiance temperature / °C": "radiance_temperature_degC",
    "emissivity": "emissivity",
    "true temperature ± u / °C": "true_temperature_degC ± standard_uncertainty_K",
    "U 95 % / K": "expanded_uncertainty_K",
    "k": "coverage_factor",
    "lower 95 % / °C": "low_degC",
    "upper 95 % / °C": "high_degC",
}
"""Columns of a table of true temperatures."""
