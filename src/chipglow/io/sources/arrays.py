"""Arrays in files of many formats behind one face: they are described first and read in parts."""

import logging
import mmap
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from math import prod
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.file_order import files_of
from chipglow.io.sources.source import SourceError, check_hdf5, reading, required
from chipglow.io.sources.text_table import TextTable, lines_of_text

MOST_SAMPLES: Final = 100_000_000
"""Most samples that are read at once."""

MOST_ON_A_SIDE: Final = 1_000_000
"""Most samples along an axis other than time."""

_MOST_ARRAYS: Final = 10_000
_KINDS: Final = "fiub"
_MATLAB_HEAD: Final = 128
_UNPACKED_BY_TIFFFILE: Final = (1, 8, 32946)
"""None, and two names of deflate: the other compressions need libtiff, which Pillow has."""
_NO_COORDINATE: Final = b"This is a netCDF dimension but not a netCDF variable"
_CODECS: Final = (
    "blosc", "bz2", "bytes", "crc32c", "delta", "fixedscaleoffset", "gzip", "lz4", "lzma",
    "packbits", "quantize", "sharding_indexed", "shuffle", "transpose", "zlib", "zstd",
)  # fmt: skip

Key = tuple[slice, ...]


@dataclass(frozen=True)
class StoredArray:
    """A numeric array in a file.

    Parameters
    ----------
    name : str
        Its name; empty where the format has none.
    shape : tuple of int
        Its lengths.
    read : callable
        Gives the part that a slice for every axis says.
    dims : tuple of str
        Names of its axes, if the file says them.
    attributes : mapping
        What else the file says of it: ``units``, ``scale_factor``, ``_FillValue``...
    chunks : tuple of int, optional
        Shape of the parts that the file keeps together.
    """

    name: str
    shape: tuple[int, ...]
    read: Callable[[Key], NDArray[Any]]
    dims: tuple[str, ...] = ()
    attributes: Mapping[str, Any] = field(default_factory=dict)
    chunks: tuple[int, ...] | None = None


ArrayReader: TypeAlias = Callable[[Path, ExitStack], Iterator[StoredArray]]
"""Opens a file, which the stack closes, and gives its arrays."""


def check_samples(name: str, count: int) -> None:
    """Refuse to read more at once than `MOST_SAMPLES`.

    Raises
    ------
    SourceError
        If there are more.
    """
    if count > MOST_SAMPLES:
        raise SourceError(f"{name}: {count:.3g} samples at once, expected up to {MOST_SAMPLES:.3g}")


def open_arrays(
    pattern: str, stack: ExitStack, reader: ArrayReader | None = None
) -> dict[str, StoredArray]:
    """Arrays of a file by their names, or of several files, one a frame.

    Parameters
    ----------
    pattern : str
        Path of a file, or a pattern with ``*``: each file is then a frame, and the arrays get a
        first axis ``time``.
    stack : ExitStack
        Closes the files.
    reader : callable, optional
        Reader of such files; by the ending of the name by default.

    Raises
    ------
    SourceError
        If a file cannot be read, or none has arrays of numbers.
    OSError
        If it is missing or not accessible.
    """
    paths = files_of(pattern)
    several = len(paths) > 1 or paths[0] != Path(pattern)
    first = _open_file(paths[0], stack, reader)
    if not first:
        raise SourceError(f"{paths[0]}: there is no array of numbers in it")
    if len(first) > _MOST_ARRAYS:
        raise SourceError(f"{paths[0]}: {len(first)} arrays, expected up to {_MOST_ARRAYS}")
    if several:
        first = {name: _series(paths, name, array, reader) for name, array in first.items()}
    return {name or _stem(pattern): array for name, array in first.items()}


def _stem(pattern: str) -> str:
    """What a file is called without number: the name of its only array."""
    return re.sub(r"[\W\d_]+$", "", Path(pattern).stem) or "values"


def _open_file(
    path: Path, stack: ExitStack, reader: ArrayReader | None = None
) -> dict[str, StoredArray]:
    suffix = path.suffix.lower()
    reader = reader or ARRAY_READERS.get(suffix)
    if reader is None:
        raise SourceError(
            f"{path}: unknown ending {suffix!r}, expected one of {', '.join(sorted(ARRAY_READERS))}"
        )
    if path.is_file() and path.stat().st_size == 0:
        raise SourceError(f"{path}: is empty")
    with reading(path):
        return {array.name: array for array in reader(path, stack)}


def _series(
    paths: Sequence[Path], name: str, first: StoredArray, reader: ArrayReader | None
) -> StoredArray:
    def read(key: Key) -> NDArray[Any]:
        chosen = paths[key[0]]
        check_samples(str(chosen[0]), len(chosen) * prod(first.shape))
        whole = [_read_whole(path, name, first.shape, reader) for path in chosen]
        return np.stack([values[key[1:]] for values in whole])

    dims = ("time", *first.dims) if first.dims else ()
    return replace(
        first, shape=(len(paths), *first.shape), read=read, dims=dims, chunks=(1, *first.shape)
    )


def _read_whole(
    path: Path, name: str, shape: tuple[int, ...], reader: ArrayReader | None
) -> NDArray[Any]:
    with ExitStack() as stack:
        array = _open_file(path, stack, reader).get(name)
        if array is None or array.shape != shape:
            found = "none" if array is None else f"one of shape {array.shape}"
            raise SourceError(
                f"{path}: expected an array {name!r} of shape {shape}, it has {found}"
            )
        with reading(path):
            return array.read((slice(None),) * len(shape))


# NumPy


def _npy(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    values = np.lib.format.open_memmap(path, mode="r")
    yield from _numpy_arrays("", values.dtype, values.shape, partial(_copy_of_mapped, values))


def _copy_of_mapped(values: NDArray[Any], key: Key) -> NDArray[Any]:
    """A part of a file that is mapped into memory, of which no page is kept there."""
    part = np.array(values[key])
    if isinstance(values, np.memmap) and hasattr(mmap, "MADV_DONTNEED"):
        mapping: Any = values._mmap  # type: ignore[attr-defined]
        mapping.madvise(mmap.MADV_DONTNEED)
    return part


def _npz(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    archive = stack.enter_context(ZipFile(path))
    for info in archive.infolist():
        if not info.filename.endswith(".npy"):
            continue
        with archive.open(info) as stream:
            shape, fortran, dtype = _npy_header(stream)
            start = stream.tell()
        if prod(shape) * dtype.itemsize + start != info.file_size:
            raise SourceError(
                f"{path}: {info.filename} says shape {shape}, but has {info.file_size} bytes"
            )
        member = _Member(archive, info.filename, start, shape, fortran, dtype, stack)
        yield from _numpy_arrays(info.filename[:-4], dtype, shape, member.read)


def _npy_header(stream: Any) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    version = np.lib.format.read_magic(stream)
    reader = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in reader:
        raise ValueError(f"version {version} of the format is not known")
    shape, fortran, dtype = reader[version](stream)
    if dtype.hasobject:
        raise ValueError("it holds Python objects, expected numbers")
    return shape, fortran, dtype


class _Member:
    """An array in a ZIP archive, unpacked as it is read: forward costs nothing twice."""

    def __init__(
        self,
        archive: Any,
        name: str,
        start: int,
        shape: tuple[int, ...],
        fortran: bool,
        dtype: np.dtype[Any],
        stack: ExitStack,
    ) -> None:
        self._open = partial(archive.open, name)
        self._start, self._dtype, self._stack = start, dtype, stack
        self._name, self._fortran = f"{archive.filename}: {name}", fortran
        self._shape = shape
        self._stream: Any = None

    def read(self, key: Key) -> NDArray[Any]:
        if not self._shape:
            return self._items(0, 1).reshape(())
        # The axis that lies outermost in the file can be read in parts.
        stored = self._shape[::-1] if self._fortran else self._shape
        part = key[::-1] if self._fortran else key
        first, last, _ = part[0].indices(stored[0])
        row = prod(stored[1:])
        check_samples(self._name, (last - first) * row)
        values = self._items(first * row, (last - first) * row).reshape(last - first, *stored[1:])
        values = values[(slice(None), *part[1:])]
        return values.T if self._fortran else values

    def _items(self, first: int, count: int) -> NDArray[Any]:
        if self._stream is None:
            self._stream = self._stack.enter_context(self._open())
        size = self._dtype.itemsize
        self._stream.seek(self._start + first * size)
        return np.frombuffer(self._stream.read(count * size), self._dtype, count)


def _numpy_arrays(
    name: str, dtype: np.dtype[Any], shape: tuple[int, ...], read: Callable[[Key], NDArray[Any]]
) -> Iterator[StoredArray]:
    """One array, or one for every field of a structured one."""
    if dtype.names is None:
        if dtype.kind in _KINDS:
            yield StoredArray(name, shape, read)
        return
    for part in dtype.names:
        if dtype[part].kind in _KINDS and not dtype[part].shape:
            label = f"{name}/{part}" if name else part
            yield StoredArray(label, shape, partial(_part, read, part))


def _part(read: Callable[[Key], NDArray[Any]], name: str, key: Key) -> NDArray[Any]:
    return np.asarray(read(key)[name])


# HDF5, NetCDF-4, MATLAB 7.3


def _hdf5(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    import h5py

    check_hdf5(path)
    file = stack.enter_context(h5py.File(path, "r"))
    found: list[StoredArray] = []

    def visit(name: str, item: Any) -> bool | None:
        if isinstance(item, h5py.Dataset):
            if not all(map(h5py.h5z.filter_avail, _hdf5_filters(item))):
                required("hdf5plugin", path, "grid")
            array = _hdf5_array(name, item)
            if array is not None:
                found.append(array)
        return True if len(found) > _MOST_ARRAYS else None

    file.visititems(visit)
    yield from found


def _hdf5_filters(item: Any) -> list[int]:
    settings = item.id.get_create_plist()
    return [settings.get_filter(number)[0] for number in range(settings.get_nfilters())]


def _hdf5_array(name: str, item: Any) -> StoredArray | None:
    kind = item.attrs.get("MATLAB_class")
    if bytes(item.attrs.get("NAME", b"")).startswith(_NO_COORDINATE):
        return None
    if item.dtype.kind not in _KINDS or item.shape is None or "#" in name:
        return None
    attributes = {
        key: _plain(item.attrs[key])
        for key in ("units", "scale_factor", "add_offset", "_FillValue", "missing_value")
        if key in item.attrs
    }
    dims = tuple(_dimension(dimension) for dimension in item.dims)
    array = StoredArray(
        name,
        item.shape,
        lambda key: np.asarray(item[key]),
        dims if all(dims) else (),
        attributes,
        item.chunks,
    )
    if kind is None:
        return array
    if "MATLAB_empty" in item.attrs or bytes(kind) in (b"cell", b"char", b"struct"):
        return None
    return replace(  # MATLAB's axes run the other way in its files
        array,
        shape=item.shape[::-1],
        read=lambda key: np.asarray(item[key[::-1]]).T,
        chunks=None if item.chunks is None else item.chunks[::-1],
    )


def _dimension(dimension: Any) -> str:
    if len(dimension):
        return str(dimension[0].name).rsplit("/", 1)[-1]
    return str(dimension.label)


def _plain(value: Any) -> Any:
    """An attribute as text or a number."""
    value = np.asarray(value).reshape(-1)[0] if np.size(value) else ""
    if isinstance(value, bytes):
        return value.decode(errors="replace")
    return str(value) if isinstance(value, str) else value


def _netcdf(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    with path.open("rb") as stream:
        classic = stream.read(3) == b"CDF"
    yield from (_netcdf3 if classic else _hdf5)(path, stack)


def _netcdf3(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    from scipy.io import netcdf_file

    # The mapping outlives the stream; with the stream closed, the library leaves it alone.
    with path.open("rb") as stream:
        file = netcdf_file(stream, mmap=True)
    for name, variable in file.variables.items():
        if variable.data.dtype.kind in _KINDS:
            attributes = {key: _plain(value) for key, value in variable._attributes.items()}
            read = partial(_copy, variable.data)
            yield StoredArray(name, variable.data.shape, read, variable.dimensions, attributes)


def _copy(values: NDArray[Any], key: Key) -> NDArray[Any]:
    return np.array(values[key])


# MATLAB


def _matlab(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    import h5py

    if h5py.is_hdf5(path):
        yield from _hdf5(path, stack)
        return
    from scipy.io import whosmat

    _check_matlab_length(path)
    for name, shape, kind in whosmat(path):
        if name.startswith("__"):
            continue
        if kind.startswith(("double", "single", "int", "uint", "logical")):
            whole = _MatlabArray(path, name)
            yield StoredArray(name, tuple(int(n) for n in shape), whole.read)


def _check_matlab_length(path: Path) -> None:
    """Refuse a file that ends before its last element does; formats 5 to 7.2."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(_MATLAB_HEAD)
        if not head.startswith(b"MATLAB"):  # format 4, or something else
            return
        order: Literal["little", "big"] = "little" if head[-2:] == b"IM" else "big"
        end = _MATLAB_HEAD
        while end + 8 <= size:
            stream.seek(end + 4)
            end += 8 + int.from_bytes(stream.read(4), order)
    if end > size:
        raise SourceError(f"{path}: is cut short, it should have {end} bytes and has {size}")


class _MatlabArray:
    """An array of MATLAB's formats up to 7.2, which cannot be read in parts."""

    def __init__(self, path: Path, name: str) -> None:
        self._path, self._name = path, name
        self._values: NDArray[Any] | None = None

    def read(self, key: Key) -> NDArray[Any]:
        if self._values is None:
            from scipy.io import loadmat, whosmat

            shape = next(shape for name, shape, _ in whosmat(self._path) if name == self._name)
            check_samples(f"{self._path}: {self._name}", prod(int(n) for n in shape))
            values = loadmat(self._path, variable_names=[self._name])[self._name]
            if not isinstance(values, np.ndarray) or values.dtype.kind not in _KINDS:
                raise SourceError(
                    f"{self._path}: {self._name} is sparse or {values.dtype}, expected numbers"
                )
            self._values = values
        return np.asarray(self._values[key])


# TIFF


def _tiff(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    tifffile = required("tifffile", path, "grid")
    with _complaints("tifffile") as complaints:
        file = stack.enter_context(tifffile.TiffFile(path))
        every = list(file.series)
    if complaints:
        raise SourceError(f"{path}: is damaged or cut short: {complaints[0]}")
    for number, series in enumerate(every):
        if series.dtype.kind not in _KINDS:
            continue
        if "S" in series.axes:
            raise SourceError(f"{path}: has colours, expected one number a sample")
        name = "" if number == 0 else f"series_{number + 1}"
        read = _tiff_reader(path, series)
        dims = tuple({"Y": "y", "X": "x"}.get(axis, "time") for axis in series.axes)
        yield StoredArray(name, tuple(series.shape), read, dims)


@contextmanager
def _complaints(name: str) -> Iterator[list[str]]:
    """What a library logs as an error, where it goes on with what is left of a file."""
    said: list[str] = []
    handler = logging.Handler(logging.ERROR)
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger(name)
    logger.addHandler(handler)
    try:
        yield said
    finally:
        logger.removeHandler(handler)


def _tiff_reader(path: Path, series: Any) -> Callable[[Key], NDArray[Any]]:
    if series.dataoffset is not None:
        dtype = np.dtype(series.parent.byteorder + series.dtype.char)
        end = series.dataoffset + prod(series.shape) * dtype.itemsize
        if end > path.stat().st_size:
            raise SourceError(
                f"{path}: is cut short, it should have {end} bytes and has {path.stat().st_size}"
            )
        values = np.memmap(path, dtype, "r", series.dataoffset, tuple(series.shape))
        return partial(_copy_of_mapped, values)
    for page in series.pages:
        _check_page(path, page)
    return partial(_tiff_pages, path, series)


def _check_page(path: Path, page: Any) -> None:
    if page is None:
        raise SourceError(f"{path}: a picture is missing in it")
    ends = [a + n for a, n in zip(page.dataoffsets, page.databytecounts, strict=True)]
    if max(ends, default=0) > path.stat().st_size:
        raise SourceError(f"{path}: is cut short, a picture ends at byte {max(ends)}")


def _tiff_pages(path: Path, series: Any, key: Key) -> NDArray[Any]:
    pages = list(series.pages)[key[0]] if len(series.shape) > 2 else list(series.pages)
    check_samples(str(path), len(pages) * prod(series.shape[-2:]))
    stacked = np.stack([_tiff_page(path, page) for page in pages])
    part = stacked[(slice(None), *key[-2:])]
    return np.asarray(part[0] if len(series.shape) == 2 else part)


def _tiff_page(path: Path, page: Any) -> NDArray[Any]:
    if page.compression in _UNPACKED_BY_TIFFFILE and page.keyframe.predictor == 1:
        return np.asarray(page.asarray(maxworkers=1))
    from PIL import Image

    with Image.open(path) as picture:
        picture.seek(page.index)
        values = np.asarray(picture)
    if values.shape != page.shape:
        raise SourceError(
            f"{path}: picture {page.index} cannot be unpacked, expected no LZW or JPEG"
        )
    return values


# Zarr


def _zarr(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    zarr = required("zarr", path, "grid")
    if path.is_dir():
        store = zarr.storage.LocalStore(path, read_only=True)
    else:
        with ZipFile(path):  # Zarr's own opening leaves a half-open store behind
            store = stack.enter_context(zarr.storage.ZipStore(path, mode="r"))
    try:
        root = zarr.open(store, mode="r")
    except FileNotFoundError:
        raise SourceError(f"{path}: there is no Zarr array or group in it") from None
    if isinstance(root, zarr.Array):
        yield from _zarr_array("", root, path)
        return
    for name, item in root.members(max_depth=None):
        if isinstance(item, zarr.Array):
            yield from _zarr_array(name, item, path)


def _zarr_array(name: str, array: Any, path: Path) -> Iterator[StoredArray]:
    unknown = sorted(set(_codecs(array.metadata.to_dict())) - set(_CODECS))
    if unknown:  # one of Zarr's codecs unpickles, and so would run what is in the file
        raise SourceError(f"{path}: {name} is packed by {unknown[0]!r}, which is not allowed")
    if array.dtype.kind not in _KINDS:
        return
    attributes = dict(array.attrs)
    dims = getattr(array.metadata, "dimension_names", None) or attributes.get("_ARRAY_DIMENSIONS")
    yield StoredArray(
        name,
        tuple(array.shape),
        lambda key: np.asarray(array[key]),
        tuple(str(dim) for dim in dims or ()),
        attributes,
        array.chunks,
    )


def _codecs(metadata: Mapping[str, Any]) -> Iterator[str]:
    """Names of all codecs in an array's metadata, those within others too."""
    lists = ("filters", "codecs", "index_codecs", "storage_transformers")
    codecs = [codec for name in lists for codec in metadata.get(name) or ()]
    for codec in (*codecs, metadata.get("compressor")):
        if codec is not None:
            # Up to Zarr 3.0 codecs of its second format are objects here.
            codec = codec if isinstance(codec, Mapping) else codec.get_config()
            yield str(codec.get("id") or codec.get("name"))
            yield from _codecs(codec.get("configuration") or {})


# CSV


def _csv(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    values = _csv_matrix(path)
    yield StoredArray("", values.shape, lambda key: values[key])


def exported_table(path: Path, stack: ExitStack) -> Iterator[StoredArray]:
    """A matrix behind lines of text, as cameras' programs export it; an `ArrayReader`."""
    skipped = lines_of_text(path)
    values = _csv_matrix(path, skipped)
    attributes = {"lines_of_text": skipped}
    yield StoredArray("", values.shape, lambda key: values[key], attributes=attributes)


def _csv_matrix(path: Path, skipped: int = 0) -> NDArray[np.float32]:
    import pandas as pd

    table = TextTable.look_at(path, skipped)
    with path.open(encoding="utf-8-sig") as stream:
        values = pd.read_csv(stream, header=None, skiprows=skipped, **table.options)
    for column, kind in enumerate(values.dtypes):
        if kind.kind not in _KINDS:
            raise SourceError(
                f"{path}, column {column + 1}: has text in it, expected numbers; "
                "a table of points needs kind: points"
            )
    return np.asarray(values.to_numpy(np.float32))


ARRAY_READERS: Final[Mapping[str, ArrayReader]] = {
    ".npy": _npy,
    ".npz": _npz,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".hdf": _hdf5,
    ".he5": _hdf5,
    ".nc": _netcdf,
    ".nc4": _netcdf,
    ".cdf": _netcdf,
    ".mat": _matlab,
    ".tif": _tiff,
    ".tiff": _tiff,
    ".zarr": _zarr,
    ".zip": _zarr,
    ".csv": _csv,
    ".txt": _csv,
    ".dat": _csv,
}
"""Readers of arrays by the ending of the file's name."""
