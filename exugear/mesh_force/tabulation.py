"""The table of a mesh force, computed from forces over phase and deflection.

Its potential follows from the secant stiffness k over u = (penetration / largest penetration)^(1/4), linearly in the
values and slopes of k at the nodes: U = w penetration^2 with w = 4 / u^8 integral of k u^7. Force and tangent stiffness
at the nodes are those of k, as k = 2 w + u w' / 4.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.kernel_records import changed, record_of, start_of_field
from exugear.mesh_force.layout import EDGE, FORCE_TABLE, NODE, OFFSETS, PENETRATIONS, RESAMPLED, U, table_type
from exugear.mesh_force.offset_interpolation import slope_weights
from exugear.mesh_force.pchip import hermite_weights, monotone_cubics, periodic_cubics, weighted
from fem.support.validation import require

#: Fields of a `MeshForce` that the heads of its tables hold.
SCALARS = "conserves", "backlash", "back_phase", "damping", "damping_ramp"
#: Columns by which tables with offsets are extended; share of the largest penetration beyond the largest deflection.
EXTENSION, MARGIN = 4, 0.1
#: u below which a load counts as light.
LIGHT = 0.1
#: Twelvefold weights of five values in the slopes at the first two of them.
AT_THE_ENDS = (-25, 48, -36, 16, -3), (-3, -10, 18, -6, 1)
#: Number of points of Gauss's rule, exact for the polynomials here.
GAUSS_POINTS = 6


class PhaseCurves(NamedTuple):
    """A law at all phases, along the first axis.

    unloaded        deflection at which the flanks touch [m]
    largest         penetration at the end of the table [m]
    largest_force   of the law [N]
    secant          secant stiffness over `U` [N/m], and its slope per step of u
    centroid        axial force centroid over `U` [m], and its slope likewise; one column of zeros where there is none
    tangent         tangent stiffness over `U` [N/m]
    """

    unloaded: np.ndarray
    largest: np.ndarray
    largest_force: np.ndarray
    secant: np.ndarray
    secant_slope: np.ndarray
    centroid: np.ndarray
    centroid_slope: np.ndarray
    tangent: np.ndarray


def tabulate(force) -> np.record:
    """The table of a `MeshForce`, behind it that of its coast flank; ValueError where its backlash jams the teeth."""
    pitches, pairs = force.pitches, force.teeth
    tabulated = pitches if pairs is None else 1
    uniform = np.allclose(force.phase, uniform_phases(force.phase.size, tabulated), atol=1e-9)
    phase_steps = force.phase.size if uniform else RESAMPLED * tabulated
    axes = {name: np.atleast_1d(force.offsets.get(name, force.fixed_offsets.get(name, 0.0))) for name in OFFSETS}
    coast = None if force.coast is None else force.coast.table
    counts, of_coast = tuple(axis.size for axis in axes.values()), None if coast is None else coast.dtype
    teeth = None if pairs is None else pairs.table(pitches)
    of_teeth = None if teeth is None else teeth.dtype
    kind = table_type(counts, phase_steps, bool(np.any(force.centroid)), of_coast, of_teeth)
    arrays, tangents = _arrays(force, phase_steps, kind, tabulated)
    unloaded = [edges["unloaded"].min() for edges in (arrays["edges"], *([] if coast is None else [coast["edges"]]))]
    proud = [of_flank.teeth.proud for of_flank in (force, force.coast) if getattr(of_flank, "teeth", None)]
    jam = -2 * (min(unloaded) + min(proud, default=0.0))
    least = f"backlash must be >= {jam:.4g} m, or the unloaded transmission error jams the teeth, got {force.backlash}"
    remedy = "pass backlash=, or map a pair with a larger centre distance, thinner teeth or smaller deviations"
    require(force.backlash >= jam - 1e-9, f"{least}; {remedy}")
    scalars = {name: getattr(force, name) for name in SCALARS}
    stiffest = tangents.max() if coast is None else max(tangents.max(), coast.head.largest_stiffness)
    head = record_of(
        FORCE_TABLE,
        **scalars,
        side=1.0,
        coast=0 if coast is None else start_of_field(kind, "coast"),
        phase_steps=phase_steps * (pitches // tabulated),
        penetration_steps=PENETRATIONS,
        offset_counts=[axis.size for axis in axes.values()],
        has_centroid=kind["centroids"].shape != (0,),
        last_force=force.force_table[..., -1].mean(),
        last_stiffness=tangents[..., -1].mean(),
        largest_stiffness=stiffest,
        axes_start=[start_of_field(kind, name) for name in OFFSETS],
        slopes_start=[start_of_field(kind, f"{name}_slopes") for name in OFFSETS],
        **{f"{name}_start": start_of_field(kind, name) for name in ("edges", "potentials", "centroids")},
        pitches=pitches,
        per_pitches=1 / pitches,
        steps_in_pitch=phase_steps / tabulated,
        teeth=0 if teeth is None else start_of_field(kind, "teeth"),
    )
    slopes = {f"{name}_slopes": slope_weights(axis) for name, axis in axes.items()}
    behind: dict = {} if coast is None else {"coast": changed(coast, head=changed(coast.head, **scalars, side=-1.0))}
    behind |= {} if teeth is None else {"teeth": teeth}
    return record_of(kind, head=head, **axes, **slopes, **arrays, **behind)


def _arrays(force, phase_steps: int, kind: np.dtype, pitches: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Edges, potentials and centroids of all blocks, with the shapes of the table; their tangent stiffnesses [N/m].

    pitches   number over which force.phase runs
    """
    shape, largest_force = force.force_table.shape, force.force_table[..., -1]
    tables = [np.broadcast_to(x, shape) for x in (force.deflection, force.force_table, force.centroid)]
    rows = [x.reshape(-1, *x.shape[-2:]) for x in (_extended(*tables) if force.offsets else tables)]
    limits = largest_force.reshape(-1, shape[-2])
    empty = kind["centroids"].shape == (0,)
    block = partial(_block, force.phase, uniform_phases(phase_steps, pitches), pitches, has_centroid=not empty)
    blocks = [block(*columns) for columns in zip(*rows, limits, strict=True)]
    edges, potentials, centroids, tangents = (np.array(column) for column in zip(*blocks, strict=True))
    arrays = {"edges": edges, "potentials": potentials}
    shaped = {name: values.reshape(1, *kind[name].shape) for name, values in arrays.items()}
    shaped["centroids"] = np.zeros((1, 0), NODE) if empty else centroids.reshape(1, *kind["centroids"].shape)
    return shaped, tangents


def _extended(deflection: np.ndarray, force: np.ndarray, centroid: np.ndarray) -> list[np.ndarray]:
    """The tables continued along their tangents, so that all offsets reach the largest deflection of any.

    Between two offsets the force peaks at a deflection beyond one of their tables.
    """
    first, last = np.diff(deflection[..., -3:]), np.diff(force[..., -3:])
    secants = last / first
    tangent = secants[..., -1] + np.diff(secants)[..., -1:].sum(axis=-1) * first[..., -1] / first.sum(axis=-1)
    tangent = np.maximum(tangent, 0.5 * secants[..., -1])
    end = deflection[..., -1].max(axis=tuple(range(deflection.ndim - 2)))
    end = end + MARGIN * np.abs(end - deflection[..., 0])
    share = np.arange(1, EXTENSION + 1) / EXTENSION
    beyond = (end - deflection[..., -1])[..., None] * share
    constant = np.broadcast_to(centroid[..., -1:], beyond.shape)
    further = deflection[..., -1:] + beyond, force[..., -1:] + tangent[..., None] * beyond, constant
    return [np.concatenate(x, axis=-1) for x in zip((deflection, force, centroid), further, strict=True)]


def uniform_phases(number: int, pitches: int) -> np.ndarray:
    """(number,) phases from 0 on, evenly spaced over a number of pitches."""
    return np.arange(number) * pitches / number


def _block(
    phase, uniform: np.ndarray, pitches: int, deflection, force, centroid, largest_force, *, has_centroid: bool
) -> tuple[np.ndarray, ...]:
    """Edges (phase_steps,), potentials, centroids and tangent stiffnesses (phase_steps, U.size) of a block.

    A law without force centroid has no centroids.

    deflection, force, centroid   (n_phase, n_deflection) over the given phases
    uniform                       (phase_steps,) phases of the table, over a number of pitches
    """
    curves = _curves_at_phases(deflection, force, centroid if has_centroid else None, largest_force)
    resampled = PhaseCurves(*periodic_cubics(phase, curves, uniform, pitches))
    edges = np.empty(uniform.size, EDGE)
    edges["unloaded"], edges["unloaded_slope"] = resampled.unloaded
    edges["largest"], edges["largest_slope"] = resampled.largest
    edges["largest_force"] = resampled.largest_force[0]
    potentials = _nodes(resampled.secant, resampled.secant_slope, potential_of)
    of_centroid = resampled.centroid, resampled.centroid_slope
    centroids = _nodes(*of_centroid, with_curvature) if has_centroid else np.zeros(0, NODE)
    return edges, potentials, centroids, resampled.tangent[0]


def _nodes(values, slopes, curve_of) -> np.ndarray:
    """Nodes (phase_steps, U.size) from values over `U`, their slopes per step of u, and the slopes of both by phase.

    curve_of   the function that makes the `Curve` of the nodes, linear in value and slope
    """
    curve, curve_by_phase = (curve_of(*both) for both in zip(values, slopes, strict=True))
    nodes = np.empty(curve.value.shape, NODE)
    nodes["value"], nodes["by_u"], nodes["by_uu"] = curve
    nodes["by_phase"], nodes["by_phase_u"], nodes["by_phase_uu"] = curve_by_phase
    return nodes


def _curves_at_phases(deflection, force, centroid, largest_force) -> PhaseCurves:
    """The curves at all phases, over (n_phase, n_deflection) deflections; centroid: None of a law without one."""
    columns = np.arange(force.shape[1])
    contact = np.where(force == 0, columns, 0).max(axis=1)
    loaded, (at, beside) = columns > contact[:, None], (np.arange(contact.size), contact + 1)
    unloaded = deflection[at, contact]
    penetration = np.where(loaded, deflection - unloaded[:, None], 0.0)
    largest = penetration[:, -1]
    k = np.divide(force, penetration, out=np.zeros(force.shape), where=loaded)
    k[at, contact] = k[at, beside]
    u = (penetration / largest[:, None]) ** 0.25
    secant, slope = monotone_cubics(u, k, contact, U)
    tangent = secant + 0.25 * U * slope
    at_nodes = centroid_slope = np.zeros((contact.size, 1))
    if centroid is not None:
        centroid = centroid.copy()
        centroid[at, contact] = centroid[at, beside]
        at_nodes, centroid_slope = monotone_cubics(u, centroid, contact, U)
        centroid_slope = _smoothed(at_nodes, centroid_slope)
    edges = unloaded, largest, largest_force
    return PhaseCurves(*edges, secant, _smoothed(secant, slope), at_nodes, centroid_slope, tangent)


def _smoothed(value: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Slopes per step of u, from slopes over u: as given at light loads, where they change fast, else differences.

    Differences change smoothly over phase, as the given values move along u.
    """
    return np.where(U < LIGHT, slope / PENETRATIONS, differences(value))


class Curve(NamedTuple):
    """Values over `U` along the last axis, with first and second derivatives per step of u."""

    value: np.ndarray
    by_u: np.ndarray
    by_uu: np.ndarray


def differences(values: np.ndarray) -> np.ndarray:
    """Slopes (..., U.size) of values (..., U.size) per step of u, exact for quartic polynomials."""
    slopes = np.empty_like(values)
    slopes[..., 2:-2] = (values[..., :-4] - 8 * (values[..., 1:-3] - values[..., 3:-1]) - values[..., 4:]) / 12
    for j, weights in enumerate(AT_THE_ENDS):
        slopes[..., j] = sum(weight * values[..., k] for k, weight in enumerate(weights)) / 12
        slopes[..., -1 - j] = -sum(weight * values[..., -1 - k] for k, weight in enumerate(weights)) / 12
    return slopes


def with_curvature(value: np.ndarray, slope: np.ndarray) -> Curve:
    """The curve of values and slopes."""
    return Curve(value, slope, differences(slope))


def potential_of(k: np.ndarray, slope: np.ndarray) -> Curve:
    """w of the potential, from the secant stiffness and its slope per step of u."""
    steps = np.arange(1, U.size)
    work = 4 * np.cumsum(_integrals(k, slope), axis=-1) / U[1:] ** 8
    w = np.concatenate([k[..., :1] / 2, work], axis=-1)
    first = 4 * (k - 2 * w)[..., 1:] / steps
    first = np.concatenate([4 / 9 * slope[..., :1], first], axis=-1)
    second = (4 * slope - 9 * first)[..., 1:] / steps
    bend = 6 * (k[..., 1] - k[..., 0]) - 4 * slope[..., 0] - 2 * slope[..., 1]
    return Curve(w, first, np.concatenate([4 / 10 * bend[..., None], second], axis=-1))


def _integrals(k: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """(..., PENETRATIONS) integrals of k u^7 over each step, k cubic between the nodes."""
    points, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    total = np.zeros((*k.shape[:-1], PENETRATIONS))
    for t, weight in zip((points + 1) / 2, weights / 2, strict=True):
        u = U[:-1] + t / PENETRATIONS
        of_ends = hermite_weights.py_func(t)
        curve = weighted.py_func(of_ends, k[..., :-1], slope[..., :-1], k[..., 1:], slope[..., 1:])
        total += weight / PENETRATIONS * u**7 * curve
    return total
