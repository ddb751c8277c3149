"""chipglow: a virtual infrared camera for metal cutting."""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from chipglow import uncertainty
    from chipglow.analysis import (
        Heating,
        Plan,
        StudyResult,
        align_times,
        analyse,
        areas,
        band_profile,
        compare,
        determine_emissivity,
        edge_image,
        error_images,
        find_tool,
        fit_dots,
        fit_images,
        fit_points,
        knife_edge,
        rake_grid,
        simultaneous_frames,
        true_temperature,
    )
    from chipglow.camera import (
        AnnularAperturePSF,
        Camera,
        ChipglowWarning,
        Detector,
        GaussianPSF,
        MeasuredPSF,
        Measurement,
    )
    from chipglow.cutting import (
        AISI_1045,
        CuttingSimulation,
        FlowStress,
        flow_stress_law,
    )
    from chipglow.io import (
        import_scene,
        open_scene,
        read_emissivity_map,
        read_measurement,
        read_recording,
        read_scene,
        write_hcc,
        write_measurement,
        write_psf,
        write_scene,
    )
    from chipglow.radiometry import Band
    from chipglow.report import write_report
    from chipglow.scene import Raster, Scene, ToolGeometry
    from chipglow.study import (
        Study,
        cut,
        load_import,
        load_measurement,
        load_regions,
        load_registration,
        load_study,
        run,
    )
    from chipglow.surface import (
        CHIP_1,
        CHIP_2,
        Emissivity,
        FeatureSurface,
        MapSurface,
        UniformSurface,
    )
    from chipglow.uncertainty import Estimate

__all__ = [
    "AISI_1045",
    "CHIP_1",
    "CHIP_2",
    "AnnularAperturePSF",
    "Band",
    "Camera",
    "ChipglowWarning",
    "CuttingSimulation",
    "Detector",
    "Emissivity",
    "Estimate",
    "FeatureSurface",
    "FlowStress",
    "GaussianPSF",
    "Heating",
    "MapSurface",
    "MeasuredPSF",
    "Measurement",
    "Plan",
    "Raster",
    "Scene",
    "Study",
    "StudyResult",
    "ToolGeometry",
    "UniformSurface",
    "align_times",
    "analyse",
    "areas",
    "band_profile",
    "compare",
    "cut",
    "determine_emissivity",
    "edge_image",
    "error_images",
    "find_tool",
    "fit_dots",
    "fit_images",
    "fit_points",
    "flow_stress_law",
    "import_scene",
    "knife_edge",
    "load_import",
    "load_measurement",
    "load_regions",
    "load_registration",
    "load_study",
    "open_scene",
    "rake_grid",
    "read_emissivity_map",
    "read_measurement",
    "read_recording",
    "read_scene",
    "run",
    "simultaneous_frames",
    "true_temperature",
    "uncertainty",
    "write_hcc",
    "write_measurement",
    "write_psf",
    "write_report",
    "write_scene",
]
__version__ = "0.1.0"

_ROOMS: Final = {
    "analysis": (
        "Heating",
        "Plan",
        "StudyResult",
        "align_times",
        "analyse",
        "areas",
        "band_profile",
        "compare",
        "determine_emissivity",
        "edge_image",
        "error_images",
        "find_tool",
        "fit_dots",
        "fit_images",
        "fit_points",
        "knife_edge",
        "rake_grid",
        "simultaneous_frames",
        "true_temperature",
    ),
    "camera": (
        "AnnularAperturePSF",
        "Camera",
        "ChipglowWarning",
        "Detector",
        "GaussianPSF",
        "MeasuredPSF",
        "Measurement",
    ),
    "cutting": (
        "AISI_1045",
        "CuttingSimulation",
        "FlowStress",
        "flow_stress_law",
    ),
    "io": (
        "import_scene",
        "open_scene",
        "read_emissivity_map",
        "read_measurement",
        "read_recording",
        "read_scene",
        "write_hcc",
        "write_measurement",
        "write_psf",
        "write_scene",
    ),
    "radiometry": ("Band",),
    "report": ("write_report",),
    "scene": ("Raster", "Scene", "ToolGeometry"),
    "study": (
        "Study",
        "cut",
        "load_import",
        "load_measurement",
        "load_regions",
        "load_registration",
        "load_study",
        "run",
    ),
    "surface": ("CHIP_1", "CHIP_2", "Emissivity", "FeatureSurface", "MapSurface", "UniformSurface"),
    "uncertainty": ("Estimate",),
}
_ROOM_OF: Final = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a room when one of its names is first used: the command line starts at once."""
    if name in _ROOM_OF:
        return getattr(import_module(f"chipglow.{_ROOM_OF[name]}"), name)
    if name in _ROOMS:
        return import_module(f"chipglow.{name}")
    raise AttributeError(f"module 'chipglow' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
