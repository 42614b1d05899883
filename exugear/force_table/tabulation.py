"""The table of a mesh force, computed from forces over phase and deflection."""

from typing import NamedTuple

import numpy as np
import scipy

from exugear.force_table.kernel_records import record_of
from exugear.force_table.layout import (
    EDGE,
    FORCE_TABLE,
    NODE,
    OFFSETS,
    PENETRATIONS,
    PHASES,
    U,
    start_of_field,
    table_type,
)
from exugear.force_table.pchip import monotone_cubic
from fem.support.validation import require
from fem.units import um

#: Penetration over which the damping ramps in [m].
DAMPING_RAMP = 1 * um


class PhaseCurves(NamedTuple):
    """A law at one phase, or at all phases along the first axis; value and the following are arrays over `U`.

    unloaded   deflection at which the flanks touch [m]
    largest    penetration at the end of the table [m]
    value      of the nodes [N/m], and by_u its slope per step of u
    tangent    tangent stiffness [N/m]
    centroid   axial force centroid [m]
    """

    unloaded: np.ndarray
    largest: np.ndarray
    value: np.ndarray
    by_u: np.ndarray
    tangent: np.ndarray
    centroid: np.ndarray


def tabulate(force) -> np.record:
    """The table of a `MeshForce`; ValueError where its backlash jams the teeth."""
    phase, shape = force.phase, force.force_table.shape
    uniform = np.allclose(phase, np.arange(phase.size) / phase.size, atol=1e-9)
    phase_steps = phase.size if uniform else 2 * PHASES
    axes = {name: np.atleast_1d(force.offsets.get(name, np.nan)) for name in OFFSETS}
    kind = table_type(tuple(axis.size for axis in axes.values()), phase_steps)
    deflection, centroid = (np.broadcast_to(x, shape) for x in (force.deflection, force.centroid))
    rows = [x.reshape(-1, *shape[-2:]) for x in (deflection, force.force_table, centroid)]
    blocks = [_block(phase, phase_steps, force.conserves, *tables) for tables in zip(*rows, strict=True)]
    edges, nodes, centroids, tangents = (np.array(column) for column in zip(*blocks, strict=True))
    jam = -2 * edges["unloaded"].min()
    least = f"backlash must be >= {jam:.4g} m, or the unloaded transmission error jams the teeth, got {force.backlash}"
    require(force.backlash >= jam - 1e-9, least)
    head = record_of(
        FORCE_TABLE,
        **{name: getattr(force, name) for name in ("conserves", "backlash", "back_phase", "damping")},
        damping_ramp=DAMPING_RAMP,
        phase_steps=phase_steps,
        penetration_steps=PENETRATIONS,
        offset_counts=[axis.size for axis in axes.values()],
        last_force=force.force_table[..., -1].mean(),
        last_stiffness=tangents[..., -1].mean(),
        largest_stiffness=tangents.max(),
        axes_start=[start_of_field(kind, name) for name in OFFSETS],
        **{f"{name}_start": start_of_field(kind, name) for name in ("edges", "nodes", "centroids")},
    )
    arrays = {"edges": edges, "nodes": nodes, "centroids": centroids}
    shaped = {name: values.reshape(1, *kind[name].shape) for name, values in arrays.items()}
    return record_of(kind, head=head, **axes, **shaped)


def _block(phase, phase_steps: int, conserves: bool, deflection, force, centroid) -> tuple[np.ndarray, ...]:
    """Edges (phase_steps,), nodes, centroids and tangent stiffnesses (phase_steps, U.size) at one value of the offsets.

    deflection, force, centroid   (n_phase, n_deflection) over the given phases
    """
    node_values = _potential if conserves else _stiffness
    rows = [_curves_at_phase(*columns, node_values) for columns in zip(deflection, force, centroid, strict=True)]
    curves = PhaseCurves(*(np.array(column) for column in zip(*rows, strict=True)))
    uniform = np.arange(phase_steps) / phase_steps
    edges, nodes = np.empty(phase_steps, EDGE), np.empty((phase_steps, U.size), NODE)
    edges["unloaded"], edges["unloaded_slope"] = _periodic(phase, curves.unloaded, uniform)
    edges["largest"], edges["largest_slope"] = _periodic(phase, curves.largest, uniform)
    nodes["value"], nodes["by_phase"] = _periodic(phase, curves.value, uniform)
    nodes["by_u"], nodes["by_phase_u"] = _periodic(phase, curves.by_u, uniform)
    tangent, centroids = (_periodic(phase, x, uniform)[0] for x in (curves.tangent, curves.centroid))
    return edges, nodes, centroids, tangent


def _curves_at_phase(deflection: np.ndarray, force: np.ndarray, centroid: np.ndarray, node_values) -> PhaseCurves:
    """The curves at one phase; node_values: function from the secant stiffness to values and slopes over u."""
    contact = int(np.flatnonzero(force == 0)[-1])
    unloaded, largest = deflection[contact], deflection[-1] - deflection[contact]
    penetration, force = deflection[contact + 1 :] - unloaded, force[contact + 1 :]
    k = force / penetration
    u, k = np.r_[0, (penetration / largest) ** 0.25], np.r_[k[0], k]
    secant, slope = monotone_cubic(u, k, U)
    values, slopes = node_values(u, k, secant, slope)
    at_nodes, _ = monotone_cubic(u, np.r_[centroid[contact + 1], centroid[contact + 1 :]], U)
    return PhaseCurves(unloaded, largest, values, slopes / PENETRATIONS, secant + 0.25 * U * slope, at_nodes)


def _stiffness(u, k, secant, slope) -> tuple[np.ndarray, np.ndarray]:
    """Secant stiffness and its slope over u, as they are."""
    return secant, slope


def _potential(u, k, secant, slope) -> tuple[np.ndarray, np.ndarray]:
    """w = W / penetration^2 and its slope over u, with W the work of the force: w = 4 / u^8 integral of k u^7."""
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
