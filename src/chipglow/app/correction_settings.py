"""Settings for the correction of a measurement: in a session, and as controls."""

from pathlib import Path
from typing import Any

from chipglow.app.controls import PSF_FILE, SESSION_PSF, ShownStudy
from chipglow.camera import MeasuredPSFFile
from chipglow.laboratory.emissivity import PlacesDescription
from chipglow.laboratory.emissivity.places import ELSEWHERE, FOUND, TOOL, PSFField
from chipglow.quantities import adapter
from chipglow.quantities.units import KELVINS, LENGTH, TEMPERATURE_DIFFERENCE


def correction_data(study: ShownStudy) -> dict[str, Any]:
    """Return what the page states for a correction, as the text of a file of places has it."""
    data: dict[str, Any] = {}
    known = {
        ELSEWHERE: (study.emissivity, study.emissivity_uncertainty),
        TOOL: (study.tool_emissivity, study.tool_emissivity_uncertainty),
    }
    if study.tool_emissivity is None:
        known[TOOL] = known[ELSEWHERE]
    emissivities = {
        name: {"mean": mean, "uncertainty": uncertainty}
        for name, (mean, uncertainty) in known.items()
        if mean is not None
    }
    if emissivities:
        data["emissivities"] = emissivities
    if study.psf_file is not None and study.psf_source == PSF_FILE:
        data["psf"] = {"kind": "measured", "file": str(Path(study.psf_file).absolute())}
    elif study.camera.psf is not None:
        data["psf"] = adapter(PSFField).dump_python(study.camera.psf, mode="json")
    if study.psf_uncertainty:
        data["psf_uncertainty"] = study.psf_uncertainty
    if study.tool is not None:
        data["tool"] = FOUND if study.tool == FOUND else str(Path(study.tool).absolute())
    if study.outline_uncertainty is not None:
        data["outline_uncertainty"] = LENGTH.text(study.outline_uncertainty)
    return data


def correction_texts(places: PlacesDescription) -> dict[str, str]:
    """Return the controls of a correction that a session states."""
    texts = {}
    for name, control in ((ELSEWHERE, "emissivity"), (TOOL, "tool_emissivity")):
        if known := places.emissivities.get(name):
            texts[control] = f"{known.mean:.10g}"
            texts[f"{control}_uncertainty"] = f"{known.uncertainty:.10g}"
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
