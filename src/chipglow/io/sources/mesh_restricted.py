"""Fields that a mesh has in some of its blocks only, such as the temperatures of two materials."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import COMMON_NAMES, match_names, simple
from chipglow.io.sources.mesh_block import Block, fields_of, offsets_of

Names: TypeAlias = tuple[str, ...]

_TEMPERATURE: Final = "temperature"
_RESTRICTED: Final = (_TEMPERATURE, "plastic_strain", "plastic_strain_rate")
NODE_NUMBER: Final = "GlobalNodeId"
"""What VTK calls the numbers that nodes have in a whole file of Exodus."""

_BETWEEN: Final = ", "
_BLANK: Final = 0.5
"""Fraction of a block's elements from which on blank ones mean that it does not have the field."""


@dataclass(frozen=True)
class RestrictedFields:
    """Which field of a file is whose, where blocks have fields of their own.

    A file of Exodus has every field of nodes at every node: where a block does not have it, it is
    0. At some of the nodes that blocks share, MOOSE writes the sum over the elements that have the
    field, divided by the number of all elements there: this is undone.

    Parameters
    ----------
    names : mapping
        What fields that were put together are called, by the names of a scene.
    own : mapping
        The file's field of each block, by the names of a scene; None where a block has none.
    """

    names: Mapping[str, str]
    own: Mapping[str, Mapping[Names, str | None]]

    @classmethod
    def of(cls, frames: Sequence[Sequence[Block]], given: Mapping[str, str]) -> "RestrictedFields":
        """Look for them in the first and the last frame.

        Parameters
        ----------
        frames : sequence of sequence of Block
            Meshes of these frames.
        given : mapping
            The file's names of fields that the user gave, by those of a scene.
        """
        scalars = [name for name, size in fields_of(frames[0]).items() if size == 1]
        own: dict[str, Mapping[Names, str | None]] = {}
        for ours in _RESTRICTED if len(frames[0]) > 1 else ():
            plain = given.get(ours) or match_names(scalars, {}, (ours,)).get(ours)
            chosen = (
                _put_together(ours, frames, scalars)
                if plain is None
                else _of_some(ours, frames, plain)
            )
            if chosen:
                own[ours] = {block.names: chosen.get(block.names) for block in frames[0]}
        names = {
            ours: _BETWEEN.join(dict.fromkeys(name for name in chosen.values() if name))
            for ours, chosen in own.items()
        }
        return cls(names, own)

    def of_blocks(self, blocks: Sequence[Block]) -> tuple[Block, ...]:
        """Blocks with the fields that they have, under the names of those put together."""
        factors = {ours: _factors(blocks, own) for ours, own in self.own.items()}
        return tuple(
            self._of_block(block, {ours: of[number] for ours, of in factors.items()})
            for number, block in enumerate(blocks)
        )

    def _of_block(self, block: Block, factors: Mapping[str, Any]) -> Block:
        grid = block.grid.copy(deep=False)
        if NODE_NUMBER in grid.point_data:
            del grid.point_data[NODE_NUMBER]
        for ours, label in self.names.items():
            own = self.own[ours].get(block.names, label)
            for data in (grid.point_data, grid.cell_data):
                there = {name: data[name] for name in label.split(_BETWEEN) if name in data}
                for name in there:
                    del data[name]
                if own in there:
                    of_nodes = data.association is grid.point_data.association
                    data[label] = there[own] * (factors[ours] if of_nodes else 1.0)
        return replace(block, grid=grid)


def _of_some(ours: str, frames: Sequence[Sequence[Block]], name: str) -> dict[Names, str]:
    """The blocks that have a field, if there are others; strains may well be 0 in a whole block."""
    having = [block for block in frames[0] if _has(frames, block, name)]
    if ours != _TEMPERATURE or len(having) == len(frames[0]):
        return {}
    return {block.names: name for block in having}


def _put_together(
    ours: str, frames: Sequence[Sequence[Block]], names: Sequence[str]
) -> dict[Names, str]:
    """The field of each block, if two blocks or more have one of their own."""
    for stem in COMMON_NAMES[ours]:
        fields = {simple(name): name for name in names if simple(name).startswith(f"{stem}_")}
        chosen: dict[Names, str] = {}
        for block in frames[0]:
            called = [fields.get(f"{stem}_{simple(name)}") for name in block.names]
            fitting = [name for name in called if name]
            if not fitting and ours == _TEMPERATURE:
                fitting = [name for name in fields.values() if _has(frames, block, name)]
                if len(fitting) > 1:
                    chosen.clear()
                    break
            if fitting:
                chosen[block.names] = fitting[0]
        if len(set(chosen.values())) > 1:
            return chosen
    return {}


def _has(frames: Sequence[Sequence[Block]], block: Block, name: str) -> bool:
    """Whether a block has a field in the first or the last frame."""
    same = [other for frame in frames for other in frame if other.names == block.names]
    return any(blank <= _BLANK for other in same for blank in _blank(other.grid, name))


def _blank(grid: Any, name: str) -> Iterator[float]:
    """Fraction of the elements that have a value of 0 or none: of their own, of their nodes."""
    if not grid.n_cells:
        return
    if name in grid.cell_data:
        yield float(_nothing(grid.cell_data[name]).mean())
    if name in grid.point_data:
        nodes = _nothing(grid.point_data[name])[np.asarray(grid.cell_connectivity)]
        before = np.append(0, np.cumsum(nodes))[offsets_of(grid)]
        yield float((np.diff(before) > 0).mean())


def _nothing(values: Any) -> NDArray[np.bool_]:
    numbers = np.asarray(values, np.float64)
    return np.asarray(~np.isfinite(numbers) | (numbers == 0.0))


def _factors(blocks: Sequence[Block], own: Mapping[Names, str | None]) -> Sequence[Any]:
    """By what the nodes' values of each block are to be multiplied.

    At a node that blocks share it is the number of all elements there over those of the block, if
    the values of all blocks there then are nearer to those beside them; else 1.
    """
    having = [own.get(block.names) in block.grid.point_data for block in blocks]
    if not any(having) or not all(NODE_NUMBER in block.grid.point_data for block in blocks):
        return [1.0] * len(blocks)
    numbers = [np.asarray(block.grid.point_data[NODE_NUMBER]) for block in blocks]
    place = np.split(
        np.unique(np.concatenate(numbers), return_inverse=True)[1],
        np.cumsum([len(of) for of in numbers])[:-1],
    )
    counts = [_elements_at(block.grid) for block in blocks]
    together = np.bincount(np.concatenate(place), np.concatenate(counts))
    apart = np.zeros((2, len(together)))
    factors = []
    for block, at, count, has in zip(blocks, place, counts, having, strict=True):
        factors.append(together[at] / np.maximum(count, 1.0))
        if has:
            values = np.asarray(block.grid.point_data[own[block.names]], np.float64)
            beside = _mean_beside(block.grid, values, factors[-1] > 1.0)
            np.add.at(apart[0], at, np.nan_to_num(np.abs(values - beside)))
            np.add.at(apart[1], at, np.nan_to_num(np.abs(values * factors[-1] - beside)))
    divided = apart[1] < apart[0]
    return [np.where(divided[at], of, 1.0) for at, of in zip(place, factors, strict=True)]


def _elements_at(grid: Any) -> NDArray[np.float64]:
    nodes = np.asarray(grid.cell_connectivity)
    return np.bincount(nodes, minlength=grid.n_points).astype(np.float64)


def _mean_beside(
    grid: Any, values: NDArray[np.float64], shared: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """At shared nodes, the mean of the other nodes of their elements; NaN elsewhere."""
    nodes = np.asarray(grid.cell_connectivity)
    element = np.repeat(np.arange(grid.n_cells), np.diff(offsets_of(grid)))
    free = ~shared[nodes]
    of_elements = np.bincount(element[free], values[nodes[free]], grid.n_cells)
    count = np.bincount(element[free], minlength=grid.n_cells).astype(np.float64)
    total, number = (np.bincount(nodes, of[element], grid.n_points) for of in (of_elements, count))
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(shared, total / number, np.nan))
