"""A shaft in statics: stiffness between the points where gears, bearings and torques act, exact for its beam.

Coordinates of an elastic shaft are displacement and rotation, 6 each, of its kept points; the nodes of the beam between
them carry no load, so that they follow (static condensation, Guyan, AIAA J. 3, 1965). Under its weight all nodes are
kept. Coordinates of a rigid shaft are the 6 of its centre of mass. A shaft without bearings only turns and twists.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exugear.gearbox.beam import Beam
from exugear.gearbox.elastic_shaft import PLANES, rigid_motion
from exugear.gearbox.shaft import Shaft, beam_through

#: Components of the motion along and about the axis.
AXIAL, SPIN = 2, 5


@dataclass(frozen=True, eq=False)
class StaticShaft:
    """Stiffness (n, n) of a shaft over its coordinates, and its motion by them.

    shaft       the shaft
    points      (m,) axial positions of the kept points [m]; of a rigid shaft its centre of mass
    stiffness   (n, n), n = 6 m
    free        (n,) whether a coordinate moves
    nodes       (n_node,) axial positions [m] at which `motions` tells the motion
    motions     (n_node, 6, n) motion of the nodes by the coordinates
    load        (n,) external forces and weight on the coordinates; unbalance turns with the shaft and has no part in it
    """

    shaft: Shaft
    points: np.ndarray
    stiffness: np.ndarray
    free: np.ndarray
    nodes: np.ndarray
    motions: np.ndarray
    load: np.ndarray

    def motion_at(self, axial: float) -> np.ndarray:
        """(6, n) motion by the coordinates at a kept point [m], or rigidly beyond the ends of the shaft."""
        number = int(np.abs(self.points - axial).argmin())
        motion = np.zeros((6, self.free.size))
        motion[:, 6 * number : 6 * number + 6] = rigid_motion(axial - float(self.points[number]))
        return motion

    @property
    def turned(self) -> np.ndarray:
        """(6, n) motion of the point on which drive or load act."""
        return self.motion_at(self.shaft.end_position if self.shaft.sections else self.shaft.centre)


def static_shaft(shaft: Shaft, axial: Sequence[float]) -> StaticShaft:
    """The shaft with kept points at its parts, at its end, and at further axial positions [m]."""
    if not shaft.sections:
        points = np.array([shaft.centre])
        nodes = np.unique([*shaft.parts, *axial, shaft.centre])
        motions = np.array([rigid_motion(x - shaft.centre) for x in nodes])
        return StaticShaft(shaft, points, np.zeros((6, 6)), _free(shaft, 1), nodes, motions, shaft.constant_load)
    beam = beam_through(shaft, [*axial])
    wanted = np.array([*shaft.parts, *shaft.stations, shaft.end_position, *axial])
    wanted = beam.axial if any(shaft.gravity) else wanted
    kept = np.unique(np.abs(beam.axial[:, None] - wanted).argmin(axis=0))
    stiffness, motions = _condensed(beam, kept)
    load = np.einsum("ki,kij->j", _on_nodes(shaft, beam), motions)
    return StaticShaft(shaft, beam.axial[kept], stiffness, _free(shaft, kept.size), beam.axial, motions, load)


def _on_nodes(shaft: Shaft, beam: Beam) -> np.ndarray:
    """(n_node, 6) external forces and weight on the nodes of an elastic shaft."""
    loads = np.zeros((beam.axial.size, 6))
    for axial, force in shaft.forces:
        loads[beam.node(axial)] += force.wrench
    of_weight = beam.bending_mass @ beam.rigid_bending(shaft.centre)[:, 0]
    for components, acceleration in zip(PLANES, shaft.gravity[:2], strict=True):
        for i, (component, sign) in enumerate(components):
            loads[:, component] += sign * acceleration * of_weight[i::2]
    loads[:, AXIAL] += shaft.gravity[2] * beam.tension_mass.sum(axis=1)
    return loads


def _free(shaft: Shaft, points: int) -> np.ndarray:
    """(6 points,) whether each coordinate moves: without bearings the spin alone."""
    free = np.full((points, 6), bool(shaft.bearings))
    free[:, SPIN] = True
    return free.ravel()


def _condensed(beam: Beam, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness (6 m, 6 m) between kept nodes (m,), and motion (n_node, 6, 6 m) of all nodes by theirs."""
    n, m = beam.axial.size, kept.size
    stiffness, motions = np.zeros((6 * m, 6 * m)), np.zeros((n, 6, 6 * m))
    both = np.ravel(2 * kept[:, None] + np.arange(2))
    bending, shapes = _schur(beam.bending_stiffness, both)
    for components in PLANES:
        numbers = np.ravel([[6 * k + component for component, _ in components] for k in range(m)])
        signs = np.tile([sign for _, sign in components], m)
        stiffness[np.ix_(numbers, numbers)] += np.outer(signs, signs) * bending
        for i, (component, sign) in enumerate(components):
            motions[:, component, numbers] = sign * shapes[i::2] * signs
    for component, matrix in ((AXIAL, beam.tension_stiffness), (SPIN, beam.torsion_stiffness)):
        numbers = 6 * np.arange(m) + component
        along, shapes = _schur(matrix, kept)
        stiffness[np.ix_(numbers, numbers)] += along
        motions[:, component, numbers] = shapes
    return stiffness, motions


def _schur(matrix: np.ndarray, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness between kept coordinates, and all coordinates by them where nothing loads the others."""
    others = np.setdiff1d(np.arange(len(matrix)), kept)
    shapes = np.zeros((len(matrix), kept.size))
    shapes[kept, np.arange(kept.size)] = 1.0
    if others.size:
        shapes[others] = np.linalg.solve(matrix[np.ix_(others, others)], -matrix[np.ix_(others, kept)])
    reduced = matrix[kept] @ shapes
    return (reduced + reduced.T) / 2, shapes
