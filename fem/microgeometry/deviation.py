"""Deviations of a manufactured flank: pitch deviation of every tooth (ISO 1328-1), and deviations on a grid."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem.microgeometry.modification import FlankExtent, check_amount, check_within
from fem.support.arguments import FilePath, checked
from fem.support.representation import short
from fem.support.tables import read_grid
from fem.support.validation import increasing, numbers, require_finite, set_fields

#: Grid lines closer together than this share of the mean distance belong to a local refinement.
REFINED = 0.5


@short(values="um")
@dataclass(frozen=True)
class PitchDeviation:
    """Index deviation [m] of every tooth, counter-clockwise from tooth 0, of an internal gear clockwise.

    A value > 0 removes material from the whole flank.

    As a modification of both sides it makes the teeth thinner or thicker; to shift them, give left and right flanks
    deviations of opposite sign (`fem.Sides`).

    values      (z,) displacement of each tooth's flank along its normal in the transverse section [m]

    Raises ValueError unless there is one value in range for each tooth.
    """

    values: tuple[float, ...]

    def __post_init__(self):
        values = numbers("values", self.values)
        if values.ndim != 1:
            raise ValueError(f"values must be one pitch deviation [m] for each tooth, got {self.values!r}")
        set_fields(self, values=tuple(values.tolist()))
        for value in self.values:
            check_amount("values", value)

    def check(self, face: FlankExtent) -> None:
        """ValueError unless there is one value for each tooth."""
        if len(self.values) != abs(face.z):
            raise ValueError(f"values must hold one pitch deviation a tooth, z = {face.z}, got {len(self.values)}")

    def removed(self, face: FlankExtent, roll, axial):
        return of_tooth(np.array(self.values), face.tooth) + 0 * roll + 0 * axial


@short(roll="mm", axial="mm", values="um")
@dataclass(frozen=True)
class Grid:
    """Measured or computed deviations, bilinear between grid lines and constant beyond the outermost ones.

    roll        (n,) roll lengths, increasing [m]; those of an internal gear are < 0, from root to tip
    axial       (m,) axial positions from the middle of the face width, increasing [m]
    values      (n, m) material removed [m]

    Raises ValueError for values that are not finite or out of range, and for grids that miss the flank.
    """

    roll: tuple[float, ...]
    axial: tuple[float, ...]
    values: tuple[tuple[float, ...], ...]

    def __post_init__(self):
        for name, high, low in (("roll", 10.0, -10.0), ("axial", 10.0, -10.0)):
            lines = increasing(name, getattr(self, name), least=2)
            check_within(name, lines[0], low, high, "m (pass metres)")
            check_within(name, lines[-1], low, high, "m (pass metres)")
            set_fields(self, **{name: tuple(lines.tolist())})
        values, shape = numbers("values", self.values), (len(self.roll), len(self.axial))
        if values.shape != shape:
            raise ValueError(f"values must have the shape (roll, axial) = {shape}, got {values.shape}; transpose them?")
        require_finite("values", values, "fill the missing points of the measurement")
        check_amount("values", float(values.flat[np.abs(values).argmax()]))
        set_fields(self, values=tuple(map(tuple, values.tolist())))

    @classmethod
    @checked
    def from_table(cls, path: FilePath) -> "Grid":
        """The deviations of a table with units in its header, say from a measuring machine.

        path    text file (CSV, or separated by blanks) with a line for each point of the grid, in any order, under the
                header roll [mm], axial [mm], removed [um]; further units of length are converted

        Raises FileNotFoundError, and ValueError for a unit that is missing or unknown, NaN, points that are missing or
        given twice, with the line of the file, and as the class.
        """
        axes, values = read_grid(path, {"roll": "m", "axial": "m"}, {"removed": "m"})
        roll, axial = (tuple(lines.tolist()) for lines in axes.values())
        return cls(roll, axial, tuple(map(tuple, values["removed"].tolist())))

    def check(self, face: FlankExtent) -> None:
        """ValueError where the grid misses the flank."""
        if face.z < 0 and self.roll[-1] > 0:
            signs = f"roll lengths of an internal gear are < 0 and increase to the tip, got up to {self.roll[-1]:g} m"
            raise ValueError(f"roll: {signs}; pass Grid(-roll[::-1], axial, values[::-1])")
        for name, low, high in (("roll", face.roll_form, face.roll_tip), ("axial", -face.width / 2, face.width / 2)):
            first, last = getattr(self, name)[0], getattr(self, name)[-1]
            if not (first < high and last > low):
                flank = f"the flank reaches from {low:.6g} to {high:.6g} m"
                raise ValueError(f"{name} misses the flank: lines from {first:g} to {last:g} m, {flank}")

    def lines_across(self, face: FlankExtent) -> tuple[float, ...]:
        return self.axial

    def edges_across(self, face: FlankExtent) -> tuple[float, ...]:
        """Lines where the grid is finer than elsewhere; an equidistant grid has none, as the slices resolve it."""
        apart = np.diff(self.axial)
        nearest = np.minimum(np.append(apart, np.inf), np.insert(apart, 0, np.inf))
        return tuple(np.array(self.axial)[nearest < REFINED * apart.mean()].tolist())

    @cached_property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Grid lines (n,) and (m,), and the values of one roll length after another (n m,) [m]."""
        return np.array(self.roll), np.array(self.axial), np.ravel(self.values)

    def removed(self, face: FlankExtent, roll, axial):
        return bilinear(*self.arrays, np.asarray(roll), np.asarray(axial))


def of_tooth(values, tooth):
    """Material removed [m] from a tooth of values (z,) [m]."""
    return values[tooth % values.size]


def bilinear(roll_lines, axial_lines, values, roll, axial):
    """Material removed [m] by values (n m,) on grid lines (n,) and (m,), at roll lengths and axial positions [m]."""

    def line_below(lines, at):
        """Number of the grid line below a value, and the share of the distance to the next line."""
        i = np.minimum(np.maximum(np.searchsorted(lines, at, side="right") - 1, 0), lines.size - 2)
        return i, np.minimum(np.maximum((at - lines[i]) / (lines[i + 1] - lines[i]), 0.0), 1.0)

    (i, u), (j, v) = line_below(roll_lines, roll), line_below(axial_lines, axial)
    at, above = axial_lines.size * i + j, axial_lines.size * (i + 1) + j
    low, high = values[at] * (1 - v) + values[at + 1] * v, values[above] * (1 - v) + values[above + 1] * v
    return low * (1 - u) + high * u
