"""From a table of forces to the array that the kernels of `exugear.mesh_force.force_kernels` read."""

import numpy as np
import scipy

from exugear.mesh_force.force_kernels import HEADER, LAST_FORCE, LAST_STIFFNESS, OFFSETS
from exugear.mesh_force.pchip import monotone_cubic
from fem.support.validation import require
from fem.units import um

PHASES = 512
#: With offsets there are many blocks, which need fewer phases for the same size.
PHASES_WITH_OFFSETS = 256
PENETRATIONS = 64
DAMPING_RAMP = 1 * um
U = np.linspace(0, 1, PENETRATIONS + 1)


def tabulate(force) -> tuple[np.ndarray, float]:
    """The kernels' numbers for a `MeshForce` and its largest tangent stiffness [N/m]."""
    phase, shape = force.phase, force.force_table.shape
    places = int(np.prod(shape[:-2], dtype=int))
    kept = np.allclose(phase, np.arange(phase.size) / phase.size, atol=1e-9)
    n = phase.size if kept else 2 * PHASES
    deflection, centroid = (np.broadcast_to(x, shape) for x in (force.deflection, force.centroid))
    tables = [x.reshape(places, *shape[-2:]) for x in (deflection, force.force_table, centroid)]
    blocks, tangents, lasts, jams = zip(
        *(_block(phase, n, x, force.conserves) for x in zip(*tables, strict=True)), strict=True
    )
    room = f"backlash must be >= {max(jams):.4g} m, or the unloaded error jams the teeth, got {force.backlash}"
    require(force.backlash >= max(jams) - 1e-9, room)
    axes = [np.atleast_1d(force.offsets.get(name, np.nan)) for name in OFFSETS]
    size = HEADER + places * blocks[0].size
    header = np.zeros(HEADER)
    scalars = n, PENETRATIONS, force.backlash, force.damping, DAMPING_RAMP, force.back_phase
    total = size + sum(axis.size for axis in axes)
    numbers = (*scalars, total, blocks[0].size, size, force.conserves, *(axis.size for axis in axes))
    header[: len(numbers)] = numbers
    header[[LAST_FORCE, LAST_STIFFNESS]] = tables[1][..., -1].mean(), np.mean(lasts)
    return np.concatenate([header, *blocks, *axes]), max(tangents)


def _block(phase, n: int, tables, conserves: bool) -> tuple[np.ndarray, float, float, float]:
    """One block from deflection, force and centroid over phase; largest and last tangent stiffness [N/m]; its jam [m].

    Below the jam the backlash makes the teeth jam.
    """
    over = _potential if conserves else _stiffness
    rows = [_over_penetration(d, f, c, over) for d, f, c in zip(*tables, strict=True)]
    start, largest, k, k_u, tangent, middle = (np.array(column) for column in zip(*rows, strict=True))
    uniform = np.arange(n) / n
    edge = np.stack([*_periodic(phase, start, uniform), *_periodic(phase, largest, uniform)], axis=-1)
    (k, k_p), (k_u, k_pu) = _periodic(phase, k, uniform), _periodic(phase, k_u, uniform)
    tangent = _periodic(phase, tangent, uniform)[0]
    patches = np.stack([k, k_p, k_u, k_pu], axis=-1)
    middle = _periodic(phase, middle, uniform)[0]
    block = np.concatenate([edge.ravel(), patches.ravel(), middle.ravel()])
    return block, float(tangent.max()), float(tangent[:, -1].mean()), -2 * edge[:, 0].min()


def _over_penetration(deflection: np.ndarray, force: np.ndarray, centroid: np.ndarray, over):
    """Unloaded deflection, largest penetration, and over uniform u what `over` gives, its slope, dF/d, centroid."""
    contact = int(np.flatnonzero(force == 0)[-1])
    start, largest = deflection[contact], deflection[-1] - deflection[contact]
    penetration, force = deflection[contact + 1 :] - start, force[contact + 1 :]
    k = force / penetration
    u, k = np.r_[0, (penetration / largest) ** 0.25], np.r_[k[0], k]
    secant, slope = monotone_cubic(u, k, U)
    values, slopes = over(u, k, secant, slope)
    middle, _ = monotone_cubic(u, np.r_[centroid[contact + 1], centroid[contact + 1 :]], U)
    return start, largest, values, slopes / PENETRATIONS, secant + 0.25 * U * slope, middle


def _stiffness(u, k, secant, slope) -> tuple[np.ndarray, np.ndarray]:
    """Secant stiffness and its slope over u."""
    return secant, slope


def _potential(u, k, secant, slope) -> tuple[np.ndarray, np.ndarray]:
    """w = U / penetration^2 and its slope over u, with U the work of the force: w = 4 / u^8 integral of k u^7."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 / PENETRATIONS
    at = (U[:-1] + half)[:, None] + half * nodes
    stiffness = monotone_cubic(u, k, at.ravel())[0].reshape(at.shape)
    work = 4 * np.cumsum((stiffness * at**7) @ weights * half)
    w = np.r_[secant[0] / 2, work / U[1:] ** 8]
    return w, np.r_[0.0, 4 * (secant - 2 * w)[1:] / U[1:]]


def _periodic(phase: np.ndarray, values: np.ndarray, uniform: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes per step at the uniform phases, monotone between the given ones (axis 0)."""
    wrapped = np.r_[phase - 1, phase, phase + 1]
    curve = scipy.interpolate.PchipInterpolator(wrapped, np.r_[values, values, values])
    return curve(uniform), curve(uniform, 1) / uniform.size
