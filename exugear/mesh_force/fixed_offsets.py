"""A mesh force at fixed values of offsets, sampled over phase and deflection."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from exugear.mesh_force.force_kernels import blended, centroid_of, contact_at
from exugear.mesh_force.layout import OFFSETS, U
from exugear.mesh_force.patches import phase_cell
from exugear.mesh_force.potential import extent_of, potential
from exugear.mesh_force.tabulation import uniform_phases
from fem.support.numba_cache import kept

#: Steps of Newton's iteration for the deflection at the largest force.
ITERATIONS = 20


def at_fixed_offsets(force, fixed: Mapping[str, float]) -> dict[str, Any]:
    """Phase, deflection, force_table and centroid of a `MeshForce` at fixed values of offsets, by name.

    Raises the kernels' ValueError(x, low, high, number of the axis) beyond an axis.
    """
    axes = {name: values for name, values in force.offsets.items() if name not in fixed}
    grid = np.meshgrid(*axes.values(), indexing="ij")
    values = {**dict(zip(axes, (x.ravel() for x in grid), strict=True)), **fixed}
    number = grid[0].size if grid else 1
    offsets = np.array([np.broadcast_to(values.get(name, 0.0), number) for name in OFFSETS]).T.copy()
    pitches = force.pitches if force.teeth is None else 1
    phase = uniform_phases(force.table.edges.shape[-1], pitches)
    deflection, forces, centroid = _sampled()(force.table.head, phase, offsets, U**4)
    shape = (*(axis.size for axis in axes.values()), phase.size, U.size)
    deflection, forces, centroid = (x.reshape(shape) for x in (deflection, forces, centroid))
    # Where only the farther of two misalignments has contact, its weight vanishes towards the nearer one before the
    # slope of the weight does: so does the force before the moment, and their quotient leaves the face.
    centroid = np.clip(centroid, np.min(force.centroid), np.max(force.centroid))
    return {"phase": phase, "deflection": deflection, "force_table": _rising(forces), "centroid": centroid}


def blocks_of(force, phase: np.ndarray) -> dict[str, Any]:
    """deflection, force_table and centroid of all offsets of a law, sampled at phases (n,)."""
    counts = [axis.size for axis in force.offsets.values()]
    number = int(np.prod(counts))
    arrays = np.array(_of_blocks()(force.table.head, number, phase, U**4)).reshape(3, *counts, phase.size, U.size)
    return {"deflection": arrays[0], "force_table": arrays[1], "centroid": arrays[2]}


@cache
def _of_blocks():
    """The compiled function (table, number of blocks, phases, shares) -> (3, n, n_phase, n_share) as `_sampled`."""

    @kept
    def of_blocks(table, number, phase, share):
        result = np.zeros((3, number, phase.size, share.size))
        for i in range(number):
            for j in range(phase.size):
                cell = phase_cell(table, phase[j])
                extent = extent_of(table, i, cell)
                for k in range(share.size):
                    u = potential(table, i, cell, extent.unloaded + share[k] * extent.largest, 0.0)
                    result[0, i, j, k] = extent.unloaded + share[k] * extent.largest
                    if k > 0:
                        result[1, i, j, k], result[2, i, j, k] = u.force, -u.by_lever / u.force
                result[2, i, j, 0] = result[2, i, j, 1]
        return result

    return of_blocks


def _rising(forces: np.ndarray) -> np.ndarray:
    """Forces that rise from contact on: 0 up to the last deflection at which they do not, or pull.

    Polynomials over centre distance and axial offset undershoot beside the loss of contact.
    """
    falling = np.concatenate([forces[..., :1] <= 0, np.diff(forces) <= 0], axis=-1) | (forces <= 0)
    return np.where(np.flip(np.maximum.accumulate(np.flip(falling, -1), axis=-1), -1), 0.0, forces)


@cache
def _sampled():
    """The compiled function (table, phases, offsets (n, 3), shares) -> deflection, force, centroid.

    These are arrays (n, n_phase, n_share); the shares are those of the deflection from contact to the largest force.
    """

    @kept
    def sampled(table, phase, offsets, share):
        shape = (offsets.shape[0], phase.size, share.size)
        deflection, force, centroid = np.empty(shape), np.empty(shape), np.empty(shape)
        for i in range(offsets.shape[0]):
            a, misalignment, axial = offsets[i]
            for j in range(phase.size):
                contact, end = contact_at(table, phase[j], a, misalignment, axial)
                for _ in range(ITERATIONS):
                    static, limit = blended(table, phase[j], end, a, misalignment, axial)
                    end -= (static.force - limit) / static.stiffness
                for k in range(share.size):
                    y = contact + share[k] * (end - contact)
                    static, limit = blended(table, phase[j], y, a, misalignment, axial)
                    deflection[i, j, k], force[i, j, k], centroid[i, j, k] = y, static.force, centroid_of(static)
                force[i, j, 0] = 0.0
                centroid[i, j, 0] = centroid[i, j, 1]
        return deflection, force, centroid

    return sampled
