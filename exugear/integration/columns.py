"""Samples as columns: what processes return of a part of a run, and the whole run from the columns of its parts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Columns:
    """Samples by the name of a quantity, in place of an array of records.

    dtype    of the records
    arrays   (n, ...) of each quantity; (1, ...) where all samples are equal
    size     number of samples
    """

    dtype: np.dtype
    arrays: dict[str, np.ndarray]
    size: int

    def __getitem__(self, key):
        """All samples of a quantity, or a slice of the samples of all."""
        if isinstance(key, str):
            array = self.arrays[key]
            return array if len(array) == self.size else np.broadcast_to(array, (self.size, *array.shape[1:]))
        size = len(range(*key.indices(self.size)))
        arrays = {name: array[key] if len(array) == self.size else array for name, array in self.arrays.items()}
        return Columns(self.dtype, arrays, size)

    def __len__(self) -> int:
        return self.size


def columns_of(block: np.ndarray) -> Columns:
    """The columns of an array of records."""
    arrays = {name: _compressed(block[name]) for name in block.dtype.names or ()}
    return Columns(block.dtype, arrays, len(block))


def joined(parts: Sequence[Columns]) -> Columns:
    """The columns of parts one after the other."""
    names = parts[0].arrays
    return Columns(
        parts[0].dtype, {name: _joined([part[name] for part in parts]) for name in names}, sum(map(len, parts))
    )


def _joined(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Arrays one after the other; a single value where all are equal."""
    ends = np.concatenate([array[[0, -1]] for array in arrays if len(array)] or [arrays[0][:0]])
    constant = len(ends) and (ends == ends[0]).all() and all(_is_constant(array) for array in arrays)
    return ends[:1] if constant else np.concatenate(arrays)


def _compressed(column: np.ndarray) -> np.ndarray:
    """A contiguous column, or a single value where all are equal."""
    return column[:1].copy() if _is_constant(column) else np.ascontiguousarray(column)


def _is_constant(column: np.ndarray) -> bool:
    """Whether all values of a column are equal; most that are not differ in the middle."""
    if len(column) < 2 or column.strides[0] == 0:
        return len(column) > 1
    return bool((column[len(column) // 2] == column[0]).all() and (column == column[0]).all())
