"""Measures of a mesh at coordinates of its gearbox: phase and offsets, with their slopes by the coordinates."""

from collections.abc import Callable
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from exugear.contact.reference_configuration import is_spatial, phase_of
from exugear.contact.relative_position import position_of
from exugear.mesh_force.force_kernels import static_force
from exugear.mesh_force.patches import phase_cell
from exugear.mesh_force.potential import potential
from exugear.multibody.model import Mesh, Model, gear_spin
from fem.support.numba_cache import kept

#: Steps of first and of second differences in the coordinates [m, rad].
STEP, LONG_STEP = 1e-6, 1e-4


class Measures(NamedTuple):
    """DTE [m], phase of the driving flank, offsets by name as the map counts them; none if gears only spin."""

    dte: float
    phase: float
    offsets: dict[str, float]


@kept
def spatial_measures(table, frame, side, q_1, q_2):
    """(deflection of the loaded flank, phase of the driving flank, misalignment, DTE, a, axial) of two Rxyz bodies.

    side   of the loaded flank, +1 or -1; its deflection [m], as the DTE [m], but for its sign and the backlash
    """
    position = position_of(table, frame, q_1, q_2)
    a, misalignment, axial = position.offsets
    of_flank, dte = position.advance - side * position.opening, position.advance - position.opening
    return of_flank, position.phase, misalignment, dte, a, axial


@kept
def static_at(table, phase, deflection, lever):
    """`exugear.mesh_force.potential.Potential` of a flank; lever: misalignment beside that of the table [rad]."""
    return potential(table, 0, phase_cell(table, phase), deflection, lever)


@kept
def tilting_stiffness_at(table, at_offsets, phase, deflection, offsets):
    """Stiffness [N m/rad] by which the potential of a flank grows over the misalignment beyond its first-order law.

    table, at_offsets   heads of a law over the misalignment, and of that law at the offsets a, misalignment, axial
    """
    a, misalignment, axial = offsets
    rise = 0.0
    for side in (-1.0, 1.0):
        tilted = static_force(table, phase, deflection, a, misalignment + side * STEP, axial)
        first_order = potential(at_offsets, 0, phase_cell(at_offsets, phase), deflection, side * STEP)
        rise += side * (tilted.by_misalignment - first_order.by_lever)
    return rise / (2 * STEP)


def measures_of(model: Model, mesh: Mesh, side: float, q: np.ndarray) -> tuple[np.ndarray, Measures]:
    """Rows (4, n_coordinates) of deflection, phase, misalignment and DTE, and the measures at coordinates q.

    side   of the loaded flank, +1 or -1, whose deflection is meant: the centre distance opens it against the DTE of the
           back flank
    """
    if not is_spatial(mesh.frame):
        return _measures_of_spins(model, mesh, q)
    at, indices = _measured(model, mesh, side)
    rows = np.zeros((4, q.size))
    for index in indices:
        step = STEP * np.eye(q.size)[index]
        rows[:, index] = ((at(q + step) - at(q - step)) / (2 * STEP))[:4]
    _, phase, misalignment, dte, a, axial = at(q).tolist()
    return rows, Measures(dte, phase, {"a": a, "misalignment": misalignment, "axial": axial})


def curvature_of(model: Model, mesh: Mesh, side: float, q: np.ndarray) -> np.ndarray:
    """(n_coordinates, n_coordinates) second derivatives of the deflection of the loaded flank, as `measures_of`."""
    curvature = np.zeros((q.size, q.size))
    if not is_spatial(mesh.frame):
        return curvature
    at, indices = _measured(model, mesh, side)
    steps = LONG_STEP * np.eye(q.size)
    for i, j in combinations_with_replacement(indices, 2):
        corners = ((a * b, at(q + a * steps[i] + b * steps[j])[0]) for a in (-1, 1) for b in (-1, 1))
        curvature[i, j] = curvature[j, i] = sum(sign * deflection for sign, deflection in corners) / (4 * LONG_STEP**2)
    return curvature


def _measured(model: Model, mesh: Mesh, side: float) -> tuple[Callable[[np.ndarray], np.ndarray], np.ndarray]:
    """Measures of a mesh in space, as `spatial_measures`, by the coordinates; indices of those that they depend on."""
    shafts = mesh.stage.fast, mesh.stage.slow
    components = [model.plan.shafts[shaft.name].components for shaft in shafts]
    spins = [gear_spin(model, mesh.stage, shaft) for shaft in shafts]
    indices = [spin + np.arange(1 - len(part), 1) for spin, part in zip(spins, components, strict=True)]
    carrier = _carrier_of_spins(model, mesh)

    def at(coordinates: np.ndarray) -> np.ndarray:
        displacements = np.zeros((2, 6))
        for displacement, part, index in zip(displacements, components, indices, strict=True):
            displacement[part] = coordinates[index]
        displacements[:, 5] -= coordinates[carrier].sum()
        bodies = (tuple(row) for row in displacements.tolist())
        return np.array(spatial_measures(mesh.law.table.head, mesh.frame, side, *bodies))

    return at, np.concatenate([*indices, np.array(carrier, int)])


def _carrier_of_spins(model: Model, mesh: Mesh) -> list[int]:
    """Index of the spin of the carrier on which both gears only spin; empty without one, and of planets on pins."""
    carrier = mesh.stage.carrier
    if carrier is None or carrier.name in model.gearbox.carriers_of_pins:
        return []
    return [model.spins[carrier.name]]


def without_rings(model: Model, row: np.ndarray) -> np.ndarray:
    """A row over the coordinates of a gearbox in which elastic rings are rigid."""
    rigid = row.copy()
    for ring in model.rings.values():
        rigid[ring.indices] = 0.0
    return rigid


def _measures_of_spins(model: Model, mesh: Mesh, q: np.ndarray) -> tuple[np.ndarray, Measures]:
    """As `measures_of`, of gears that only spin about ideal axes."""
    rows, pinion = np.zeros((4, q.size)), model.spins[mesh.stage.fast.name]
    carrier, cycles = _carrier_of_spins(model, mesh), mesh.frame.direction * mesh.frame.pitches_per_radian
    rows[0] = rows[3] = without_rings(model, mesh.row)
    rows[1, pinion], rows[1, carrier] = cycles, -cycles
    return rows, Measures(float(rows[0] @ q), phase_of(mesh.frame, float(q[pinion] - q[carrier].sum())), {})
