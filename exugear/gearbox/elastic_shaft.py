"""A shaft with a few elastic coordinates: its beam reduced to the shapes that its gears and bearings excite.

**Bending and tension.** Decoupled coordinates are the motion of the rigid shaft, x, y, z and rotations about x, y at
its centre of mass, and amplitudes of elastic shapes. In bending the shapes span, in each of the two planes, the static
deflections on the bearings under a force and a moment at each gear, a force at each nonlinear bearing, external force
and unbalance, and the weight, and modes on the bearings: beyond the two in which the shaft moves as a rigid body, those
that transmit most from gears to bearings.
In tension they are static displacements. Less their rigid motion, and orthogonal to one another in mass and stiffness,
they leave diagonal matrices. The static compliance is exact.

**Torsion.** Coordinates are the angles of the gears, that of the end on which drive or load act, and amplitudes of
modes in which the gears stand (Craig & Bampton, AIAA J. 6, 1968), and the end where its motion is imposed; where it is
free, it stands by the static twist taken from them. The spring between the end and the next gear is a coupling
(`Shaft.twist`) and no part of the matrices here. Where the motion of the end is imposed, its inertia does not matter:
the mass of the coupling's rotor then counts, which leaves the gears theirs. The damper of the coupling is that of the
lowest mode against an end that is held; of a free end the damping here gives every mode its share.

In the steps of a run the modes of the shaft on its bearings have the masses by which they keep their frequencies, or,
beyond what steps can hold, count by their compliance alone (`modes_in_steps`): the steps are those of rigid shafts.

In a run each gear has a body of its own, and the remaining amplitudes are those of a further node. A body stands for
its gear as if the shaft were rigid from there on: its coordinates at the centre of mass are q = r + R(z)^-1 shapes(z)
a, with the rigid motion R(z) r and the amplitudes a. The frame does not turn, so that all matrices are constant.
Gyroscopic moments are skew-symmetric and proportional to the speed.
"""

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import NamedTuple

import numpy as np
import scipy

from exugear.gearbox.beam import Beam, twist_shapes
from exugear.gearbox.bearing_law import has_radial_law, linear_part, radial_secant
from exugear.gearbox.modes_in_steps import additions_in_steps
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.shaft_loads import ExternalForce

#: Iterations for the secant stiffness of nonlinear bearings.
ITERATIONS = 30
#: Angular frequency up to which modes of elastic rings keep their mass, and free ends count as slow [rad/s].
CAP = 2 * pi * 15e3
#: The same of shapes of shafts: twice the highest frequency at which meshes excite, and far above the steps of runs.
SHAPES_CAP = 2 * pi * 40e3
#: Share of the largest eigenvalue of the scaled Gram matrix below which shapes depend on one another.
DEPENDENT = 1e-9
#: Modes on bearings in which the shaft moves as a rigid body, in each plane.
RIGID_MODES = 2
#: Components and signs of displacement and rotation in the planes (x, tilt_y) and (y, -tilt_x).
PLANES = (((0, 1.0), (4, 1.0)), ((1, 1.0), (3, -1.0)))
#: Number of coordinates of a rigid shaft that does not turn.
RIGID = 5


class Shapes(NamedTuple):
    """Elastic shapes of one kind, orthogonal in mass and stiffness: over the coordinates of a beam, modal mass 1.

    values    (n_coordinate, m)
    squares   (m,) squared angular frequencies [rad^2/s^2]
    """

    values: np.ndarray
    squares: np.ndarray


class Torsion(NamedTuple):
    """Matrices over the angles of the gears, of the end where it turns on its own, and amplitudes of modes.

    mass        (n, n) where the end is free [kg m^2]
    held_mass   (n, n) where its motion is imposed, without the inertia of the end itself
    stiffness   (n, n) without the spring between the end and the next gear
    damping     (n, n) where the end is free, without that of the spring
    held_damping
                (n, n) where its motion is imposed, likewise
    modes       number of modes
    """

    mass: np.ndarray
    held_mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    held_damping: np.ndarray
    modes: int

    def with_end(self, shaft: Shaft, *, held: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Mass, stiffness, damping (k, k) with the spring towards the end, and the coordinates (k,) that are free.

        held   the motion of the end is imposed
        """
        gears, stiffness = len(shaft.stations), self.stiffness
        damping = self.held_damping if held else self.damping
        if shaft.twist:
            stiffness = _with_spring(stiffness, shaft.twist.torsion, gears)
            damping = _with_spring(damping, shaft.twist.damping, gears)
        end = gears if shaft.twist else 0
        free = np.delete(np.arange(len(self.mass)), [end] if held else [])
        part = np.ix_(free, free)
        return (self.held_mass if held else self.mass)[part], stiffness[part], damping[part], free

    def added_in_steps(self, shaft: Shaft, step: float, *, held: bool) -> tuple[np.ndarray, np.ndarray]:
        """What to add to mass and damping (n, n) in the steps [s] of a run; held: the motion of the end is imposed.

        The modes are then those against the end, whose motion nothing changes.
        """
        mass, damping = np.zeros_like(self.mass), np.zeros_like(self.mass)
        of_mass, of_stiffness, of_damping, free = self.with_end(shaft, held=held)
        if free.size:
            against_end = np.eye(len(mass))
            if held:
                gears = len(shaft.stations)
                against_end[:gears, gears if shaft.twist else 0] -= 1.0
            added = additions_in_steps(of_mass, of_stiffness, of_damping, step)
            for whole, further in zip((mass, damping), added, strict=True):
                whole[free] = further @ against_end[free]
        return mass, damping


@dataclass(frozen=True, eq=False, repr=False)
class ElasticShaft:
    """A shaft by decoupled coordinates, 5 rigid and m elastic ones, and by those of its bodies and nodes in a run.

    Bodies stand for its gears in the order of `Shaft.stations`. Coordinates in a run are those of the bodies, 6 each,
    or the angle of each where the shaft only spins; the angle of the end, where it turns on its own; and the amplitudes
    of the further node, of bending and tension, then of torsion.

    shaft       the shaft
    modes       number of bending modes in each plane, beside the static shapes
    spatial     whether the shaft moves on its bearings; else it only spins
    shapes      (n_node, 6, m) motion of each node of the beam by the elastic coordinates
    inertia     (5 + m,) of the decoupled coordinates [kg, kg m^2]
    stiffness   (m,) of the elastic coordinates
    damping     (m,) likewise
    polar       (5 + m, 5 + m) gyroscopic moments per speed, skew-symmetric
    torsion     of the shaft
    """

    shaft: Shaft
    modes: int
    spatial: bool
    shapes: np.ndarray
    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    polar: np.ndarray
    torsion: Torsion

    def __repr__(self) -> str:
        return f"ElasticShaft({self.shaft.name!r}, {self.elastic} + {self.torsion.modes} elastic coordinates)"

    @property
    def elastic(self) -> int:
        """Number of elastic coordinates of bending and tension."""
        return self.stiffness.size

    @property
    def of_bodies(self) -> int:
        """Number of coordinates of the bodies."""
        return (6 if self.spatial else 1) * len(self.shaft.stations)

    @property
    def end(self) -> int | None:
        """Index of the angle of the end; None where it does not turn on its own."""
        return self.of_bodies if self.shaft.twist else None

    @property
    def further(self) -> int:
        """Number of coordinates of the further node."""
        bodies = RIGID * len(self.shaft.stations) if self.spatial else 0
        return self.inertia.size - bodies + self.torsion.modes if self.spatial else self.torsion.modes

    @property
    def size(self) -> int:
        """Number of coordinates of bodies, end and further node."""
        return self.of_bodies + (self.end is not None) + self.further

    @cached_property
    def turning(self) -> np.ndarray:
        """Indices of the coordinates of torsion: angles of the bodies and of the end, amplitudes."""
        step = 6 if self.spatial else 1
        angles = [step * i + step - 1 for i in range(len(self.shaft.stations))]
        ends = [] if self.end is None else [self.end]
        return np.array([*angles, *ends, *range(self.size - self.torsion.modes, self.size)])

    @cached_property
    def moving(self) -> np.ndarray:
        """Indices of the coordinates of bending and tension: of the bodies, then of the further node."""
        if not self.spatial:
            return np.zeros(0, int)
        return np.setdiff1d(np.arange(self.size), self.turning)

    def shapes_at(self, axial: float) -> np.ndarray:
        """(6, m) motion at an axial position with a node [m] by the elastic coordinates."""
        return self.shapes[self.shaft.beam.node(axial)]

    def motion_at(self, axial: float) -> np.ndarray:
        """(6, 5 + m) motion at an axial position with a node [m] by the decoupled coordinates."""
        return np.hstack([rigid_motion(axial - self.shaft.centre)[:, :RIGID], self.shapes_at(axial)])

    def of_body(self, axial: float) -> np.ndarray:
        """(5, 5 + m) coordinates of the body of a gear by the decoupled coordinates."""
        return (rigid_motion(self.shaft.centre - axial) @ self.motion_at(axial))[:RIGID]

    def decoupled(self, of_body: np.ndarray, amplitudes: np.ndarray) -> np.ndarray:
        """(n, 5 + m) decoupled coordinates, from the motion (n, 5) of the first body and amplitudes (n, m).

        All of them may be rates. Each coordinate lies in one piece of memory.
        """
        shapes, coordinates = (
            self.of_body(self.shaft.stations[0])[:, RIGID:],
            np.empty((self.inertia.size, len(of_body))),
        )
        coordinates[RIGID:] = amplitudes.T
        coordinates[:RIGID] = of_body.T - shapes @ coordinates[RIGID:]
        return coordinates.T

    @cached_property
    def from_moving(self) -> np.ndarray:
        """(5 + m, 5 + m) decoupled coordinates by those of bodies and further node (`moving`).

        The further node has the amplitudes that move no gear against the first one.
        """
        bodies = [self.of_body(axial) for axial in self.shaft.stations]
        rest = np.eye(self.elastic)
        if len(bodies) > 1:
            against_first = np.vstack([body[:, RIGID:] - bodies[0][:, RIGID:] for body in bodies[1:]])
            rest = np.linalg.svd(against_first, full_matrices=True)[2][len(against_first) :]
        to_moving = np.vstack([*bodies, np.hstack([np.zeros((len(rest), RIGID)), rest])])
        return np.linalg.inv(to_moving)

    @cached_property
    def amplitude_rows(self) -> np.ndarray:
        """(m + n_torsion, size) rows that measure the elastic coordinates, then the amplitudes of torsion."""
        rows = np.zeros((self.elastic + self.torsion.modes, self.size))
        if self.spatial:
            rows[: self.elastic, self.moving] = self.from_moving[RIGID:]
        rows[self.elastic :, self.size - self.torsion.modes :] = np.eye(self.torsion.modes)
        return rows

    def _matrix(self, decoupled: np.ndarray, torsion: np.ndarray) -> np.ndarray:
        """(size, size) matrix from those over decoupled coordinates and over the coordinates of torsion."""
        matrix = np.zeros((self.size, self.size))
        if self.spatial:
            matrix[np.ix_(self.moving, self.moving)] = self.from_moving.T @ decoupled @ self.from_moving
        matrix[np.ix_(self.turning, self.turning)] = torsion
        return matrix

    def at_bearing(self, axial: float) -> np.ndarray:
        """(6, size) motion at a bearing by the coordinates in a run."""
        rows = np.zeros((6, self.size))
        rows[:, self.moving] = self.motion_at(axial) @ self.from_moving
        return rows

    def mass_matrix(self, *, held: bool) -> np.ndarray:
        """(size, size) mass; held: the motion of the end is imposed, whose own inertia is then left out."""
        return self._matrix(np.diag(self.inertia), self.torsion.held_mass if held else self.torsion.mass)

    @cached_property
    def stiffness_matrix(self) -> np.ndarray:
        """(size, size) stiffness of the shaft itself, without the spring towards its end."""
        return self._matrix(np.diag(np.r_[np.zeros(RIGID), self.stiffness]), self.torsion.stiffness)

    def damping_matrix(self, *, held: bool) -> np.ndarray:
        """(size, size) damping of the shaft itself, without that of the spring towards its end; held: as for mass."""
        of_torsion = self.torsion.held_damping if held else self.torsion.damping
        return self._matrix(np.diag(np.r_[np.zeros(RIGID), self.damping]), of_torsion)

    @cached_property
    def load_of_decoupled(self) -> np.ndarray:
        """(5 + m,) external forces and weight over the decoupled coordinates; weight deforms no orthogonal shape."""
        weight = np.zeros(RIGID + self.elastic)
        weight[:3] = self.shaft.mass * np.array(self.shaft.gravity)
        return sum((self.motion_at(axial).T @ force.wrench for axial, force in self.shaft.forces), weight)

    @cached_property
    def constant_load(self) -> np.ndarray:
        """(size,) external forces and weight over the coordinates in a run."""
        load = np.zeros(self.size)
        if self.spatial:
            load[self.moving] = self.from_moving.T @ self.load_of_decoupled
        return load

    @cached_property
    def polar_matrix(self) -> np.ndarray:
        """(size, size) gyroscopic moments per speed."""
        return self._matrix(self.polar, np.zeros_like(self.torsion.mass))

    def added_in_steps(self, step: float, *, held: bool) -> tuple[np.ndarray, np.ndarray]:
        """What to add to mass and damping (size, size) in the steps [s] of a run (`modes_in_steps`).

        The modes are those on bearings with their tangent stiffness; held: the motion of the end is imposed.
        """
        decoupled = np.zeros((2, self.inertia.size, self.inertia.size))
        if self.spatial:
            stiffness, damping = np.diag(np.r_[np.zeros(RIGID), self.stiffness]), np.zeros_like(decoupled[0])
            damping[RIGID:, RIGID:] = np.diag(self.damping)
            for axial, bearing in self.shaft.bearings.items():
                k = self.motion_at(axial).T @ bearing.stiffness @ self.motion_at(axial)
                stiffness, damping = stiffness + k, damping + bearing.damping_time * k
            decoupled[:] = additions_in_steps(np.diag(self.inertia), stiffness, damping, step)
        of_torsion = self.torsion.added_in_steps(self.shaft, step, held=held)
        mass, damping = (self._matrix(*parts) for parts in zip(decoupled, of_torsion, strict=True))
        return mass, damping

    def static_displacement(self, forces: np.ndarray) -> tuple[np.ndarray, dict[float, float]]:
        """(size,) static coordinates under forces (size,), the angle of the first body 0 and no torque on the end.

        External forces and weight of the shaft act beside these forces.

        Also the radial force of each nonlinear bearing [N] by its axial position. Nonlinear bearings have their secant
        stiffness under their forces, beyond the end of a table that at its end.
        """
        bearings = {axial: (self.at_bearing(axial), bearing) for axial, bearing in self.shaft.bearings.items()}
        bearings = bearings if self.spatial else {}
        nonlinear = {x: (rows, b) for x, (rows, b) in bearings.items() if has_radial_law(b)}
        linear = sum((rows.T @ linear_part(b, 0.0) @ rows for rows, b in bearings.values()), self.stiffness_matrix)
        secants = {axial: float(bearing.stiffness[0, 0]) for axial, (_, bearing) in nonlinear.items()}
        fixed = [int(self.turning[0]), *([] if self.end is None else [self.end])]
        free, q, radial_forces = (
            np.delete(np.arange(self.size), fixed),
            np.zeros(self.size),
            dict.fromkeys(secants, 0.0),
        )
        forces = forces + self.constant_load
        for _ in range(ITERATIONS if nonlinear else 1):
            total = linear + sum(k * bearings[x][0][:2].T @ bearings[x][0][:2] for x, k in secants.items())
            q[free] = np.linalg.solve(total[np.ix_(free, free)], forces[free])
            for axial, (rows, bearing) in nonlinear.items():
                radial_forces[axial] = float(secants[axial] * np.hypot(*(rows[:2] @ q)))
                if radial_forces[axial] > 0:
                    secants[axial] = radial_secant(bearing, radial_forces[axial])
        return q, radial_forces


def rigid_motion(lever: float) -> np.ndarray:
    """(6, 6) motion of a rigid body at a distance [m] along its axis by that at its pole."""
    motion = np.eye(6)
    motion[0, 4], motion[1, 3] = lever, -lever
    return motion


def elastic_shaft(
    shaft: Shaft, modes: int, torsion_modes: int, *, spatial: bool, axial: bool, held: bool = False
) -> ElasticShaft:
    """The shaft reduced to the static shapes, a number of bending modes in each plane, and of modes of torsion.

    axial   whether forces act along the axis, by which it is stretched
    held    whether the modes of torsion are those for an end whose motion is imposed
    """
    beam, torsion = shaft.beam, torsion_of(shaft, torsion_modes, held=held)
    rigid = np.array([shaft.mass] * 3 + [shaft.transverse] * 2)
    if not spatial:
        shapes, none = np.zeros((beam.axial.size, 6, 0)), np.zeros(0)
        return ElasticShaft(shaft, modes, False, shapes, rigid, none, none, np.zeros((RIGID, RIGID)), torsion)
    bending, tension = bending_shapes(shaft, modes), tension_shapes(shaft)
    if not axial and len(shaft.stations) == 1 and not shaft.constant_load[2]:
        tension = Shapes(tension.values[:, :0], tension.squares[:0])
    n, m = bending.squares.size, 2 * bending.squares.size + tension.squares.size
    shapes = np.zeros((beam.axial.size, 6, m))
    for i, ((moved, sign), (tilted, tilt_sign)) in enumerate(PLANES):
        part = slice(i * n, (i + 1) * n)
        shapes[:, moved, part] = sign * bending.values[0::2]
        shapes[:, tilted, part] = tilt_sign * bending.values[1::2]
    shapes[:, 2, 2 * n :] = tension.values
    squares = np.concatenate([bending.squares, bending.squares, tension.squares])
    masses = np.maximum(1.0, squares / SHAPES_CAP**2)
    damping = 2 * shaft.damping_ratio * np.sqrt(squares * masses)
    polar = _polar(beam, shaft.centre, bending, RIGID + m)
    return ElasticShaft(shaft, modes, True, shapes, np.r_[rigid, masses], squares, damping, polar, torsion)


def rigid_shaft(shaft: Shaft) -> ElasticShaft:
    """The shaft that twists between its gears and its end, but moves on its bearings as a rigid body."""
    spinning = elastic_shaft(shaft, 0, 0, spatial=False, axial=False)
    return ElasticShaft(**vars(spinning) | {"spatial": True})


def bending_shapes(shaft: Shaft, modes: int) -> Shapes:
    """Shapes of bending in one plane, over displacement and slope of each node."""
    beam = shaft.beam
    stiffness = beam.supported(shaft.planar_supports)
    coordinates = [2 * beam.node(axial) + i for axial in shaft.stations for i in (0, 1)]
    coordinates += [2 * beam.node(axial) for axial, bearing in shaft.bearings.items() if not bearing.linear]
    coordinates += [2 * beam.node(axial) + i for axial, force in shaft.forces for i in (0, 1) if _acts(force, i)]
    coordinates += [2 * beam.node(axial) for axial, _ in shaft.unbalances]
    loads = np.eye(len(stiffness))[:, coordinates]
    if any(shaft.gravity[:2]):
        loads = np.column_stack([loads, beam.bending_mass @ beam.rigid_bending(shaft.centre)[:, 0]])
    squares, shapes = scipy.linalg.eigh(stiffness, beam.bending_mass)
    pushed = [2 * beam.node(axial) for axial in shaft.stations]
    reacting = [beam.node(axial) for axial in shaft.bearings]
    supports = zip(reacting, shaft.planar_supports.values(), strict=True)
    reactions = [support[0] @ shapes[2 * node : 2 * node + 2] for node, support in supports]
    transmitted = np.linalg.norm(shapes[pushed], axis=0) * np.linalg.norm(reactions, axis=0) / squares**2
    most = RIGID_MODES + np.argsort(-transmitted[RIGID_MODES:])[:modes]
    vectors = np.column_stack([np.linalg.solve(stiffness, loads), shapes[:, most]])
    return _orthogonal(vectors, beam.rigid_bending(shaft.centre), beam.bending_mass, beam.bending_stiffness)


def _acts(force: ExternalForce, component: int) -> bool:
    """Whether an external force bends by a force (0) or by a moment (1)."""
    return bool((force.x or force.y) if component == 0 else (force.moment_x or force.moment_y))


def tension_shapes(shaft: Shaft) -> Shapes:
    """Shapes of tension: static displacements on the bearings under a force at each gear, and under external forces."""
    beam, n = shaft.beam, shaft.beam.axial.size
    pushed = [*shaft.stations, *(axial for axial, force in shaft.forces if force.z)]
    stiffness, loads = beam.tension_stiffness.copy(), np.eye(n)[:, [beam.node(axial) for axial in pushed]]
    if shaft.gravity[2]:
        loads = np.column_stack([loads, beam.tension_mass.sum(axis=1)])
    for axial, bearing in shaft.bearings.items():
        stiffness[beam.node(axial), beam.node(axial)] += bearing.stiffness[2, 2]
    vectors = np.linalg.solve(stiffness, loads)
    return _orthogonal(vectors, np.ones((n, 1)), beam.tension_mass, beam.tension_stiffness)


def torsion_of(shaft: Shaft, modes: int, *, held: bool) -> Torsion:
    """The torsion of a shaft with a number of modes in which its gears stand; held: its end, too."""
    beam, gears, twist = shaft.beam, len(shaft.stations), shaft.twist
    stations = [*shaft.stations, shaft.end_position] if twist else [*shaft.stations]
    static, nodes = twist_shapes(beam, stations), [beam.node(axial) for axial in stations]
    free = np.setdiff1d(np.arange(beam.axial.size), nodes if held else nodes[:gears])
    part = np.ix_(free, free)
    of_modes = np.zeros((beam.axial.size, modes))
    of_modes[free] = scipy.linalg.eigh(beam.torsion_stiffness[part], beam.torsion_mass[part])[1][:, :modes]
    of_modes -= static @ of_modes[nodes]
    squares = np.zeros(0)
    if modes:
        projected = (of_modes.T @ matrix @ of_modes for matrix in (beam.torsion_stiffness, beam.torsion_mass))
        squares, turned = scipy.linalg.eigh(*projected)
        of_modes = of_modes @ turned
    basis = np.hstack([static, of_modes])
    mass, stiffness = basis.T @ beam.torsion_mass @ basis, basis.T @ beam.torsion_stiffness @ basis
    amplitudes = np.arange(len(stations), len(stations) + modes)
    mass[amplitudes, amplitudes] = np.maximum(1.0, squares / SHAPES_CAP**2)
    stiffness[: len(stations), len(stations) :] = stiffness[len(stations) :, : len(stations)] = 0.0
    held_mass = mass.copy()
    if twist:
        stiffness = _with_spring(stiffness, -twist.torsion, gears)
        stiffness[gears], stiffness[:, gears] = 0.0, 0.0
        held_mass[gears], held_mass[:, gears] = 0.0, 0.0
        mass += _capped(mass, twist.torsion, squares, gears)
    between, diagonal = stiffness[:gears, :gears], np.arange(gears)
    between[diagonal, diagonal] -= between.sum(axis=1)
    held_damping = np.zeros_like(stiffness)
    held_damping[amplitudes, amplitudes] = 2 * shaft.damping_ratio * np.sqrt(squares * mass[amplitudes, amplitudes])
    held_damping[:gears, :gears] = between * _damping_time(between, held_mass[:gears, :gears], shaft.damping_ratio)
    if twist:
        damping = _modal_damping(mass, _with_spring(stiffness, twist.torsion, gears), shaft.damping_ratio)
        damping = _with_spring(damping, -twist.damping, gears)
    else:
        damping = _modal_damping(mass, stiffness, shaft.damping_ratio)
    return Torsion(mass, held_mass, stiffness, damping, held_damping, modes)


def _with_spring(matrix: np.ndarray, constant: float, gears: int) -> np.ndarray:
    """A matrix (n, n) with a spring or damper between the angles of the first gear and of the end."""
    matrix, ends = matrix.copy(), np.ix_([0, gears], [0, gears])
    matrix[ends] += constant * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return matrix


def _modal_damping(mass: np.ndarray, stiffness: np.ndarray, ratio: float) -> np.ndarray:
    """(n, n) damping that gives each mode of a free body a damping ratio, and none to its turning as a whole."""
    squares, modes = scipy.linalg.eigh(stiffness, mass)
    squares[0] = 0.0
    momenta = mass @ modes
    return momenta * (2 * ratio * np.sqrt(np.maximum(squares, 0.0))) @ momenta.T


def _capped(mass: np.ndarray, torsion: float, squares: np.ndarray, gears: int) -> np.ndarray:
    """Further mass (n, n) of the twist towards a free end and of modes: it lowers frequencies above the cap to the cap.

    It acts on the twist alone, so that it does not add to the inertia of the shaft.
    """
    of_twist = np.eye(len(mass))[gears:]
    of_twist[0, 0] = -1.0
    part = mass[gears:, gears:]
    high, modes = scipy.linalg.eigh(np.diag(np.r_[torsion, squares]), part)
    momenta = of_twist.T @ part @ modes
    return momenta @ np.diag(np.maximum(high / SHAPES_CAP**2 - 1, 0.0)) @ momenta.T


def _damping_time(stiffness: np.ndarray, mass: np.ndarray, ratio: float) -> float:
    """Damping over stiffness [s] that gives the lowest elastic mode a damping ratio; 0 without one."""
    squares = scipy.linalg.eigvalsh(stiffness, mass)[1:]
    return 2 * ratio / float(np.sqrt(squares[0])) if squares.size else 0.0


def _orthogonal(vectors: np.ndarray, rigid: np.ndarray, mass: np.ndarray, stiffness: np.ndarray) -> Shapes:
    """Orthogonal shapes that span vectors less their rigid motion."""
    elastic = vectors - rigid @ np.linalg.solve(rigid.T @ mass @ rigid, rigid.T @ (mass @ vectors))
    elastic = elastic / np.sqrt(np.einsum("ij,ij->j", elastic, mass @ elastic))
    weights, combinations = np.linalg.eigh(elastic.T @ mass @ elastic)
    kept = weights > DEPENDENT * weights[-1]
    basis = elastic @ (combinations[:, kept] / np.sqrt(weights[kept]))
    squares, turned = scipy.linalg.eigh(basis.T @ stiffness @ basis)
    return Shapes(basis @ turned, squares)


def _polar(beam: Beam, centre: float, bending: Shapes, size: int) -> np.ndarray:
    """(5 + m, 5 + m) gyroscopic moments per speed over the decoupled coordinates."""
    basis, n = np.column_stack([beam.rigid_bending(centre), bending.values]), bending.squares.size
    inertia, polar = basis.T @ beam.polar @ basis, np.zeros((size, size))
    indices = [[*(c for c, _ in plane), *range(RIGID + i * n, RIGID + (i + 1) * n)] for i, plane in enumerate(PLANES)]
    signs = [np.r_[[s for _, s in plane], np.ones(n)] for plane in PLANES]
    coupling = signs[0][:, None] * inertia * signs[1]
    polar[np.ix_(*indices)], polar[np.ix_(indices[1], indices[0])] = coupling, -coupling.T
    return polar
