"""Load distribution over the flanks: line load and pressure of every tooth pair across the face."""

from concurrent.futures import Executor
from math import floor

import numpy as np
import xarray as xr

from fem.contact.contact_state import State
from fem.contact.resolution import Resolution
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.inputs import checked_phases, checked_torque
from fem.ste.ste_map import PHASE, TORQUE, description, gap_attribute
from fem.stress.flank_loads import contact_inputs, states_of, tooth_contacts
from fem.stress.load_factors import AXIAL, station_ends
from fem.support.arguments import Finite, Numbers, checked
from fem.support.progress import shown
from fem.support.validation import require

PAIR = "pair"
GRID = TORQUE, PHASE, PAIR, AXIAL


@checked
def load_distribution(
    pair: GearPair,
    torque: Numbers,
    phases: Numbers = 30,
    *,
    offsets: Offsets | None = None,
    ring_angle: Finite = 0.0,
    resolution: Resolution | None = None,
    stations: int = 20,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Load and pressure of tooth pairs over (torque, phase, pair, axial_position), on equal parts of the face width.

    torque          pinion torques F r_b1 >= 0 [N m], increasing
    phases          number of equidistant phases, or their values in [0, 1)
    offsets         offsets of the wheel, one value each
    ring_angle      position of the mesh on a ring on `fem.Bolts`, as in a map [rad]
    resolution      resolution of the contact, as for a map
    stations        number of equal parts of the common face width
    executor        any `concurrent.futures.Executor`, which solves the contacts, a phase in each call

    "line_load" [N/m]: normal force per length of contact line. Its integral over the lengths in "length" [m] is the
    normal force of a tooth pair; times cos beta_b, summed over the pairs, it equals the mesh force T / r_b1 within
    1e-3, or within 5e-3 where tip edges carry load, whose lever arm is shorter. "pressure" [Pa]: largest contact
    pressure, tip edges included. "path" [m]: distance of the contact line from the pitch point along the line of
    action, over (phase, pair, axial_position), > 0 towards the tip of the pinion; "te" [m] over (torque, phase).
    The attributes hold the pair at its centre distance (`fem.pair_of`), offsets and resolution; "misalignment" is the
    sum in the plane of action.

    Raises ValueError for bad input, RuntimeError where a contact does not converge.
    """
    torque, phase = checked_torque(pair, torque), checked_phases(phases, pair)
    require(2 <= stations <= 10_000, f"stations must lie in [2, 10000], got {stations}")
    with shown(progress):
        contacts, misalignment = tooth_contacts(pair, phase, offsets, resolution, ring_angle)
        columns = states_of(contacts, torque / pair.pinion.r_b, misalignment, executor, "load distribution")
    edges = station_ends(contacts[0], stations)
    positions = [contact.position for contact in contacts]
    pairs = _loaded_pairs(columns)
    loads = np.array([[_on_stations(state, pairs, edges) for state in column] for column in columns])
    te = np.array([[state.te for state in column] for column in columns])
    axes = {TORQUE: torque, PHASE: phase, PAIR: pairs, AXIAL: (edges[1:] + edges[:-1]) / 2}
    paths = np.array([_paths(position, pairs, axes[AXIAL]) for position in positions])
    data = _labelled(axes, loads.transpose(2, 1, 0, 3, 4), paths, te.T)
    length = np.diff(edges) / np.cos(pair.beta_b)
    about = {"units": "m", "long_name": "length of the contact line in a part of the face"}
    inputs = contact_inputs(pair, offsets, resolution) | {"misalignment": misalignment}
    inputs |= gap_attribute(phase, floor(phase[-1]) + 1)
    return data.assign(length=(AXIAL, length, about)).assign_attrs(inputs)


def _loaded_pairs(columns: list[list[State]]) -> np.ndarray:
    """Numbers of the tooth pairs from the first to the last that carries load in any state; pair 0 where none does."""
    loaded = [state.slices.number[state.force > 0] for column in columns for state in column]
    numbers = np.concatenate([*loaded, [0]])
    return np.arange(numbers.min(), numbers.max() + 1)


def _on_stations(state: State, pairs: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """(2, n_pair, n_station) line loads [N/m] and pressures [Pa] of a state between edges (n_station + 1,) [m].

    The force of a slice is spread evenly over its width, so that all forces add up to the mesh force.
    """
    values = np.zeros((2, pairs.size, edges.size - 1))
    if not state.force.any():
        return values
    slices, face = state.slices, state.face
    for row, number in enumerate(pairs):
        rows = slices.number == number
        low, high, force, pressure = face.unfolded(
            slices.low[rows], slices.high[rows], state.force[rows], state.pressure[rows]
        )
        overlap = np.minimum(high[:, None], edges[1:]) - np.maximum(low[:, None], edges[:-1])
        covered = np.maximum(overlap, 0.0)
        line_load = force / (high - low) * np.cos(slices.position.pair.beta_b)
        values[0, row] = line_load @ covered / np.diff(edges)
        values[1, row] = np.where(covered > 0, pressure[:, None], 0.0).max(axis=0, initial=0.0)
    return values


def _paths(position: MeshPosition, pairs: np.ndarray, axial: np.ndarray) -> np.ndarray:
    """(n_pair, n_station) distances of the contact lines from the pitch point [m]."""
    return position.nominal(pairs[:, None], axial) - position.path.pitch


def _labelled(axes: dict[str, np.ndarray], loads: np.ndarray, paths: np.ndarray, te: np.ndarray) -> xr.Dataset:
    """Dataset of line loads and pressures (2, *GRID), positions on the path (*GRID[1:]) and te (torque, phase)."""
    variables = {
        "line_load": (GRID, loads[0], {"units": "N/m", "long_name": "force per length of contact line"}),
        "pressure": (GRID, loads[1], {"units": "Pa", "long_name": "largest contact pressure"}),
        "path": (GRID[1:], paths, {"units": "m", "long_name": "position on the path of contact from the pitch point"}),
        "te": (GRID[:2], te, {"units": "m", "long_name": "static transmission error"}),
    }
    about = {name: description(name) for name in GRID[:3]}
    about[AXIAL] = {"units": "m", "long_name": "axial position from the pinion's mid-plane"}
    coords = {name: (name, values, about[name]) for name, values in axes.items()}
    return xr.Dataset(variables, coords, {"title": "load distribution over the flanks"})
