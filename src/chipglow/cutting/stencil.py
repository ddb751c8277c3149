"""Sums over the three by three nodes around a point, and adding to them.

The values of a node lie side by side, and the processor can work on all of them with one
instruction. Compilers do not find that in nested loops over nodes, so these two loops are written
in the compiler's own language (LLVM's vectors, which it makes fit any processor).
"""

from typing import Any, Final

from llvmlite import ir
from numba import types
from numba.core.errors import TypingError
from numba.extending import intrinsic

SUMMED: Final = 4
"""Values of a node that `sum_nodes` sums."""

ADDED: Final = 8
"""Values of a node that `add_to_nodes` adds to."""

_DOUBLE: Final = ir.DoubleType()
_LANE: Final = ir.IntType(32)
"""Index of a lane of a vector: LLVM takes 32 bits."""
_NODES: Final = types.float64[:, :, ::1]
_THREE: Final = types.UniTuple(types.float64, 3)
_AROUND: Final = (_NODES, types.int64, types.int64, _THREE, _THREE, _THREE, _THREE)
_FUSE: Final = ("contract",)

_ALIGNMENT: Final = 8
"""Bytes to which a node's values are aligned: those of a double."""


class _Vectors:
    """Writes arithmetic on vectors of doubles."""

    def __init__(self, builder: Any, length: int) -> None:
        self.builder = builder
        self.length = length
        self.type = ir.VectorType(_DOUBLE, length)
        self.zero = ir.Constant(self.type, [0.0] * length)

    def of(self, values: list[Any]) -> Any:
        """Return a vector of some values; the rest is zero."""
        vector = self.zero
        for lane, value in enumerate(values):
            vector = self.builder.insert_element(vector, value, _LANE(lane))
        return vector

    def repeated(self, value: Any) -> Any:
        """Return a vector of one value."""
        first = self.builder.insert_element(self.zero, value, _LANE(0))
        lanes = ir.Constant(ir.VectorType(_LANE, self.length), [0] * self.length)
        return self.builder.shuffle_vector(first, first, lanes)

    def product(self, a: Any, b: Any) -> Any:
        return self.builder.fmul(a, b, flags=_FUSE)

    def add_product(self, c: Any, a: Any, b: Any) -> Any:
        """Return c + a b."""
        return self.builder.fadd(c, self.product(a, b), flags=_FUSE)

    def nodes(self, array: Any, i: Any, j: Any) -> list[list[Any]]:
        """Return the addresses of the nodes (i + a, j + b), [a][b]."""
        rows = self.builder.extract_value(array.shape, 1)
        first = self.builder.add(self.builder.mul(i, rows), j)
        columns = [first, self.builder.add(first, rows)]
        columns.append(self.builder.add(columns[1], rows))
        return [[self._node(array, column, b) for b in range(3)] for column in columns]

    def _node(self, array: Any, column: Any, b: int) -> Any:
        number = self.builder.add(column, column.type(b))
        offset = self.builder.mul(number, column.type(self.length))
        place = self.builder.gep(array.data, [offset])
        return self.builder.bitcast(place, self.type.as_pointer())


def _check(nodes: Any) -> None:
    if nodes != _NODES:
        raise TypingError(f"nodes: expected {_NODES}, got {nodes}")


def _parts(builder: Any, values: Any, count: int) -> list[Any]:
    return [builder.extract_value(values, k) for k in range(count)]


@intrinsic
def sum_nodes(_context, nodes, i, j, wx, wy, dx, dy):  # type: ignore[no-untyped-def]
    """Return weighted sums of the values of nodes, and of their products with x and y.

    Arguments are `nodes` (columns, rows, `SUMMED`), the first column i and row j, and for the three
    columns and the three rows their weights wx, wy and their distances dx, dy from the point.
    Returns Σ w v, Σ w dx v and Σ w dy v with w = wx wy, each a tuple of `SUMMED`. That the
    nodes exist is not checked.
    """
    _check(nodes)
    sums = types.UniTuple(types.UniTuple(types.float64, SUMMED), 3)

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vectors = _Vectors(builder, SUMMED)
        array = context.make_array(_NODES)(context, builder, arguments[0])
        places = vectors.nodes(array, arguments[1], arguments[2])
        wx, wy, dx, dy = (_parts(builder, values, 3) for values in arguments[3:])
        weights = [vectors.repeated(w) for w in wy]
        slopes = [vectors.repeated(vectors.product(w, d)) for w, d in zip(wy, dy, strict=True)]
        total, by_x, by_y = vectors.zero, vectors.zero, vectors.zero
        for a in range(3):
            column, column_by_y = vectors.zero, vectors.zero
            for b in range(3):
                value = builder.load(places[a][b], align=_ALIGNMENT)
                column = vectors.add_product(column, weights[b], value)
                column_by_y = vectors.add_product(column_by_y, slopes[b], value)
            weight, slope = wx[a], vectors.product(wx[a], dx[a])
            total = vectors.add_product(total, vectors.repeated(weight), column)
            by_x = vectors.add_product(by_x, vectors.repeated(slope), column)
            by_y = vectors.add_product(by_y, vectors.repeated(weight), column_by_y)
        each = []
        for one in (total, by_x, by_y):
            values = [builder.extract_element(one, _LANE(lane)) for lane in range(SUMMED)]
            each.append(context.make_tuple(builder, sums.dtype, values))
        return context.make_tuple(builder, sums, each)

    return sums(*_AROUND), write


@intrinsic
def add_to_nodes(_context, nodes, i, j, wx, wy, dx, dy, level, by_x, by_y):  # type: ignore[no-untyped-def]
    """Add w (level + dx by_x + dy by_y) to the values of nodes; for kernels only.

    Arguments as for `sum_nodes`, with `nodes` (columns, rows, `ADDED`); `level`, `by_x` and `by_y`
    are tuples of up to `ADDED` for the first values of a node, which get zero beyond.
    """
    _check(nodes)

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vectors = _Vectors(builder, ADDED)
        array = context.make_array(_NODES)(context, builder, arguments[0])
        places = vectors.nodes(array, arguments[1], arguments[2])
        wx, wy, dx, dy = (_parts(builder, values, 3) for values in arguments[3:7])
        level, by_x, by_y = (
            vectors.of(_parts(builder, values, kind.count))
            for values, kind in zip(arguments[7:], signature.args[7:], strict=True)
        )
        weights = [vectors.repeated(w) for w in wy]
        slopes = [vectors.repeated(vectors.product(w, d)) for w, d in zip(wy, dy, strict=True)]
        for a in range(3):
            weight = vectors.repeated(wx[a])
            column = vectors.add_product(level, vectors.repeated(dx[a]), by_x)
            column, column_by_y = vectors.product(weight, column), vectors.product(weight, by_y)
            for b in range(3):
                value = builder.load(places[a][b], align=_ALIGNMENT)
                value = vectors.add_product(value, weights[b], column)
                value = vectors.add_product(value, slopes[b], column_by_y)
                builder.store(value, places[a][b], align=_ALIGNMENT)
        return context.get_dummy_value()

    return types.void(*_AROUND, level, by_x, by_y), write
