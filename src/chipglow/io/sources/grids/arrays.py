"""Arrays in files of many formats behind one face: they are described first and read in parts."""

import mmap
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime, timedelta
from functools import cache, partial
from math import prod
from pathlib import Path
from typing import Any, Final, TypeAlias
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import FRAME_NAMES, OTHER_NAMES, simple
from chipglow.io.sources.file_names import files_of, missing_number
from chipglow.io.sources.grids.file_array import FileArray, Key, Read, check_samples, list_array
from chipglow.io.sources.grids.images import png_arrays, tiff_arrays
from chipglow.io.sources.grids.unpacking import PACKING, unpack
from chipglow.io.sources.source import (
    SourceError,
    check_hdf5,
    head_of,
    reading,
    required,
    table_errors,
)
from chipglow.text import Notes, read_matrix

_MOST_NOTES: Final = 10
"""Most notes on the files of a series."""

_MORE_NOTES: Final = "There are more notes on further files."
_KINDS: Final = "fiub"
_ATTRIBUTES: Final = (
    "units", "standard_name", "axis", "bounds", "flag_values", "flag_masks", "flag_meanings",
    "DISPLAY_ORIGIN", "IMAGE_SUBCLASS", "IMAGE_WHITE_IS_ZERO", *PACKING,
)  # fmt: skip
"""Attributes of HDF5's images and of the NetCDF and CF conventions that readers use."""
_NO_COORDINATE: Final = b"This is a netCDF dimension but not a netCDF variable"
_CODECS: Final = (
    "blosc", "bz2", "bytes", "crc32c", "delta", "fixedscaleoffset", "gzip", "lz4", "lzma",
    "packbits", "quantize", "sharding_indexed", "shuffle", "transpose", "zlib", "zstd",
)  # fmt: skip

ArrayReader: TypeAlias = Callable[[Path, ExitStack], Iterator[FileArray]]
"""Opens a file, which the stack closes, and yields its arrays."""


def open_arrays(
    pattern: str, stack: ExitStack, reader: ArrayReader | None = None
) -> dict[str, FileArray]:
    """Return the arrays of a file by their names; the stack closes the file.

    By a pattern with ``*`` each file is a frame, or several along its own first axis; the arrays
    get a first axis ``time``. The reader depends on the ending of the name by default.
    """
    paths = files_of(pattern)
    first = _open_file(paths[0], stack, reader)
    if not first:
        raise SourceError(f"{paths[0]}: there is no array of numbers in it")
    arrays = list(first.values())
    if len(paths) > 1 or paths[0] != Path(pattern):
        notes, gap = Notes(), missing_number(paths)
        if gap:
            notes.warnings.append(f"{pattern}: {gap}; the frames are taken as evenly spaced.")
        arrays = [_series(paths, array, reader, notes) for array in arrays]
    arrays = [_squeezed(array) for array in arrays]
    only = re.sub(r"[\W\d_]+$", "", Path(pattern).stem) or "values"
    arrays = [replace(array, name=array.name or only, path=pattern) for array in arrays]
    return {array.name: array for array in arrays}


def _open_file(
    path: Path, stack: ExitStack, reader: ArrayReader | None = None
) -> dict[str, FileArray]:
    suffix = path.suffix.lower()
    reader = reader or ARRAY_READERS.get(suffix)
    if reader is None:
        raise SourceError(
            f"{path}: unknown ending {suffix!r}, expected one of {', '.join(sorted(ARRAY_READERS))}"
        )
    if path.is_file() and path.stat().st_size == 0:
        raise SourceError(f"{path}: is empty")
    with reading(path):
        return {array.name: replace(array, path=str(path)) for array in reader(path, stack)}


def _series(
    paths: Sequence[Path], first: FileArray, reader: ArrayReader | None, notes: Notes
) -> FileArray:
    """Return the unpacked arrays of one name in all files, one after the other along time."""
    said = first.notes + notes
    together = _frames_per_file(first)
    per_file = together or 1

    def load(path: Path) -> NDArray[Any]:
        values, found = _read_whole(path, first, reader)
        _add_notes(said, found, path.name)
        return values if together else values[None]

    def read(key: Key) -> NDArray[Any]:
        chosen = range(len(paths) * per_file)[key[0]]
        check_samples(str(paths[0]), len(chosen) * first.size // per_file)
        parts: list[NDArray[Any]] = []
        opened, frames = -1, np.empty(0)
        for index in chosen:
            number, frame = divmod(index, per_file)
            if number != opened:
                opened, frames = number, load(paths[number])
            parts.append(frames[frame][key[1:]])
        return np.stack(parts)

    sides = first.shape[1:] if together else first.shape
    dims = (first.dims[1:] if together else first.dims) or ("",) * len(sides)
    stated = {name: value for name, value in first.attributes.items() if name not in PACKING}
    return replace(
        first, shape=(len(paths) * per_file, *sides), read=read, dims=("time", *dims),
        attributes=stated, chunks=(per_file, *sides), notes=said,
    )  # fmt: skip


def _frames_per_file(array: FileArray) -> int:
    """Return the number of frames in each file of a series; 0 if a file is a frame."""
    number, names = len(array.shape), (*OTHER_NAMES["time"], *FRAME_NAMES)
    if array.dims:
        several = simple(array.dims[0]) in names
    elif number == 1:
        several = simple(array.short) in names
    else:
        # MATLAB's images are ordered y, x, time.
        several = number == 3 and not array.path.lower().endswith(".mat")
    return array.shape[0] if several else 0


def _squeezed(array: FileArray) -> FileArray:
    """Return an array of over three axes without axes of length 1, such as a single band."""
    if len(array.shape) <= 3:
        return array
    kept = [number for number, length in enumerate(array.shape) if length > 1]
    if len(kept) not in (2, 3):
        return array

    def read(key: Key) -> NDArray[Any]:
        parts = dict(zip(kept, key, strict=True))
        whole = tuple(parts.get(number, slice(None)) for number in range(len(array.shape)))
        values = array.read(whole)
        return values.reshape([values.shape[number] for number in kept])

    def chosen(values: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(values[number] for number in kept) if values else ()

    return replace(array, shape=chosen(array.shape), read=read, dims=chosen(array.dims),
                   chunks=chosen(array.chunks or ()) or None)  # fmt: skip


def _add_notes(notes: Notes, added: Notes, name: str) -> None:
    """Add notes on a further file that differ from those on the files before."""
    for kind, sentences in vars(added).items():
        known: list[str] = getattr(notes, kind)
        for sentence in sentences:
            if not any(one.endswith(sentence) for one in known) and len(known) <= _MOST_NOTES:
                more = len(known) == _MOST_NOTES
                known.append(_MORE_NOTES if more else f"{name}: {sentence}")


def _read_whole(
    path: Path, first: FileArray, reader: ArrayReader | None
) -> tuple[NDArray[Any], Notes]:
    with ExitStack() as stack:
        array = _open_file(path, stack, reader).get(first.name)
        if array is None or array.shape != first.shape:
            found = "none" if array is None else f"one of shape {array.shape}"
            raise SourceError(
                f"{path}: expected an array {first.name!r} of shape {first.shape}, it has {found}"
            )
        if array.unit != first.unit:
            raise SourceError(
                f"{path}: units of {first.name!r} is {array.unit}, expected {first.unit} as in the "
                "first file of the series"
            )
        return unpack(array.part(), array.attributes), array.notes


# NumPy


def _npy(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    values = np.lib.format.open_memmap(path, mode="r")
    yield from _numpy_arrays("", values.dtype, values.shape, partial(_copy_of_mapped, values))


def _copy_of_mapped(values: NDArray[Any], key: Key) -> NDArray[Any]:
    """Return a part of a file that is mapped into memory, of which no page is kept there."""
    part = np.array(values[key])
    if isinstance(values, np.memmap) and hasattr(mmap, "MADV_DONTNEED"):
        values._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]
    return part


def _npz(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    archive = stack.enter_context(ZipFile(path))
    for info in archive.infolist():
        if not info.filename.endswith(".npy"):
            continue
        with archive.open(info) as stream:
            first = np.lib.format.read_magic(stream) == (1, 0)
            header = np.lib.format
            read_header = header.read_array_header_1_0 if first else header.read_array_header_2_0
            shape, _, dtype = read_header(stream)
        if prod(shape) * dtype.itemsize > info.file_size:
            raise SourceError(
                f"{path}: {info.filename} states shape {shape}, but has {info.file_size} bytes"
            )
        load = partial(_read_member, archive, info.filename)
        read = _from_whole(f"{path}: {info.filename}", prod(shape), load)
        yield from _numpy_arrays(info.filename[:-4], dtype, shape, read)


def _read_member(archive: ZipFile, member: str) -> NDArray[Any]:
    with archive.open(member) as stream:
        return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))


def _from_whole(label: str, count: int, load: Callable[[], NDArray[Any]]) -> Read:
    """Return how to read parts of an array that is loaded as a whole, once."""

    @cache
    def whole() -> NDArray[Any]:
        check_samples(label, count)
        return load()

    return lambda key: np.asarray(whole()[key])


def _numpy_arrays(
    name: str, dtype: np.dtype[Any], shape: tuple[int, ...], read: Read
) -> Iterator[FileArray]:
    """Yield one array, or one for every field of a structured one."""
    if dtype.names is None:
        if dtype.kind in _KINDS:
            yield FileArray(name, shape, read)
        return
    for part in dtype.names:
        if dtype[part].kind in _KINDS and not dtype[part].shape:
            label = f"{name}/{part}" if name else part
            yield FileArray(label, shape, partial(_part, read, part))


def _part(read: Read, name: str, key: Key) -> NDArray[Any]:
    return np.asarray(read(key)[name])


# HDF5, NetCDF-4, MATLAB 7.3


def _hdf5(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    import h5py

    check_hdf5(path)
    file = stack.enter_context(h5py.File(path, "r"))
    names: list[str] = []
    file.visit(names.append)
    for name in names:
        if isinstance(item := file[name], h5py.Dataset):
            settings = item.id.get_create_plist()
            filters = [settings.get_filter(number)[0] for number in range(settings.get_nfilters())]
            if not all(map(h5py.h5z.filter_avail, filters)):
                required("hdf5plugin", path, "grid")
            yield from _hdf5_arrays(name, item)


def _hdf5_arrays(name: str, item: Any) -> Iterator[FileArray]:
    """Yield an array if it is numeric and no part of MATLAB's or NetCDF's bookkeeping."""
    if bytes(item.attrs.get("NAME", b"")).startswith(_NO_COORDINATE):
        return
    if item.dtype.kind not in _KINDS or item.shape is None or "#" in name:
        return
    attributes = {key: _plain(item.attrs[key]) for key in _ATTRIBUTES if key in item.attrs}
    for key in item.attrs:
        if key.lower() in ("unit", "units"):
            attributes.setdefault("units", _plain(item.attrs[key]))
    dims = tuple(_dimension(dimension) for dimension in item.dims)
    dims = dims if all(dims) else ()
    kind = item.attrs.get("MATLAB_class")
    if kind is None:
        read: Read = lambda key: np.asarray(item[key])  # noqa: E731
        yield FileArray(name, item.shape, read, dims, attributes, item.chunks)
    elif "MATLAB_empty" not in item.attrs and bytes(kind) not in (b"cell", b"char", b"struct"):
        # MATLAB's axes run the other way in its files.
        read = lambda key: np.asarray(item[key[::-1]]).T  # noqa: E731
        chunks = None if item.chunks is None else item.chunks[::-1]
        yield FileArray(name, item.shape[::-1], read, dims, attributes, chunks)


def _dimension(dimension: Any) -> str:
    if len(dimension):
        return str(dimension[0].name).rsplit("/", 1)[-1]
    return str(dimension.label)


def _plain(value: Any) -> Any:
    """Return an attribute as text, a number or a list of numbers."""
    values = np.asarray(value).reshape(-1)
    if values.size > 1 and values.dtype.kind in _KINDS:
        return values
    first = values[0] if values.size else ""
    if isinstance(first, bytes):
        return first.decode(errors="replace")
    return str(first) if isinstance(first, str) else first


def _netcdf(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    for array in (_netcdf3 if head_of(path, 3) == b"CDF" else _hdf5)(path, stack):
        yield replace(array, attributes={**array.attributes, "prefilled": True})


def _netcdf3(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    from scipy.io import netcdf_file

    # The mapping outlives the stream; with the stream closed, the library leaves it alone.
    with path.open("rb") as stream:
        file = netcdf_file(stream, mmap=True)
    for name, variable in file.variables.items():
        if variable.data.dtype.kind in _KINDS:
            attributes = {key: _plain(value) for key, value in variable._attributes.items()}
            read = partial(_copy_of_mapped, variable.data)
            yield FileArray(name, variable.data.shape, read, variable.dimensions, attributes)


# MATLAB


_FRAME: Final = re.compile(r"Frame(\d+)")
_DATE: Final = "_DateTime"
"""ResearchIR exports the images Frame1, Frame2, ... and Frame1_DateTime, ..."""


def _matlab(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    import h5py

    read = _hdf5 if h5py.is_hdf5(path) else _matlab_5
    arrays = {array.name: array for array in read(path, stack)}
    images = {
        int(match[1]): array for name, array in arrays.items() if (match := _FRAME.fullmatch(name))
    }
    numbers = sorted(images)
    frames = [images[number] for number in numbers]
    if len(frames) < 2 or len({array.shape for array in frames}) > 1:
        yield from arrays.values()
        return
    dates = [arrays.get(array.name + _DATE) for array in frames]
    used = {array.name for array in (*frames, *dates) if array is not None}
    yield from (array for name, array in arrays.items() if name not in used)
    notes = Notes()
    if None not in dates:
        yield list_array("time", _seconds_since_first(path, [one for one in dates if one]), "s")
    elif np.ptp(np.diff(numbers)):
        notes.warnings.append(
            f"The numbers of the arrays {frames[0].name} to {frames[-1].name} have gaps; they are "
            "taken as evenly spaced."
        )
    shape = (len(frames), *frames[0].shape)
    yield FileArray("Frame", shape, partial(_stack, frames), ("time", "y", "x"), notes=notes)


def _stack(arrays: Sequence[FileArray], key: Key) -> NDArray[Any]:
    return np.stack([array.part(key[1:]) for array in arrays[key[0]]])


def _seconds_since_first(path: Path, dates: Sequence[FileArray]) -> NDArray[np.float64]:
    """Return times in s of lists of year, month, day, hour, minute, second and millisecond."""
    moments = [_moment(path, array) for array in dates]
    return np.array([(moment - moments[0]).total_seconds() for moment in moments])


def _moment(path: Path, array: FileArray) -> datetime:
    numbers = np.asarray(array.part(), np.float64).reshape(-1).tolist()
    try:
        year, month, day, hours, minutes, seconds, milliseconds = numbers
        since = timedelta(hours=hours, minutes=minutes, seconds=seconds, milliseconds=milliseconds)
        return datetime(int(year), int(month), int(day)) + since
    except (TypeError, ValueError, OverflowError):
        raise SourceError(
            f"{path}: {array.name} is {numbers}, expected year, month, day, hour, minute, second "
            "and millisecond"
        ) from None


def _matlab_5(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    from scipy.io import whosmat

    members = whosmat(path)
    kinds = {kind for _, _, kind in members}
    if kinds and kinds <= {"struct", "cell", "object"}:
        raise SourceError(
            f"{path}: has only {', '.join(f'{name} ({kind})' for name, _, kind in members[:5])}, "
            "expected matrices; save the matrix itself, as in T = s.T; save('file.mat', 'T')"
        )
    for name, shape, kind in members:
        numeric = kind.startswith(("double", "single", "int", "uint", "logical"))
        if numeric and not name.startswith("__"):
            sides = tuple(int(length) for length in shape)
            load = partial(_load_matlab, path, name)
            yield FileArray(name, sides, _from_whole(f"{path}: {name}", prod(sides), load))


def _load_matlab(path: Path, name: str) -> NDArray[Any]:
    """Return an array of MATLAB's formats up to 7.2."""
    from scipy.io import loadmat

    values = loadmat(path, variable_names=[name])[name]
    if not isinstance(values, np.ndarray) or values.dtype.kind not in _KINDS:
        raise SourceError(f"{path}: {name} is sparse or {values.dtype}, expected numbers")
    return values


# TIFF, PNG


# Zarr


def _zarr(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    zarr = required("zarr", path, "grid")
    if not path.is_dir():
        raise SourceError(f"{path}: is a file, expected the folder of a Zarr store")
    store = zarr.storage.LocalStore(path, read_only=True)
    try:
        # Consolidated metadata may differ from those of the arrays, which are checked here.
        root = zarr.open(store, mode="r", use_consolidated=False)
    except FileNotFoundError:
        raise SourceError(f"{path}: there is no Zarr array or group in it") from None
    members = [("", root)] if isinstance(root, zarr.Array) else root.members(max_depth=None)
    arrays = {name: item for name, item in members if isinstance(item, zarr.Array)}
    for name, item in arrays.items():
        unknown = sorted(set(_codecs(item.metadata.to_dict())) - set(_CODECS))
        if unknown:  # one of Zarr's codecs unpickles, and so would run what is in the file
            raise SourceError(f"{path}: {name} is packed by {unknown[0]!r}, which is not allowed")
    for name, item in arrays.items():
        if item.dtype.kind in _KINDS:
            yield _zarr_array(store, name, item)


def _zarr_array(store: Any, name: str, array: Any) -> FileArray:
    """Return an array; if its axes have names, xarray or a program like it wrote it.

    xarray knows where either version of Zarr keeps the fill value, and in which encoding.
    """
    dims = getattr(array.metadata, "dimension_names", None) or array.attrs.get("_ARRAY_DIMENSIONS")
    read: Read = lambda key: np.asarray(array[key])  # noqa: E731
    attributes = dict(array.attrs)
    if dims and name:
        from xarray.backends import ZarrStore

        group, _, short = name.rpartition("/")
        opened = ZarrStore.open_group(store, mode="r", group=group or None, consolidated=False)
        variable = opened.open_store_variable(short)
        read = lambda key: np.asarray(variable[key].values)  # noqa: E731
        attributes = dict(variable.attrs)
    names = tuple(map(str, dims or ()))
    return FileArray(name, tuple(array.shape), read, names, attributes, array.chunks)


def _codecs(metadata: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of all codecs in an array's metadata, those within others too."""
    lists = ("filters", "codecs", "index_codecs", "storage_transformers")
    codecs = [codec for name in lists for codec in metadata.get(name) or ()]
    for codec in (*codecs, metadata.get("compressor")):
        if codec is not None:
            # Up to Zarr 3.0 codecs of its second format are objects here.
            codec = codec if isinstance(codec, Mapping) else codec.get_config()
            yield str(codec.get("id") or codec.get("name"))
            yield from _codecs(codec.get("configuration") or {})


# Text


def _text(path: Path, stack: ExitStack) -> Iterator[FileArray]:
    with table_errors():
        matrix = read_matrix(path)
    values = matrix.values.astype(np.float32)
    values = values if len(values) > 1 else values[0]
    yield FileArray("", values.shape, lambda key: values[key], notes=matrix.notes)


ARRAY_READERS: Final[Mapping[str, ArrayReader]] = {
    ".npy": _npy,
    ".npz": _npz,
    **dict.fromkeys((".h5", ".hdf5", ".hdf", ".he5"), _hdf5),
    **dict.fromkeys((".nc", ".nc4", ".cdf"), _netcdf),
    ".mat": _matlab,
    **dict.fromkeys((".tif", ".tiff"), tiff_arrays),
    ".png": png_arrays,
    ".zarr": _zarr,
    **dict.fromkeys((".csv", ".txt", ".dat"), _text),
}
"""Readers of arrays by the ending of the file's name."""
