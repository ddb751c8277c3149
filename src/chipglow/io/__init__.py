"""Readers and writers: scenes, measurements, and output that is whole or not there."""

from chipglow.io.atomic import atomic_folder, atomic_path
from chipglow.io.measurement_file import read_measurement, write_dataset, write_measurement
from chipglow.io.movie_file import check_movie_path, movie_writer
from chipglow.io.scene_file import FORMAT_VERSION, SceneWriter, open_scene, write_scene
from chipglow.io.tool_file import read_tool_outline
from chipglow.io.unfinished import UnfinishedScene, unfinished_scenes

__all__ = [
    "FORMAT_VERSION",
    "SceneWriter",
    "UnfinishedScene",
    "atomic_folder",
    "atomic_path",
    "check_movie_path",
    "movie_writer",
    "open_scene",
    "read_measurement",
    "read_tool_outline",
    "unfinished_scenes",
    "write_dataset",
    "write_measurement",
    "write_scene",
]
