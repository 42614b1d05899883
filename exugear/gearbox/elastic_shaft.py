"""A shaft with a few elastic coordinates: its beam reduced to the shapes that its gears and bearings excite.

Decoupled coordinates are the motion of the rigid shaft, x, y, z and rotations about x, y, z at its centre of mass, and
amplitudes of elastic shapes. In bending the shapes span, in each of the two planes, the static deflections on the
bearings under a force and a moment at each gear, and a force at each nonlinear bearing, and the lowest modes on the
bearings beyond the two in which the shaft moves as a rigid body; in tension the static displacements; in torsion the
twist between gears. Less their rigid motion, and orthogonal to one another in mass and stiffness, they leave diagonal
matrices. The static compliance is exact.

Shapes of high frequency count by their compliance alone: their mass is raised until the frequency is that of the cap,
so that the steps of a run are those of rigid shafts.

In a run the coordinates of each gear are those of a body of its own, and the remaining amplitudes those of a further
node. A body stands for its gear as if the shaft were rigid from there on: its coordinates at the centre of mass are
q = r + R(z)^-1 shapes(z) a, with the rigid motion R(z) r and the amplitudes a. The frame does not turn, so that all
matrices are constant. Gyroscopic moments are skew-symmetric and proportional to the speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import NamedTuple

import numpy as np
import scipy

from exugear.gearbox.beam import Beam, twist_shapes
from exugear.gearbox.bearing_law import linear_part, radial_secant
from exugear.gearbox.shaft import Shaft

#: Iterations for the secant stiffness of nonlinear bearings.
ITERATIONS = 30
#: Angular frequency up to which shapes keep their mass [rad/s].
CAP = 2 * pi * 15e3
#: Share of the largest eigenvalue of the scaled Gram matrix below which shapes depend on one another.
DEPENDENT = 1e-9
#: Modes on bearings in which the shaft moves as a rigid body, in each plane.
RIGID_MODES = 2
#: Signs of displacement and rotation in the planes (x, tilt_y) and (y, -tilt_x), and their components.
PLANES = (((0, 1.0), (4, 1.0)), ((1, 1.0), (3, -1.0)))


class Shapes(NamedTuple):
    """Elastic shapes of one kind, orthogonal in mass and stiffness: over the coordinates of a beam, modal mass 1.

    values    (n_coordinate, m)
    squares   (m,) squared angular frequencies [rad^2/s^2]
    """

    values: np.ndarray
    squares: np.ndarray


@dataclass(frozen=True, eq=False)
class ElasticShaft:
    """A shaft by decoupled coordinates, 6 rigid and m elastic ones, and by those of its n_gear bodies and of a node.

    shaft       the shaft
    modes       number of bending modes in each plane, beside the static shapes
    shapes      (n_node, 6, m) motion of each node of the beam by the elastic coordinates
    inertia     (6 + m,) of the decoupled coordinates [kg, kg m^2]
    stiffness   (m,) of the elastic coordinates
    damping     (m,) likewise
    polar       (6 + m, 6 + m) gyroscopic moments per speed, skew-symmetric
    """

    shaft: Shaft
    modes: int
    shapes: np.ndarray
    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    polar: np.ndarray

    @property
    def size(self) -> int:
        """Number of decoupled coordinates, as many as those of the bodies and of the further node together."""
        return self.inertia.size

    @property
    def elastic(self) -> int:
        """Number of elastic coordinates."""
        return self.stiffness.size

    @property
    def further(self) -> int:
        """Number of coordinates of the further node."""
        return self.size - 6 * len(self.shaft.stations)

    def shapes_at(self, axial: float) -> np.ndarray:
        """(6, m) motion at an axial position with a node [m] by the elastic coordinates."""
        return self.shapes[self.shaft.beam.node(axial)]

    def motion_at(self, axial: float) -> np.ndarray:
        """(6, 6 + m) motion at an axial position with a node [m] by the decoupled coordinates."""
        return np.hstack([rigid_motion(axial - self.shaft.centre), self.shapes_at(axial)])

    def of_body(self, axial: float) -> np.ndarray:
        """(6, 6 + m) coordinates of the body of a gear by the decoupled coordinates."""
        return rigid_motion(self.shaft.centre - axial) @ self.motion_at(axial)

    def decoupled(self, of_body: np.ndarray, amplitudes: np.ndarray) -> np.ndarray:
        """(n, 5 + m) rigid motion without the spin and elastic coordinates, from the motion (n, 5) of the first body.

        amplitudes   (n, m) elastic coordinates; all of them may be rates
        """
        shapes = self.of_body(self.shaft.stations[0])[:5, 6:]
        return np.column_stack([of_body - amplitudes @ shapes.T, amplitudes])

    def of_first_body(self, decoupled: np.ndarray) -> np.ndarray:
        """(n, 5) motion of the first body from what `decoupled` returns."""
        return decoupled[:, :5] + decoupled[:, 5:] @ self.of_body(self.shaft.stations[0])[:5, 6:].T

    @cached_property
    def to_nodes(self) -> np.ndarray:
        """(size, size) coordinates of the bodies, in the order of `Shaft.stations`, and of the node, by decoupled ones.

        The further node has the amplitudes that move no gear against the first one.
        """
        bodies = [self.of_body(axial) for axial in self.shaft.stations]
        against_first = np.vstack([np.zeros((0, self.elastic)), *(b[:, 6:] - bodies[0][:, 6:] for b in bodies[1:])])
        _, _, rows = (
            np.linalg.svd(against_first, full_matrices=True) if len(bodies) > 1 else (0, 0, np.eye(self.elastic))
        )
        rest = rows[6 * (len(bodies) - 1) :]
        return np.vstack([*bodies, np.hstack([np.zeros((len(rest), 6)), rest])])

    @cached_property
    def from_nodes(self) -> np.ndarray:
        """(size, size) decoupled coordinates by those of the bodies and of the node."""
        return np.linalg.inv(self.to_nodes)

    def over_nodes(self, matrix: np.ndarray) -> np.ndarray:
        """A matrix over the decoupled coordinates as one over those of the bodies and of the node."""
        return self.from_nodes.T @ matrix @ self.from_nodes

    def static_displacement(self, forces: np.ndarray) -> tuple[np.ndarray, dict[float, float]]:
        """(size,) static coordinates of the bodies and of the node under forces (size,), the first body not turning.

        Also the radial force of each nonlinear bearing [N] by its axial position. Nonlinear bearings have their secant
        stiffness under their forces, beyond the end of a table that at its end.
        """
        bearings = {axial: (self.at_bearing(axial), bearing) for axial, bearing in self.shaft.bearings.items()}
        nonlinear = {axial: pair for axial, pair in bearings.items() if not pair[1].linear}
        linear = sum((rows.T @ linear_part(b, 0.0) @ rows for rows, b in bearings.values()), self.stiffness_matrix)
        secants, radial_forces = {x: float(b.stiffness[0, 0]) for x, (_, b) in nonlinear.items()}, dict.fromkeys(nonlinear, 0.0)
        free, q = np.delete(np.arange(self.size), 5), np.zeros(self.size)
        for _ in range(ITERATIONS if nonlinear else 1):
            total = linear + sum(k * bearings[x][0][:2].T @ bearings[x][0][:2] for x, k in secants.items())
            q[free] = np.linalg.solve(total[np.ix_(free, free)], forces[free])
            for x, (rows, bearing) in nonlinear.items():
                radial_forces[x] = float(secants[x] * np.hypot(*(rows[:2] @ q)))
                if radial_forces[x] > 0:
                    secants[x] = radial_secant(bearing, radial_forces[x])
        return q, radial_forces

    def at_bearing(self, axial: float) -> np.ndarray:
        """(6, size) motion at a bearing by the coordinates of the bodies and of the node."""
        return self.motion_at(axial) @ self.from_nodes

    @cached_property
    def mass_matrix(self) -> np.ndarray:
        """(size, size) mass over the coordinates of the bodies and of the node."""
        return self.over_nodes(np.diag(self.inertia))

    @cached_property
    def stiffness_matrix(self) -> np.ndarray:
        """(size, size) stiffness of the shaft itself over the coordinates of the bodies and of the node."""
        return self.over_nodes(np.diag(np.r_[np.zeros(6), self.stiffness]))

    @cached_property
    def damping_matrix(self) -> np.ndarray:
        """(size, size) damping of the shaft itself over the coordinates of the bodies and of the node."""
        return self.over_nodes(np.diag(np.r_[np.zeros(6), self.damping]))

    @cached_property
    def polar_matrix(self) -> np.ndarray:
        """(size, size) gyroscopic moments per speed over the coordinates of the bodies and of the node."""
        return self.over_nodes(self.polar)


def rigid_motion(lever: float) -> np.ndarray:
    """(6, 6) motion of a rigid body at a distance [m] along its axis by that at its pole."""
    motion = np.eye(6)
    motion[0, 4], motion[1, 3] = lever, -lever
    return motion


def elastic_shaft(shaft: Shaft, modes: int, *, axial: bool) -> ElasticShaft:
    """The shaft reduced to the static shapes and a number of bending modes in each plane.

    axial   whether forces act along the axis, by which it is stretched
    """
    beam, stations = shaft.beam, shaft.stations
    bending, tension = bending_shapes(shaft, modes), tension_shapes(shaft)
    stretched = tension if axial or len(stations) > 1 else Shapes(tension.values[:, :0], tension.squares[:0])
    torsion = torsion_shapes(shaft)
    counts = bending.squares.size, bending.squares.size, stretched.squares.size, torsion.squares.size
    first = np.cumsum([0, *counts])
    shapes = np.zeros((beam.axial.size, 6, int(first[-1])))
    for i, ((moved, sign), (tilted, tilt_sign)) in enumerate(PLANES):
        part = slice(first[i], first[i + 1])
        shapes[:, moved, part] = sign * bending.values[0::2]
        shapes[:, tilted, part] = tilt_sign * bending.values[1::2]
    shapes[:, 2, first[2] : first[3]] = stretched.values
    shapes[:, 5, first[3] :] = torsion.values
    squares = np.concatenate([bending.squares, bending.squares, stretched.squares, torsion.squares])
    masses = np.maximum(1.0, squares / CAP**2)
    rigid = [shaft.mass] * 3 + [shaft.transverse] * 2 + [shaft.body_inertia]
    damping = 2 * shaft.damping_ratio * np.sqrt(squares * masses)
    polar = _polar(beam, shaft.centre, bending, first)
    return ElasticShaft(shaft, modes, shapes, np.r_[rigid, masses], squares, damping, polar)


def bending_shapes(shaft: Shaft, modes: int) -> Shapes:
    """Shapes of bending in one plane, over displacement and slope of each node."""
    beam = shaft.beam
    stiffness = beam.supported(shaft.planar_supports)
    coordinates = [2 * beam.node(axial) + i for axial in shaft.stations for i in (0, 1)]
    coordinates += [2 * beam.node(axial) for axial, bearing in shaft.bearings.items() if not bearing.linear]
    loads = np.eye(len(stiffness))[:, coordinates]
    last = RIGID_MODES + modes - 1
    lowest = scipy.linalg.eigh(stiffness, beam.bending_mass, subset_by_index=[0, last])[1][:, RIGID_MODES:]
    vectors = np.column_stack([np.linalg.solve(stiffness, loads), lowest])
    return _orthogonal(vectors, beam.rigid_bending(shaft.centre), beam.bending_mass, beam.bending_stiffness)


def tension_shapes(shaft: Shaft) -> Shapes:
    """Shapes of tension: static displacements on the bearings under a force at each gear."""
    beam, n = shaft.beam, shaft.beam.axial.size
    stiffness, loads = beam.tension_stiffness.copy(), np.eye(n)[:, [beam.node(axial) for axial in shaft.stations]]
    for axial, bearing in shaft.bearings.items():
        stiffness[beam.node(axial), beam.node(axial)] += bearing.stiffness[2, 2]
    vectors = np.linalg.solve(stiffness, loads)
    return _orthogonal(vectors, np.ones((n, 1)), beam.tension_mass, beam.tension_stiffness)


def torsion_shapes(shaft: Shaft) -> Shapes:
    """Shapes of torsion between the gears; the end of the shaft turns on its own (`Shaft.twist`)."""
    beam, stations, end = shaft.beam, list(shaft.stations), shaft.end_position
    alone = shaft.twist is not None
    by_gears = twist_shapes(beam, [*stations, end] if alone else stations)[:, : len(stations)]
    mass, stiffness = by_gears.T @ beam.torsion_mass @ by_gears, by_gears.T @ beam.torsion_stiffness @ by_gears
    if alone:
        stiffness[0, 0] -= shaft.twist.torsion
    squares, vectors = scipy.linalg.eigh(stiffness, mass)
    values = by_gears @ vectors
    if alone:
        values += np.outer(twist_shapes(beam, [end, *stations])[:, 0], vectors[0])
    return Shapes(values[:, 1:], squares[1:])


def _orthogonal(vectors: np.ndarray, rigid: np.ndarray, mass: np.ndarray, stiffness: np.ndarray) -> Shapes:
    """Orthogonal shapes that span vectors less their rigid motion."""
    elastic = vectors - rigid @ np.linalg.solve(rigid.T @ mass @ rigid, rigid.T @ (mass @ vectors))
    elastic = elastic / np.sqrt(np.einsum("ij,ij->j", elastic, mass @ elastic))
    weights, combinations = np.linalg.eigh(elastic.T @ mass @ elastic)
    kept = weights > DEPENDENT * weights[-1]
    basis = elastic @ (combinations[:, kept] / np.sqrt(weights[kept]))
    squares, turned = scipy.linalg.eigh(basis.T @ stiffness @ basis)
    return Shapes(basis @ turned, squares)


def _polar(beam: Beam, centre: float, bending: Shapes, first: Sequence[int]) -> np.ndarray:
    """(6 + m, 6 + m) gyroscopic moments per speed over the decoupled coordinates."""
    basis = np.column_stack([beam.rigid_bending(centre), bending.values])
    inertia, polar = basis.T @ beam.polar @ basis, np.zeros((6 + first[-1],) * 2)
    indices = [[*(c for c, _ in plane), *(6 + np.arange(first[i], first[i + 1]))] for i, plane in enumerate(PLANES)]
    signs = [np.r_[[s for _, s in plane], np.ones(bending.squares.size)] for plane in PLANES]
    coupling = signs[0][:, None] * inertia * signs[1]
    polar[np.ix_(*indices)], polar[np.ix_(indices[1], indices[0])] = coupling, -coupling.T
    return polar
