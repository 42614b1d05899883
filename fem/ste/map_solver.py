"""Contact of a pair over all torques, offsets and phases."""

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial, singledispatch
from itertools import product
from math import ceil, floor, inf, sqrt

import numpy as np

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.contact.tooth_contact import State, ToothContact
from fem.elasticity.flank_compliance import Compliance, flank_compliance
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.microgeometry.flank import removed
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import ANGLES, in_plane_of_action
from fem.pair.pair import GearPair
from fem.support.blas_threads import one_thread
from fem.support.progress import bar

#: The tooth behind the loaded one is drawn; further ones move te by less than 0.1 %.
BEHIND = 1
ORDER = ("a", "axial", *ANGLES)
#: What a map keeps of a state beside te and load shares, with units.
QUANTITIES = {
    "hertz_pressure": ("Pa", "largest contact pressure by Hertz of the line load"),
    "peak_pressure": ("Pa", "largest contact pressure, on tip edges too"),
    "tip_contact": ("1", "share of the load where the contact reaches a tip edge"),
    "line_load": ("N/m", "largest force per length of contact line"),
    "centroid": ("m", "axial place of the resultant force"),
    "stiffness": ("N/m", "tangent mesh stiffness, change of the mesh force per transmission error"),
}


def sweep(
    pair: GearPair,
    forces: np.ndarray,
    phase: np.ndarray,
    values: dict[str, np.ndarray],
    resolution: Discretization,
    *,
    executor: Executor | None = None,
    what: str = "transmission error",
) -> np.ndarray:
    """(n_force, n_a, n_axial, n_misalignment, n_f_sigma_delta, n_f_sigma_beta, n_phase) what `kept` keeps of states.

    forces      (n_force,) mesh forces >= 0 [N]
    phase       (n_phase,) positions in the mesh cycle
    values      of each offset, as `Offsets.values` gives them
    what        the bar says is computed

    Raises RuntimeError where a contact does not settle.
    """
    bodies, slices = bodies_of(pair, values, resolution)
    column = partial(_column, bodies, slices, resolution, forces, values)
    meetings = [MeshPosition(pair, *place) for place in product(values["a"], values["axial"], phase)]
    at_once = ceil(sqrt(len(meetings)) / 2)
    spread = map if executor is None else partial(executor.map, chunksize=at_once)
    columns: Iterable[np.ndarray] = spread(column, meetings)
    states = len(meetings) * forces.size * int(np.prod([values[name].size for name in ANGLES]))
    found = list(bar(columns, f"{what}: {states} states", np.ones(len(meetings))))
    return _ordered(found, [forces.size, *(values[name].size for name in ORDER), phase.size])


def bodies_of(pair: GearPair, values: dict, resolution: Discretization) -> tuple[tuple[Compliance, Compliance], int]:
    """Compliances of pinion and wheel, and the number of slices of what they span."""
    varies, whole = across_width(pair, values)
    bodies = (flank_compliance(*gear, whole=whole) for gear in elastic(pair, values, resolution))
    pitches = inf if resolution.neighbours is None else resolution.neighbours
    pinion, wheel = (replace(body, pitches=pitches) for body in bodies)
    slices = resolution.slices if varies else 6
    return (pinion, wheel), slices if pinion.share == 1 else slices // 2


def elastic(pair: GearPair, values: dict, resolution: Discretization) -> list[tuple[Gear, Density, float]]:
    """Pinion and wheel, each with the density of its finite elements and the width that can carry load [m]."""
    closest = GearPair(pair.pinion, pair.wheel, a=float(values["a"].min()))
    teeth = floor(closest.eps_alpha + closest.eps_beta) + 1
    density = resolution.density.with_teeth(teeth, behind=BEHIND)
    loaded = pair.b + 2 * float(np.abs(values["axial"]).max())
    return [(gear, density, min(gear.b, loaded)) for gear in (pair.pinion, pair.wheel)]


def across_width(pair: GearPair, values: dict) -> tuple[bool, bool]:
    """Whether the gap varies across the width, and whether the two halves of the width differ."""
    axial, added = np.linspace(-pair.b / 2, pair.b / 2, 101)[:, None], np.zeros(1)
    for gear in (pair.pinion, pair.wheel):
        roll = np.linspace(gear.roll_form, gear.roll_tip, 101)
        added = added + removed(gear.drive_flank, gear.face, roll, axial)
    tolerance = 1e-15
    turned = bool(pair.beta_b or any(np.any(values[name]) for name in (*ANGLES, "axial")))
    varies = turned or bool(np.ptp(added, axis=0).max() > tolerance)
    return varies, turned or bool(np.abs(added - added[::-1]).max() > tolerance)


@singledispatch
def contact_states(resolution: Discretization, contact: ToothContact, forces, misalignments) -> list[State]:
    """States under mesh forces (n,) >= 0 [N] and misalignments (n,) [rad], solved as the kind of resolution demands."""
    raise NotImplementedError(f"no contact solver for {resolution}")


@contact_states.register
def _strip_states(resolution: Resolution, contact: ToothContact, forces, misalignments) -> list[State]:
    return [contact.state(*load) for load in zip(forces.tolist(), misalignments.tolist(), strict=True)]


@contact_states.register
def _slice_states(resolution: Slices, contact: ToothContact, forces, misalignments) -> list[State]:
    return contact.slice_states(forces, misalignments)


def _column(
    bodies, slices: int, resolution: Discretization, forces: np.ndarray, values: dict, meeting: MeshPosition
) -> np.ndarray:
    """(n_force, *angles) states of one meeting; on one thread, which suits matrices of this size."""
    encounter = ToothContact(meeting, bodies[0], bodies[1], slices)
    angles = np.meshgrid(*(values[name] for name in ANGLES), indexing="ij")
    misalignment = angles[0] + in_plane_of_action(meeting.alpha, *angles[1:])
    force, angle = (x.ravel() for x in np.broadcast_arrays(forces[:, None, None, None], misalignment[None]))
    with one_thread():
        states = contact_states(resolution, encounter, force, angle)
    return kept(states).reshape(forces.shape + misalignment.shape)


def kept(states: list[State]) -> np.ndarray:
    """What a map keeps of each state: te, `QUANTITIES` in their order, shares by number of the pair of teeth."""
    found = np.empty(len(states), object)
    for i, state in enumerate(states):
        shares = {int(k): state.share(k) for k in np.unique(state.cells.number)}
        quantities = (getattr(state, name) for name in QUANTITIES)
        found[i] = (state.te, *(value() if callable(value) else value for value in quantities), shares)
    return found


def each(states: np.ndarray, part) -> np.ndarray:
    """One number of each of the states, in their order."""
    return np.vectorize(part, otypes=[float])(states)


def _ordered(columns: list[np.ndarray], shape: list[int]) -> np.ndarray:
    """Columns of all meetings as one array (n_torque, n_a, n_axial, *angles, n_phase)."""
    n_torque, n_a, n_axial, *angles, n_phase = shape
    stacked = np.stack(columns).reshape(n_a, n_axial, n_phase, n_torque, *angles)
    return np.moveaxis(np.moveaxis(stacked, 3, 0), 3, -1)
