"""What a reader of meshes over time offers."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from errno import ENOENT
from pathlib import Path
from types import MappingProxyType

from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.source import damaged, naming
from chipglow.text import check_own_data


class MeshReader(ABC):
    """Meshes over time, in files of one kind: each is a frame, or the only one has all of them.

    Parameters
    ----------
    files : sequence of Path
        The files.
    kind : str
        Their format, for people.

    Attributes
    ----------
    kind : str
        What it is, for people.
    times : tuple of float, optional
        Times of the frames in the file's unit; None if the files have none.
    count : int
        Number of frames.
    known : mapping
        Names that fields have in this format alone, by those of a scene.

    Raises
    ------
    FileNotFoundError
        If a file is missing.
    SourceError
        If one cannot be read.
    """

    times: tuple[float, ...] | None = None
    known: Mapping[str, str] = MappingProxyType({})

    def __init__(self, files: Sequence[Path], kind: str) -> None:
        for file in files:
            if not file.is_file():
                raise FileNotFoundError(ENOENT, "there is no such file", str(file))
            try:
                with naming(file):
                    check_own_data(file)
            except OSError as error:  # of HDF5, not of the disk
                raise damaged(file, error) from error
        self.files = files
        self.count = len(files)
        self.kind = f"mesh, {len(files)} file{'s' * (len(files) > 1)} of {kind}"

    def file(self, number: int) -> Path:
        """The file that holds a frame, or the first of several that do; for messages."""
        return self.files[min(number, len(self.files) - 1)]

    @abstractmethod
    def read(self, number: int) -> tuple[Block, ...]:
        """The mesh of a frame.

        Raises
        ------
        SourceError
            If it cannot be read.
        """
