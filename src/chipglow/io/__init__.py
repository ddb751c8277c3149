"""Readers and writers: scenes, measurements, and output that is whole or not there."""

from chipglow.io.atomic import atomic_folder, atomic_path
from chipglow.io.band_file import read_curve, write_band_profile
from chipglow.io.cameras import CAMERA_FORMATS, CameraFormat, read_recording, write_hcc
from chipglow.io.comparison_file import write_comparison
from chipglow.io.emissivity_file import (
    StoredEmissivity,
    read_emissivity_map,
    read_region_emissivity,
    write_emissivity,
    write_emissivity_table,
    write_temperature_table,
)
from chipglow.io.importing import Import, View, import_scene, prospect, read_scene
from chipglow.io.measurement_file import (
    is_measurement,
    read_measurement,
    write_dataset,
    write_measurement,
)
from chipglow.io.movie_file import check_movie_path, movie_writer
from chipglow.io.picture_file import read_pictures
from chipglow.io.points_file import read_points
from chipglow.io.psf_file import write_psf
from chipglow.io.rake_grid_file import write_rake_grid
from chipglow.io.scene_file import (
    FORMAT_VERSION,
    SceneWriter,
    StoredScene,
    is_scene,
    open_scene,
    write_scene,
)
from chipglow.io.table_file import check_table_path
from chipglow.io.tool_file import read_tool_outline
from chipglow.io.unfinished import UnfinishedScene, unfinished_scenes

__all__ = [
    "CAMERA_FORMATS",
    "FORMAT_VERSION",
    "CameraFormat",
    "Import",
    "SceneWriter",
    "StoredEmissivity",
    "StoredScene",
    "UnfinishedScene",
    "View",
    "atomic_folder",
    "atomic_path",
    "check_movie_path",
    "check_table_path",
    "import_scene",
    "is_measurement",
    "is_scene",
    "movie_writer",
    "open_scene",
    "prospect",
    "read_curve",
    "read_emissivity_map",
    "read_measurement",
    "read_pictures",
    "read_points",
    "read_recording",
    "read_region_emissivity",
    "read_scene",
    "read_tool_outline",
    "unfinished_scenes",
    "write_band_profile",
    "write_comparison",
    "write_dataset",
    "write_emissivity",
    "write_emissivity_table",
    "write_hcc",
    "write_measurement",
    "write_psf",
    "write_rake_grid",
    "write_scene",
    "write_temperature_table",
]
