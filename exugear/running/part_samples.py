"""Samples of a part of a run on their way from a process to the recorders of the whole run."""

import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import uuid4

import numpy as np

from exugear.contact.recorder import Recorder
from exugear.operation.shaft_recorder import ShaftRecorder


@dataclass(frozen=True, eq=False)
class PartSamples:
    """Samples of a part of a run.

    numbers   of the samples in the whole run
    rows      (n,) of each quantity of all recorders; (1,) where all samples are equal
    """

    numbers: range
    rows: Sequence[np.ndarray]

    def copy_to(self, rows: Sequence[np.ndarray], begin: int) -> None:
        """Copy the samples from a number on to the rows of the whole run, each of which is constant from there on."""
        if begin >= self.numbers.stop:
            return
        whole, part = slice(begin, self.numbers.stop), slice(begin - self.numbers.start, None)
        for row, samples in zip(rows, self.rows, strict=True):
            if len(samples) > 1:
                row[whole] = samples[part]
            elif row[begin] != samples[0]:
                row[whole] = samples


def rows_of(recorders: Sequence[Recorder | ShaftRecorder]) -> list[np.ndarray]:
    """(number,) samples of each quantity that recorders hold, and of each of its components."""
    return [row for recorder in recorders for array in recorder.samples.values() for row in np.atleast_2d(array)]


def part_samples(recorders: Sequence[Recorder | ShaftRecorder], numbers: range) -> PartSamples:
    """The samples with these numbers of recorders."""
    first = int(recorders[0].header.first)
    rows = (row[numbers.start - first : numbers.stop - first] for row in rows_of(recorders))
    return PartSamples(numbers, [row[:1] if _is_constant(row) else row for row in rows])


def _is_constant(row: np.ndarray) -> bool:
    """Whether all samples are equal; most rows that are not constant differ in the middle."""
    return row.size > 0 and bool(row[row.size // 2] == row[0] and (row == row[0]).all())


def stored(samples: PartSamples, folder: Path) -> PartSamples | Path:
    """Store samples in a new file of a folder: processes of one machine share it several times as fast as a pipe."""
    if not folder.is_dir():
        return samples
    path = folder / str(uuid4())
    with path.open("wb") as file:
        pickle.dump(samples, file, protocol=pickle.HIGHEST_PROTOCOL)
    return path


def loaded(samples: PartSamples | Path) -> PartSamples:
    """The samples, also from the file in which they are stored, which is deleted: its memory serves the next ones."""
    if isinstance(samples, PartSamples):
        return samples
    with samples.open("rb") as file:
        content = pickle.load(file)
    samples.unlink()
    return content
