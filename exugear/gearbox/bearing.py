"""A bearing as data: linear, with radial clearance, by a table of forces, or as a full stiffness matrix.

The radial force of all but a matrix is linear between points (`radial_points`): the law of a further kind of bearing is
its fields and its points. What follows from the law stands in `exugear.gearbox.bearing_law`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np

from exugear.gearbox.drag import AnyDrag
from fem.support.arguments import FilePath, Finite, Numbers, checked, renamed
from fem.support.numba_cache import compiled_or_not
from fem.support.representation import short
from fem.support.tables import read_table
from fem.support.user_warning import warn_renamed
from fem.support.validation import increasing, require, require_finite, set_fields

UNITS = {"radial": "N/m", "axial": "N/m", "tilt": "N m/rad", "damping_time": "s", "clearance": "m"}
#: Stiffness [N/m, N m/rad] from which on a bearing is effectively rigid.
RIGID, RIGID_TILT = 1e13, 1e11
#: Stiffness below which the user is taken to mean another unit. Rolling bearings have 10 to 10,000 N/um, the softest
#: rubber mounts 1e4 N/m: on less, a shaft of 1 kg sags by a millimetre. Tilt: two such mounts, each a centimetre from
#: the pole.
SOFT, SOFT_TILT = 1e4, 1.0
#: Displacement beyond the clearance at which the points of a law end [m].
REACH = 1.0
#: Relative error of a matrix that counts as rounding.
ROUNDING = 1e-9


@renamed(damping="damping_time")
@checked
@short(**UNITS | {"clearance": "um"})
@dataclass(frozen=True)
class Bearing:
    """A bearing at an axial position of a shaft; the shaft is free to spin in it.

    radial      stiffness in x and y [N/m]
    axial       stiffness in z [N/m]
    tilt        stiffness about x and y [N m/rad]
    damping_time
                damping over stiffness [s]: force = stiffness (displacement + damping_time velocity). Along the radial
                displacement the stiffness of a clearance or table is its tangent, across it its secant
    clearance   radial clearance [m], half the diametral one: no radial force up to this radial displacement
    table       radial displacement (n,) [m] from 0 and radial force (n,) [N] from 0, linear in between, the same in all
                directions; instead of radial and clearance
    matrix      stiffness (6, 6) over x, y, z and about x, y, z [N/m, N/rad, N, N m/rad]; instead of radial, axial,
                tilt, clearance and table
    drag        `Drag`, `BearingDrag` or `SkfDrag`: the torque by which it brakes the shaft

    Raises ValueError for a stiffness that is negative, so high that the bearing is effectively rigid, or so low that
    another unit is meant (0 < k < 1e4 N/m), for tables with falling forces, and for matrices that are not symmetric and
    positive semi-definite.
    """

    radial: float = 0.0
    axial: float = 0.0
    tilt: float = 0.0
    damping_time: float = 0.0
    clearance: float = field(default=0.0, kw_only=True)
    table: tuple[Sequence[float], Sequence[float]] | None = field(default=None, kw_only=True)
    matrix: Sequence[Sequence[float]] | None = field(default=None, kw_only=True)
    drag: AnyDrag | None = field(default=None, kw_only=True)

    def __post_init__(self):
        for name, unit in UNITS.items():
            value = getattr(self, name)
            require(0 <= value < inf, f"{name} must be >= 0 {unit} and finite, got {value}")
        ratio = f"damping_time must be below 0.1 s, got {self.damping_time}; pass damping / stiffness"
        require(self.damping_time < 0.1, ratio)
        require(self.clearance < 1e-2, f"clearance must be below 0.01 m, got {self.clearance}; pass metres: 20*um")
        if self.table is not None:
            self._set_table(self.table)
        if self.matrix is not None:
            self._set_matrix()
        self._check_alone("matrix", ("radial", "axial", "tilt", "clearance", "table"))
        self._check_alone("table", ("radial", "clearance"))
        require(self.clearance == 0 or self.radial > 0, "clearance needs a radial stiffness behind it, got radial = 0")
        self._check_size()

    @classmethod
    @checked
    def from_table(
        cls,
        path: FilePath,
        *,
        axial: float = 0.0,
        tilt: float = 0.0,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "Bearing":
        """A bearing by a measured or computed table of radial force over displacement.

        path   text file (CSV, or separated by blanks) with a line for each point, in any order, from 0, under the
               header displacement [um], force [N]; further units of length and force are converted

        The other arguments as in the class. Raises FileNotFoundError, and ValueError for a unit that is missing or
        unknown, NaN, points given twice, with the line of the file, and as the class.
        """
        table = read_table(path, {"displacement": "m", "force": "N"}, key=["displacement"])
        order = np.argsort(table["displacement"])
        columns = table["displacement"][order].tolist(), table["force"][order].tolist()
        return cls(axial=axial, tilt=tilt, damping_time=damping_time, table=columns, drag=drag)

    @property
    def damping(self) -> float:
        """Deprecated name of damping_time."""
        warn_renamed("Bearing.damping", "Bearing.damping_time")
        return self.damping_time

    def _check_alone(self, name: str, replaced: tuple[str, ...]) -> None:
        given = [field for field in replaced if getattr(self, field)] if getattr(self, name) is not None else []
        require(not given, f"{name} replaces {', '.join(replaced)}; leave {', '.join(given)} out")

    def _set_table(self, table: tuple[Sequence[float], Sequence[float]]) -> None:
        columns = [np.asarray(column, float) for column in table]
        shapes = [column.shape for column in columns]
        fits = len(columns) == 2 and columns[0].ndim == 1 and shapes[0] == shapes[-1] and columns[0].size >= 2
        require(fits, f"table must be (displacement, force), each (n,) with n >= 2, got {shapes}")
        displacement, force = columns
        require_finite("table", columns)
        starts = displacement[0] == 0 and force[0] == 0
        require(bool(starts), f"table must start at (0, 0), got ({displacement[0]:g}, {force[0]:g})")
        increasing("displacements of the table", displacement, least=2)
        require(displacement[-1] < 1e-2, f"table ends at {displacement[-1]:g} m; pass metres: 20*um")
        steepest = np.argmin(np.diff(force))
        fall = f"{force[steepest]:g} N is followed by {force[steepest + 1]:g} N, which would be unstable"
        require(bool(np.diff(force).min() >= 0), f"forces of the table must not fall; {fall}: sort or smooth it")
        require(bool(force[-1] > 0), f"forces of the table must end above 0 N, got {force[-1]:g} N")
        set_fields(self, table=tuple(tuple(column.tolist()) for column in columns))

    def _set_matrix(self) -> None:
        k = np.asarray(self.matrix, float)
        require(k.shape == (6, 6), f"matrix must be (6, 6) over x, y, z and about x, y, z, got {k.shape}")
        require_finite("matrix", k)
        scale = np.sqrt(np.maximum(np.diag(k), 0))
        scale[scale == 0] = 1
        scaled = k / np.outer(scale, scale)
        i, j = np.unravel_index(np.abs(scaled - scaled.T).argmax(), k.shape)
        uneven = f"got {k[i, j]:g} at [{i}, {j}] and {k[j, i]:g} at [{j}, {i}]; pass (matrix + matrix.T) / 2"
        symmetric = bool(abs(scaled[i, j] - scaled[j, i]) < ROUNDING)
        require(symmetric, f"matrix must be symmetric, as a bearing stores energy, {uneven}")
        spin = f"row and column 5 of the matrix, about z, must be 0, got {k[5]}; a bearing lets the shaft spin"
        require(not k[5].any(), spin)
        least = np.linalg.eigvalsh(scaled)[0]
        sign = f"its least eigenvalue, scaled to a unit diagonal, is {least:.3g}; check the signs of its coupling terms"
        require(least > -ROUNDING, f"matrix must be positive semi-definite, {sign}")
        set_fields(self, matrix=tuple(map(tuple, ((k + k.T) / 2).tolist())))

    def _check_size(self) -> None:
        size = np.diag(self.stiffness)
        none = "the bearing has no stiffness; give it radial, axial or tilt, or leave it out"
        require(bool(size.any()), f"{none}{' and put its drag on the shaft' if self.drag else ''}")
        radial = "steepest slope of the table" if self.table is not None else "radial"
        for i, name in enumerate((radial, radial, "axial", "tilt", "tilt")):
            name = name if self.matrix is None else f"matrix[{i}, {i}]"
            soft, rigid, unit = (SOFT, RIGID, "N/m") if i < 3 else (SOFT_TILT, RIGID_TILT, "N m/rad")
            ideal = f"is effectively rigid (from {rigid:g} on); leave the bearings out for ideal ones"
            require(size[i] < rigid, f"{name} {size[i]:.3g} {unit} {ideal}")
            units = f"200 N/um are 200e6 {unit}" if i < 3 else f"200 kN m/rad are 200e3 {unit}"
            low = f"{name} must be 0 or from {soft:g} {unit} on, got {size[i]:g}; pass {unit}: {units}"
            require(size[i] == 0 or size[i] >= soft, low)

    @property
    def linear(self) -> bool:
        """Whether the force is proportional to the displacement."""
        return self.clearance == 0 and self.table is None

    @property
    def reach(self) -> float:
        """Largest radial displacement [m] for which the force is known; inf without a table."""
        return inf if self.table is None else self.table[0][-1]

    @property
    def stiffness(self) -> np.ndarray:
        """(6, 6) stiffness over x, y, z and about x, y, z; the largest tangent stiffness of nonlinear bearings."""
        if self.matrix is not None:
            return np.array(self.matrix)
        slope = self.radial if self.table is None else (np.diff(self.table[1]) / np.diff(self.table[0])).max()
        return np.diag([slope, slope, self.axial, self.tilt, self.tilt, 0.0])

    @checked
    def at(self, lever: Finite) -> np.ndarray:
        """(6, 6) stiffness about a pole on the shaft's axis; lever: axial distance of the bearing from the pole [m]."""
        return about_pole(self.stiffness, lever)

    @checked
    def radial_force(self, r: Numbers):
        """Restoring force [N] at a radial displacement r >= 0 [m], number or array; ValueError beyond the table."""
        require(self.matrix is None, "a matrix has no single radial force; multiply it with the displacement")
        r = np.asarray(r, float)
        require(bool((r >= 0).all()), f"r must be >= 0 m, got {r.min()}")
        require(bool((r <= self.reach).all()), f"r = {r.max():g} m lies beyond the table's {self.reach:g} m; extend it")
        return radial_law(radial_points(self), r)[1]


def radial_points(bearing: "Bearing") -> np.ndarray:
    """(3, n) radial displacements [m], forces [N] and energies [J] of a bearing; the force is linear in between."""
    if bearing.table is not None:
        displacement, force = np.array(bearing.table)
    else:
        displacement = np.array([0.0, bearing.clearance, bearing.clearance + REACH])
        force = np.array([0.0, 0.0, bearing.radial * REACH])
        if bearing.clearance == 0:
            displacement, force = displacement[1:], force[1:]
    work = np.diff(displacement) * (force[1:] + force[:-1]) / 2
    return np.array([displacement, force, np.r_[0.0, np.cumsum(work)]])


@compiled_or_not
def radial_law(points, r):
    """Energy [J], force [N] and slope [N/m] at radial displacements r >= 0 [m]; points (3, n): `radial_points`."""
    displacement, force, energy = points[0], points[1], points[2]
    i = np.minimum(np.maximum(np.searchsorted(displacement, r) - 1, 0), displacement.size - 2)
    slope = (force[i + 1] - force[i]) / (displacement[i + 1] - displacement[i])
    beyond = r - displacement[i]
    return energy[i] + beyond * (force[i] + 0.5 * slope * beyond), force[i] + slope * beyond, slope


def about_pole(stiffness: np.ndarray, lever: float) -> np.ndarray:
    """(6, 6) stiffness about a pole on the shaft's axis, from the stiffness (6, 6) at an axial distance lever [m]."""
    motion = np.eye(6)
    motion[0, 4], motion[1, 3] = lever, -lever
    return motion.T @ stiffness @ motion


def is_isotropic(k: np.ndarray) -> bool:
    """Whether a stiffness matrix (6, 6) is the same in all directions about z."""
    like, scale = np.zeros((6, 6)), np.sqrt(np.maximum(np.diag(k), np.finfo(float).tiny))
    like[[0, 1, 2, 3, 4], [0, 1, 2, 3, 4]] = k[0, 0], k[0, 0], k[2, 2], k[3, 3], k[3, 3]
    like[[0, 4, 1, 3], [4, 0, 3, 1]] = k[0, 4], k[0, 4], -k[0, 4], -k[0, 4]
    return bool((np.abs(k - like) <= ROUNDING * np.outer(scale, scale)).all())
