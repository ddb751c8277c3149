from .atomic import atomic_folder as atomic_folder, atomic_path as atomic_path
from .column_file import read_curve as read_curve
from .file_kind import FileKind as FileKind, checked_kind as checked_kind, file_kind as file_kind
from .import_file import (
    ImportDescription as ImportDescription,
    import_description as import_description,
    import_text as import_text,
    load_import as load_import,
)
from .importing import (
    FieldOfView as FieldOfView,
    Import as Import,
    import_scene as import_scene,
    prospect as prospect,
    read_scene as read_scene,
)
from .measurement_file import (
    open_measurement as open_measurement,
    read_measurement as read_measurement,
    write_dataset as write_dataset,
    write_measurement as write_measurement,
)
from .movie_file import check_movie_path as check_movie_path, movie_writer as movie_writer
from .result_file import write_frame as write_frame, write_result as write_result
from .scene_file import (
    SCENE_FORMAT as SCENE_FORMAT,
    SceneWriter as SceneWriter,
    StoredScene as StoredScene,
    example_scene as example_scene,
    open_scene as open_scene,
    write_scene as write_scene,
)
from .spool import UnfinishedScene as UnfinishedScene, unfinished_scenes as unfinished_scenes
from .tool_section import (
    ToolSection as ToolSection,
    load_tool as load_tool,
    read_tool_outline as read_tool_outline,
)
