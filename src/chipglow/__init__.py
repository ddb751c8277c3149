"""chipglow: a virtual infrared camera for metal cutting."""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from chipglow.analysis import (
        StudyResult,
        analyse,
        band_profile,
        compare,
        determine_emissivity,
        error_images,
        knife_edge,
        rake_grid,
        true_temperature,
    )
    from chipglow.camera import (
        AnnularAperturePSF,
        Camera,
        Detector,
        GaussianPSF,
        MeasuredPSF,
        Measurement,
    )
    from chipglow.cutting import CuttingSimulation
    from chipglow.io import (
        import_scene,
        open_scene,
        read_emissivity_map,
        read_measurement,
        read_scene,
        write_measurement,
        write_scene,
    )
    from chipglow.radiometry import Band
    from chipglow.report import write_report
    from chipglow.scene import Raster, Scene, ToolGeometry
    from chipglow.study import Study, cut, load_import, load_measurement, load_study, run
    from chipglow.surface import (
        CHIP_1,
        CHIP_2,
        Emissivity,
        FeatureSurface,
        MapSurface,
        UniformSurface,
    )

__all__ = [
    "CHIP_1",
    "CHIP_2",
    "AnnularAperturePSF",
    "Band",
    "Camera",
    "CuttingSimulation",
    "Detector",
    "Emissivity",
    "FeatureSurface",
    "GaussianPSF",
    "MapSurface",
    "MeasuredPSF",
    "Measurement",
    "Raster",
    "Scene",
    "Study",
    "StudyResult",
    "ToolGeometry",
    "UniformSurface",
    "analyse",
    "band_profile",
    "compare",
    "cut",
    "determine_emissivity",
    "error_images",
    "import_scene",
    "knife_edge",
    "load_import",
    "load_measurement",
    "load_study",
    "open_scene",
    "rake_grid",
    "read_emissivity_map",
    "read_measurement",
    "read_scene",
    "run",
    "true_temperature",
    "write_measurement",
    "write_report",
    "write_scene",
]
__version__ = "0.1.0"

_ROOMS: Final = {
    "analysis": (
        "band_profile",
        "compare",
        "knife_edge",
        "rake_grid",
        "true_temperature",
        "StudyResult",
        "analyse",
        "determine_emissivity",
        "error_images",
    ),
    "camera": (
        "Detector",
        "AnnularAperturePSF",
        "Camera",
        "GaussianPSF",
        "MeasuredPSF",
        "Measurement",
    ),
    "cutting": ("CuttingSimulation",),
    "io": (
        "import_scene",
        "open_scene",
        "read_emissivity_map",
        "read_measurement",
        "read_scene",
        "write_measurement",
        "write_scene",
    ),
    "radiometry": ("Band",),
    "report": ("write_report",),
    "scene": ("Raster", "Scene", "ToolGeometry"),
    "study": ("load_measurement", "Study", "cut", "load_import", "load_study", "run"),
    "surface": ("CHIP_1", "CHIP_2", "Emissivity", "FeatureSurface", "MapSurface", "UniformSurface"),
}
_ROOM_OF: Final = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a room when one of its names is first used: the command line starts at once."""
    if name in _ROOM_OF:
        return getattr(import_module(f"chipglow.{_ROOM_OF[name]}"), name)
    raise AttributeError(f"module 'chipglow' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
