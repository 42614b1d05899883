"""Measures of a mesh at coordinates of its gearbox: phase and offsets, with their slopes by the coordinates."""

from typing import NamedTuple

import numpy as np

from exugear.contact_geometry.contact_records import is_spatial
from exugear.contact_geometry.reference_configuration import phase_of
from exugear.contact_geometry.relative_position import position_of
from exugear.force_table.layout import OFFSETS
from exugear.force_table.patches import phase_cell
from exugear.force_table.potential import potential
from exugear.system.model import Mesh, Model
from fem.support.numba_cache import kept

#: Step of differences in the coordinates [m, rad].
STEP = 1e-6


class Measures(NamedTuple):
    """Phase of the driving flank, and offsets by name with the signs of the map; none of gears that only spin."""

    phase: float
    offsets: dict[str, float]


@kept
def spatial_measures(table, frame, q_1, q_2):
    """(phase of the driving flank, a [m], misalignment [rad], axial [m]) of two Rxyz bodies."""
    position = position_of(table, frame, q_1, q_2)
    phase = position.flank.phase if position.flank.side > 0.0 else table.back_phase - position.flank.phase
    a, misalignment, axial = position.offsets
    return phase, a, misalignment, axial


@kept
def static_at(table, phase, deflection):
    """`exugear.force_table.potential.Potential` of a flank without offsets."""
    return potential(table, 0, phase_cell(table, phase), deflection, 0.0)


def measures_of(model: Model, mesh: Mesh, q: np.ndarray) -> tuple[np.ndarray, Measures]:
    """Rows (2, n_coordinates) of phase and misalignment, and the measures at coordinates q."""
    rows, shafts = np.zeros((2, q.size)), (mesh.stage.fast, mesh.stage.slow)
    per_radian = float(mesh.frame.direction * mesh.frame.pitches_per_radian)
    if not is_spatial(mesh.frame):
        pinion = model.spins[shafts[0].name]
        rows[0, pinion] = per_radian
        return rows, Measures(phase_of(mesh.frame, float(q[pinion])), {})
    components = [model.plan.shafts[shaft.name].components for shaft in shafts]
    indices = [
        model.spins[shaft.name] + 1 - len(part) + np.arange(len(part))
        for shaft, part in zip(shafts, components, strict=True)
    ]

    def at(coordinates: np.ndarray) -> np.ndarray:
        displacements = np.zeros((2, 6))
        for displacement, part, index in zip(displacements, components, indices, strict=True):
            displacement[part] = coordinates[index]
        bodies = (tuple(row) for row in displacements.tolist())
        return np.array(spatial_measures(mesh.law.table.head, mesh.frame, *bodies))

    for index in np.concatenate(indices):
        step = np.zeros_like(q)
        step[index] = STEP
        rows[:, index] = ((at(q + step) - at(q - step)) / (2 * STEP))[[0, 2]]
    phase, *offsets = at(q).tolist()
    return rows, Measures(phase, dict(zip(OFFSETS, offsets, strict=True)))
