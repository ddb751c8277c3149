"""Settings for the correction of a measurement: in a session, and as controls."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from chipglow.app.controls import PSF_FILE, SESSION_PSF, ShownStudy
from chipglow.camera import MeasuredPSFFile
from chipglow.io import file_kind
from chipglow.laboratory.emissivity import PlacesDescription, StoredEmissivities
from chipglow.laboratory.emissivity.places import ELSEWHERE, FOUND, TOOL, PSFField
from chipglow.quantities import adapter
from chipglow.quantities.units import KELVINS, LENGTH, TEMPERATURE_DIFFERENCE


def correction_data(
    study: ShownStudy, stored: StoredEmissivities | None, uploads: Path | None
) -> dict[str, Any]:
    """Return what the page states for a correction, as the text of a file of places has it.

    `stored` are the emissivities of its file. Of a file in the folder of `uploads` only the name
    is stated, as the folder is removed at the end.
    """
    data: dict[str, Any] = {}

    def named(file: str) -> str:
        path = Path(file).absolute()
        is_uploaded = uploads is not None and path.is_relative_to(uploads)
        return path.name if is_uploaded else str(path)

    known = {
        ELSEWHERE: (study.emissivity, study.emissivity_uncertainty),
        TOOL: (study.tool_emissivity, study.tool_emissivity_uncertainty),
    }
    if study.tool_emissivity is None and (stored is None or TOOL not in stored.lines):
        known[TOOL] = known[ELSEWHERE]
    emissivities = {
        name: {"mean": mean, "uncertainty": uncertainty}
        for name, (mean, uncertainty) in known.items()
        if mean is not None
    }
    if emissivities:
        data["emissivities"] = emissivities
    if study.emissivity_file is not None:
        data["emissivity_file"] = named(study.emissivity_file)
    if study.named_elsewhere is not None:
        data["elsewhere"] = study.named_elsewhere
    if study.psf_file is not None and study.psf_source == PSF_FILE:
        data["psf"] = {"kind": "measured", "file": named(study.psf_file)}
    elif study.camera.psf is not None:
        data["psf"] = adapter(PSFField).dump_python(study.camera.psf, mode="json")
    if study.psf_uncertainty:
        data["psf_uncertainty"] = study.psf_uncertainty
    if study.tool is not None:
        data["tool"] = FOUND if study.tool == FOUND else named(study.tool)
    if study.outline_uncertainty is not None:
        data["outline_uncertainty"] = LENGTH.text(study.outline_uncertainty)
    return data


def given_texts(path: Path) -> dict[str, str]:
    """Return the controls that take a file: of emissivities or of a PSF; none take another."""
    with suppress(ValueError):  # of a damaged file, as on opening it
        kind = file_kind(path)
        if kind == "emissivity":
            return {"emissivity_file": str(path)}
        if kind == "psf":
            return {"camera.psf": PSF_FILE, "psf_file": str(path)}
    return {}


def correction_texts(places: PlacesDescription) -> dict[str, str]:
    """Return the controls of a correction that a session states."""
    texts = {}
    for name, control in ((ELSEWHERE, "emissivity"), (TOOL, "tool_emissivity")):
        if known := places.emissivities.get(name):
            texts[control] = f"{known.mean:.10g}"
            texts[f"{control}_uncertainty"] = f"{known.uncertainty:.10g}"
    if places.emissivity_file is not None:
        texts["emissivity_file"] = places.emissivity_file
    if places.elsewhere is not None:
        texts["elsewhere"] = places.elsewhere
    if isinstance(places.psf, MeasuredPSFFile):
        texts |= {"camera.psf": PSF_FILE, "psf_file": places.psf.file}
    elif places.psf is not None:
        texts["camera.psf"] = SESSION_PSF
    if places.tool is not None:
        texts["tool"] = places.tool
    if "reflected" in places.given:
        texts["camera.reflected"] = KELVINS.text(places.reflected)
    quantities = {
        "reflected_uncertainty": TEMPERATURE_DIFFERENCE.text(places.reflected_uncertainty),
        "psf_uncertainty": f"{places.psf_uncertainty:.10g}",
        "outline_uncertainty": LENGTH.text(places.outline_uncertainty or 0.0),
    }
    return texts | {name: text for name, text in quantities.items() if name in places.given}
