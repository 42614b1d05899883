"""Deviations of a manufactured flank: of every tooth (ISO 1328-1), around the gear, and on a grid.

Deviations that differ from tooth to tooth have `taken_from(first, step, z)`: the deviation of a gear of z teeth whose
tooth k is tooth first + step k of this one, step 1 or -1.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from fem.microgeometry.modification import LARGEST_AMOUNT, FlankExtent, Modification, check_amount, check_within
from fem.support.arguments import FilePath, Finite, Numbers, checked
from fem.support.representation import short
from fem.support.tables import read_grid
from fem.support.validation import (
    as_floats,
    increasing,
    number,
    numbers,
    require,
    require_finite,
    set_fields,
    text_of,
)
from fem.units import mm

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

    @classmethod
    @checked
    def run_out(cls, z: int, amplitude: Finite, angle: Finite = 0.0) -> "PitchDeviation":
        """Deviations that return once per turn: tooth i of |z| teeth has amplitude cos(2 pi i / |z| - angle).

        amplitude   half of what a run-out test shows, F_r / 2 [m]: that of the transmission error of order 1
        angle       of the tooth from which most material is removed, counted as the teeth are [rad]
        """
        teeth = np.arange(abs(z))
        return cls(tuple((amplitude * np.cos(2 * pi * teeth / abs(z) - angle)).tolist()))

    @classmethod
    @checked
    def missing(cls, z: int, teeth: Numbers) -> "PitchDeviation":
        """Teeth of |z| that are broken off: 1 mm of material is removed from them, more than any contact bridges.

        teeth   their numbers, 0 to |z| - 1

        Raises ValueError for teeth that do not exist.
        """
        broken = np.atleast_1d(numbers("teeth", teeth))
        whole = bool((broken % 1 == 0).all())
        require(whole, f"teeth must be whole numbers, counted from tooth 0, got {teeth}; pass teeth=[3]")
        exist = bool((np.abs(broken) < abs(z)).all())
        require(exist, f"teeth must be among {abs(z)} teeth, 0 to {abs(z) - 1}, got {teeth}")
        values = np.zeros(abs(z))
        values[broken.astype(int) % abs(z)] = 1 * mm
        return cls(tuple(values.tolist()))

    @property
    def differs(self) -> bool:
        """Whether any two teeth differ."""
        return len(set(self.values)) > 1

    @checked
    def taken_from(self, first: int, step: int, z: int) -> "PitchDeviation":
        teeth = first + step * np.arange(len(self.values))
        return PitchDeviation(tuple(np.take(self.values, teeth, mode="wrap").tolist()))

    def removed(self, face: FlankExtent, roll, axial):
        return of_tooth(np.array(self.values), face.tooth) + 0 * roll + 0 * axial


@short(amplitude="um", angle="deg")
@dataclass(frozen=True)
class Waviness:
    """Undulations around the gear, continuous from tooth to tooth along the generation: ghost orders.

    At roll length r on tooth i of z teeth they remove amplitude cos(order (r / r_b - 2 pi i / z) - angle), constant
    along the lines of contact of helical gears; r / r_b - 2 pi i / z is the angle by which the gear turns while the
    contact moves there. Teeth of right flanks count the other way.

    order       undulations per turn, a whole number; 1 is the eccentricity of a gear, less its centre distance
    amplitude   along the normal in the transverse section [m]
    angle       [rad]

    The transmission error has that order with this amplitude while the curvature amplitude (order / rho_1)^2 of the
    crests is small beside that of the flanks, 1 / rho_1 + 1 / rho_2, with the radii of curvature rho at the contact;
    else only crests touch, and it is less.

    Raises ValueError for values out of range.
    """

    order: int
    amplitude: float
    angle: float = 0.0

    differs = True

    def __post_init__(self):
        order = number("order", self.order)
        require(
            bool(order % 1 == 0 and 1 <= order < 1e4), f"order must be a whole number in [1, 1e4), got {self.order}"
        )
        set_fields(self, order=int(order), amplitude=number("amplitude", self.amplitude))
        set_fields(self, angle=number("angle", self.angle))
        check_amount("amplitude", self.amplitude)
        require_finite("angle", self.angle)

    @checked
    def taken_from(self, first: int, step: int, z: int) -> "Waviness":
        return Waviness(self.order, self.amplitude, self.angle + step * 2 * pi * self.order * first / z)

    def numbers(self, face: FlankExtent) -> tuple[float, ...]:
        return self.amplitude, self.order, self.angle, face.r_b, face.slope, face.z

    def removed(self, face: FlankExtent, roll, axial):
        return waviness(self.numbers(face), roll, axial, face.tooth)


@short(d="mm", axial="mm", height="mm", width="mm", depth="um")
@dataclass(frozen=True)
class Spall:
    """A spall or pit: an area of the flank from which material is broken out, with edges of a twentieth of its size.

    d           diameter of the middle of the area [m]
    height      along the roll length [m]
    width       along the face [m]
    axial       axial position of its middle from the middle of the face width [m]
    depth       [m]

    Give it to a tooth by `fem.OnTooth`. Raises ValueError for values out of range, and where it misses the flank.
    """

    d: float
    height: float
    width: float
    axial: float = 0.0
    depth: float = 1e-4

    def __post_init__(self):
        as_floats(self)
        check_within("d", self.d, 1e-4, 20.0, "m (pass metres: 38*mm)")
        for name in ("height", "width"):
            check_within(name, getattr(self, name), 1e-5, 1.0, "m (pass metres: 2*mm)")
        check_within("axial", self.axial, -10.0, 10.0, "m (pass metres)")
        check_within("depth", self.depth, 0.0, 1 * mm, "m (pass metres: 100*um)")

    def grid(self, face: FlankExtent) -> "Grid":
        """The same as deviations on a grid."""
        roll, shares = face.roll_at(self.d), np.array([-0.5, -0.45, 0.45, 0.5])
        inside = np.array([0.0, 1.0, 1.0, 0.0])
        values = self.depth * np.outer(inside, inside)
        lines = roll + self.height * shares, self.axial + self.width * shares
        return Grid(tuple(lines[0].tolist()), tuple(lines[1].tolist()), tuple(map(tuple, values.tolist())))

    def check(self, face: FlankExtent) -> None:
        """ValueError where the area misses the flank."""
        self.grid(face).check(face)

    def edges_across(self, face: FlankExtent) -> tuple[float, ...]:
        return self.grid(face).axial

    def lines_across(self, face: FlankExtent) -> tuple[float, ...]:
        return self.grid(face).axial

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return self.grid(face).roll

    def removed(self, face: FlankExtent, roll, axial):
        return self.grid(face).removed(face, roll, axial)


@short(radius="mm", half_angle="deg")
@dataclass(frozen=True)
class Crack:
    """A crack in the root of a tooth, over the whole face: the tooth turns about a hinge under its load.

    turn        angle by which it turns under a moment [rad/(N m)]; `fem.crack` derives it from a lost share of the
                stiffness
    radius      of the hinge, on the centre line of the tooth [m]: the root radius
    half_angle  half angle of the tooth at the base circle, `Gear.psi_b` [rad]

    It removes no material. Give it to a tooth by `fem.OnTooth`. Raises ValueError for values out of range.
    """

    turn: float
    radius: float
    half_angle: float

    def __post_init__(self):
        as_floats(self)
        require(
            0 <= self.turn < 1, f"turn must lie in [0, 1) rad/(N m), got {self.turn}; take fem.crack(gear, lost=0.3)"
        )
        check_within("radius", self.radius, 1e-4, 10.0, "m (pass metres)")
        require_finite("half_angle", self.half_angle)

    def check(self, face: FlankExtent) -> None:
        """ValueError on internal gears, whose teeth bend with their rim."""
        require(face.z > 0, f"a crack bends a tooth of an external gear, got z = {face.z}")

    def numbers(self, face: FlankExtent) -> tuple[float, float, float, float]:
        return self.turn, self.radius, self.half_angle, face.r_b

    def removed(self, face: FlankExtent, roll, axial):
        return 0 * roll + 0 * axial


@short()
@dataclass(frozen=True)
class OnTooth:
    """Modifications and deviations of a single tooth, beside those of all teeth.

    tooth       its number, counter-clockwise from tooth 0, of an internal gear clockwise
    flank       modifications such as `fem.Spall`, `fem.Grid` of a measured tooth, `fem.ProfileCrowning`

    Raises ValueError for a number that is not whole, and for parts that are no modifications or name teeth themselves.
    """

    tooth: int
    flank: tuple[Modification, ...]

    differs = True

    def __post_init__(self):
        tooth = number("tooth", self.tooth)
        require(bool(tooth % 1 == 0), f"tooth must be a whole number, counted from tooth 0, got {self.tooth}")
        parts = tuple(self.flank) if isinstance(self.flank, Iterable) else (self.flank,)
        fits = all(hasattr(part, "removed") and not isinstance(part, type) for part in parts)
        require(fits, f"flank must hold modifications such as fem.Spall(...), got {text_of(self.flank)}")
        nested = [type(part).__name__ for part in parts if hasattr(part, "taken_from")]
        require(not nested, f"flank of a single tooth holds {nested}, which are of all teeth; give them to the gear")
        set_fields(self, tooth=int(tooth), flank=parts)

    @checked
    def taken_from(self, first: int, step: int, z: int) -> "OnTooth":
        return OnTooth((self.tooth - first) * step % abs(z), self.flank)

    def check(self, face: FlankExtent) -> None:
        """ValueError unless the tooth exists, and all its modifications suit the flank."""
        exists = -abs(face.z) < self.tooth < abs(face.z)
        require(exists, f"tooth must be one of {abs(face.z)} teeth, 0 to {abs(face.z) - 1}, got {self.tooth}")
        for part in self.flank:
            if hasattr(part, "check"):
                part.check(face)

    def _listed(self, name: str, face: FlankExtent) -> tuple[float, ...]:
        return tuple(x for part in self.flank if hasattr(part, name) for x in getattr(part, name)(face))

    def edges(self, face: FlankExtent) -> tuple[float, ...]:
        return self._listed("edges", face)

    def edges_across(self, face: FlankExtent) -> tuple[float, ...]:
        return self._listed("edges_across", face)

    def lines_across(self, face: FlankExtent) -> tuple[float, ...]:
        return self._listed("lines_across", face)

    def removed(self, face: FlankExtent, roll, axial):
        total = sum((part.removed(face, roll, axial) for part in self.flank), 0 * roll + 0 * axial)
        return np.where(np.equal(np.mod(np.subtract(face.tooth, self.tooth), abs(face.z)), 0), total, 0.0)


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
        largest = {"removed": LARGEST_AMOUNT}
        axes, values = read_grid(path, {"roll": "m", "axial": "m"}, {"removed": "m"}, largest=largest)
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


def lever_of(radius, half_angle, r_b, roll):
    """Distance [m] of the normal of a flank at a roll length from a point on the centre line of the tooth."""
    return r_b - radius * np.cos(roll / r_b - half_angle)


def waviness(numbers, roll, axial, tooth):
    """Material removed [m] by undulations at a roll length and an axial position of a tooth.

    numbers   amplitude [m], order, angle [rad], base radius [m], tangent of the base helix angle, number of teeth
    """
    amplitude, order, angle, r_b, slope, z = numbers
    return amplitude * np.cos(order * ((roll - axial * slope) / r_b - 2 * np.pi * tooth / z) - angle)


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
