"""Readers and writers: scenes, measurements, and output that is whole or not there."""

from chipglow.io.atomic import atomic_folder, atomic_path
from chipglow.io.import_description import (
    ImportDescription,
    import_description,
    import_text,
    load_import,
)
from chipglow.io.importing import Import, View, import_scene, prospect, read_scene
from chipglow.io.measurement_file import (
    is_measurement,
    read_measurement,
    write_dataset,
    write_measurement,
)
from chipglow.io.movie_file import check_movie_path, movie_writer
from chipglow.io.scene_file import (
    SCENE_FORMAT,
    SceneWriter,
    StoredScene,
    example_scene,
    is_scene,
    open_scene,
    write_scene,
)
from chipglow.io.spool import UnfinishedScene, unfinished_scenes
from chipglow.io.tool_section import ToolSection, read_tool_outline

__all__ = [
    "SCENE_FORMAT",
    "Import",
    "ImportDescription",
    "SceneWriter",
    "StoredScene",
    "ToolSection",
    "UnfinishedScene",
    "View",
    "atomic_folder",
    "atomic_path",
    "check_movie_path",
    "example_scene",
    "import_description",
    "import_scene",
    "import_text",
    "is_measurement",
    "is_scene",
    "load_import",
    "movie_writer",
    "open_scene",
    "prospect",
    "read_measurement",
    "read_scene",
    "read_tool_outline",
    "unfinished_scenes",
    "write_dataset",
    "write_measurement",
    "write_scene",
]
