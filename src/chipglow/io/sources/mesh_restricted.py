"""Fields that a mesh has in some of its blocks only, such as the temperatures of two materials.

A file of Exodus has every field of nodes at every node: where a block does not have it, it is 0. At
some of the nodes that blocks share, MOOSE writes the sum over the elements that have the field,
divided by the number of all elements there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import COMMON_NAMES, match_names, simple
from chipglow.io.sources.mesh_reader import Block, fields_of, offsets_of

Frames: TypeAlias = Sequence[Sequence[Block]]
BlockFields: TypeAlias = Mapping[tuple[str, ...], str | None]
"""The file's field of each block, by the block's names; None if the block has none."""

_TEMPERATURE: Final = "temperature"
_RESTRICTED: Final = (_TEMPERATURE, "plastic_strain", "plastic_strain_rate")
NODE_NUMBER: Final = "GlobalNodeId"
"""VTK's name for the numbers that nodes have in a whole file of Exodus."""

_LARGEST_BLANK_FRACTION: Final = 0.5
"""Fraction of a block's values above which blank ones mean that it does not have the field."""


def restricted_fields(frames: Frames, given: Mapping[str, str]) -> dict[str, BlockFields]:
    """Return the fields, by the names of a scene, that differ from block to block."""
    blocks = frames[0]
    scalars = [name for name, size in fields_of(blocks).items() if size == 1]
    found: dict[str, BlockFields] = {}
    for ours in _RESTRICTED if len(blocks) > 1 else ():
        name = given.get(ours) or match_names(scalars, {}, (ours,)).get(ours)
        if name is None:
            chosen = _fields_by_block(ours, frames, scalars)
        else:  # strains may well be 0 in a whole block
            having = [block.names for block in blocks if _has_values(frames, block, name)]
            some = ours == _TEMPERATURE and len(having) < len(blocks)
            chosen = dict.fromkeys(having, name) if some else {}
        if chosen:
            found[ours] = {block.names: chosen.get(block.names) for block in blocks}
    return found


def label_of(fields: BlockFields) -> str:
    """Return the name of a field that is put together from those of the blocks."""
    return ", ".join(dict.fromkeys(name for name in fields.values() if name))


def with_own_fields(
    blocks: Sequence[Block], restricted: Mapping[str, BlockFields]
) -> tuple[Block, ...]:
    """Return blocks with the fields that they have, under the names of those put together."""
    numbered = all(NODE_NUMBER in block.grid.point_data for block in blocks)
    factors = _divisors(blocks) if numbered and restricted else [None] * len(blocks)
    pairs = zip(blocks, factors, strict=True)
    return tuple(_with_own(block, restricted, of_block) for block, of_block in pairs)


def _with_own(
    block: Block, restricted: Mapping[str, BlockFields], factors: NDArray[Any] | None
) -> Block:
    grid = block.grid.copy(deep=False)
    for fields in restricted.values():
        label = label_of(fields)
        own = fields.get(block.names, label)
        for data in (grid.point_data, grid.cell_data):
            values = data.get(own)
            for name in set(fields.values()) & set(data.keys()):
                del data[name]
            if values is not None:
                of_nodes = data.association == grid.point_data.association
                data[label] = _undivided(grid, values, factors) if of_nodes else values
    if NODE_NUMBER in grid.point_data:
        del grid.point_data[NODE_NUMBER]
    return replace(block, grid=grid)


def _fields_by_block(ours: str, frames: Frames, names: Sequence[str]) -> dict[Any, str]:
    """Return the field of each block, if two blocks or more have one."""
    for stem in COMMON_NAMES[ours]:
        fields = {simple(name): name for name in names if simple(name).startswith(f"{stem}_")}
        chosen = {}
        for block in frames[0]:
            own = [fields.get(f"{stem}_{simple(name)}") for name in block.names]
            fitting = [name for name in own if name]
            if not fitting and ours == _TEMPERATURE:
                fitting = [name for name in fields.values() if _has_values(frames, block, name)]
                if len(fitting) > 1:
                    return {}
            if fitting:
                chosen[block.names] = fitting[0]
        if len(set(chosen.values())) > 1:
            return chosen
    return {}


def _has_values(frames: Frames, block: Block, name: str) -> bool:
    """Return whether most values of a block are not 0 in the first or last frame."""
    same = [other.grid for frame in frames for other in frame if other.names == block.names]
    fields = [
        np.nan_to_num(np.asarray(data[name], np.float64), posinf=0.0, neginf=0.0)
        for grid in same
        for data in (grid.point_data, grid.cell_data)
        if name in data and grid.n_cells
    ]
    return any((values == 0.0).mean() <= _LARGEST_BLANK_FRACTION for values in fields)


def _divisors(blocks: Sequence[Block]) -> list[NDArray[Any]]:
    """Return how many times as many elements all blocks have at each node as its own block has."""
    grids = [block.grid for block in blocks]
    of_blocks = [np.bincount(grid.cell_connectivity, minlength=grid.n_points) for grid in grids]
    numbers = np.concatenate([grid.point_data[NODE_NUMBER] for grid in grids])
    own, (_, at) = np.concatenate(of_blocks), np.unique(numbers, return_inverse=True)
    factors = np.bincount(at, own)[at] / np.maximum(own, 1)
    return np.split(factors, np.cumsum([grid.n_points for grid in grids])[:-1])


def _undivided(grid: Any, values: NDArray[Any], factors: NDArray[Any] | None) -> NDArray[Any]:
    """Return a block's values at its nodes, those that MOOSE divided restored.

    At a node that blocks share the restored value is taken if it is nearer to the mean of the
    other nodes of the block's elements there.
    """
    from scipy.sparse import csr_array

    values = np.array(values, np.float64)
    if factors is None:
        return values
    nodes = np.asarray(grid.cell_connectivity)
    shape = (grid.n_cells, grid.n_points)
    incidence = csr_array((np.ones(len(nodes)), nodes, offsets_of(grid)), shape=shape)
    free = (factors <= 1.0).astype(np.float64)
    sums, number = (incidence.T @ (incidence @ of) for of in (np.where(free, values, 0.0), free))
    with np.errstate(invalid="ignore", divide="ignore"):
        beside = sums / number
        nearer = np.abs(values * factors - beside) < np.abs(values - beside)
    restored = (factors > 1.0) & nearer
    values[restored] *= factors[restored]
    return values
