"""Samples as columns: what processes return of a part of a run, and the whole run from the columns of its parts."""

import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

import numpy as np

#: Boundary at which arrays begin in a file [bytes].
ALIGNED = 64


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


@dataclass(frozen=True)
class StoredColumns:
    """Columns in a file, by which processes of one machine hand them over several times as fast as through a pipe.

    content   of the columns but for their arrays
    begins    (n_array,) bytes at which the arrays begin
    sizes     (n_array,) bytes of each
    """

    path: Path
    content: bytes
    begins: Sequence[int]
    sizes: Sequence[int]

    def loaded(self) -> list[Columns]:
        """The columns, whose arrays read the file where they are used."""
        mapped = np.memmap(self.path, np.uint8, mode="r")
        buffers = [mapped[begin : begin + size] for begin, size in zip(self.begins, self.sizes, strict=True)]
        return pickle.loads(self.content, buffers=buffers)


def stored(columns: Sequence[Columns], folder: Path) -> StoredColumns:
    """Store columns in a new file of a folder."""
    arrays: list[pickle.PickleBuffer] = []
    content = pickle.dumps(list(columns), protocol=5, buffer_callback=arrays.append)
    sizes = [array.raw().nbytes for array in arrays]
    *begins, end = np.cumsum([0, *(-(-size // ALIGNED) * ALIGNED for size in sizes)]).tolist()
    path = folder / str(uuid4())
    with path.open("wb") as file:
        for begin, array in zip(begins, arrays, strict=True):
            file.seek(begin)
            file.write(array.raw())
        file.truncate(max(end, 1))
    return StoredColumns(path, content, begins, sizes)


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
