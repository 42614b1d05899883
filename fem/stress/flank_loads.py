"""Loads that a contact applies to the flanks of both gears: pressure on strips of the profile in slices of the width.

The strips of a slice are those of its middle section: on helical gears they do not follow the line of contact.
"""

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, sqrt

import numpy as np

from fem.contact.contact_state import State
from fem.contact.resolution import Resolution
from fem.contact.tooth_contact import ToothContact
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import ANGLES, Offsets, in_plane_of_action
from fem.pair.pair import GearPair
from fem.ste.inputs import check_offsets_mesh
from fem.ste.map_solver import compliances_of
from fem.ste.ring_angle import counts_pitches
from fem.ste.ste_map import pair_attributes
from fem.stress.tooth_boundary import flank_ends
from fem.support.blas_threads import one_thread
from fem.support.progress import bar
from fem.support.representation import exact
from fem.support.validation import finite, require, require_kind

#: Number of teeth on either side of the loaded ones that stiffen a rim on supports: root stress within 3 %.
BESIDE_ON_BENT_RIM = 5


@dataclass(frozen=True)
class FlankLoad:
    """Pressure on one tooth, uniform on strips of the profile; each slice of the width has its own strips.

    tooth       number of the tooth, counter-clockwise
    edges       (n_slice, n_strip + 1) arc lengths that bound the strips, not decreasing [m]
    low, high   (n_slice,) axial ends of the slices [m]; of a section 0 and 1, for loads per metre
    force       (n_slice, n_strip) forces normal to the flank [N]
    """

    tooth: int
    edges: np.ndarray
    low: np.ndarray
    high: np.ndarray
    force: np.ndarray

    def __post_init__(self):
        expected, shape = (self.low.size, self.edges.shape[1] - 1), self.force.shape
        require(shape == expected, f"force must have the shape (slices, strips) = {expected}, got {shape}")
        size = np.diff(self.edges, axis=1)
        rising = bool((size >= 0).all() and (size[self.force != 0] > 0).all() and (self.high > self.low).all())
        require(rising, f"edges, and low to high, must increase; sort the strips from root to tip, got {self.edges}")

    @property
    def middle(self) -> np.ndarray:
        """(n_slice, n_strip) arc lengths of the middles of the strips [m]."""
        return (self.edges[:, 1:] + self.edges[:, :-1]) / 2

    def section(self, axial: float) -> "FlankLoad":
        """Line load of the slice at an axial position [N/m], between two of the upper; without strips where is none."""
        at = np.flatnonzero((self.low <= axial) & (axial <= self.high))[-1:]
        line_load = self.force[at] / (self.high - self.low)[at, None]
        return FlankLoad(self.tooth, self.edges[at], np.zeros(at.size), np.ones(at.size), line_load)

    @property
    def extent(self) -> np.ndarray:
        """(2,) middle and half-width of the strips that carry load, in arc length [m]."""
        loaded = self.force > 0
        low, high = self.edges[:, :-1][loaded].min(), self.edges[:, 1:][loaded].max()
        return np.array([low + high, high - low]) / 2


def tooth_contacts(
    pair: GearPair, phases, offsets: Offsets | None, resolution: Resolution | None, ring_angle: float = 0.0
) -> tuple[list[ToothContact], float]:
    """Contacts at phases with the compliances of a map, and their misalignment in the plane of action [rad].

    ring_angle  position of the mesh on a ring, as in a map [rad]
    """
    offsets = Offsets() if offsets is None else offsets
    resolution = Resolution() if resolution is None else resolution
    require_kind("offsets", offsets, Offsets)
    require_kind("resolution", resolution, Resolution)
    axes = ", ".join(offsets.axes())
    require(not axes, f"offsets must have one value each, got several of {axes}; take one after the other")
    values = offsets.values(pair)
    check_offsets_mesh(pair, values["a"], values["axial"])
    (pinion, wheel), slices = compliances_of(pair, values, resolution)
    a, axial, misalignment, *errors = (float(values[name][0]) for name in ("a", "axial", *ANGLES))
    angle = None if counts_pitches(pair) else finite("ring_angle", ring_angle)
    positions = [MeshPosition(pair, a, axial, float(phase), angle) for phase in phases]
    in_plane = in_plane_of_action(GearPair(pair.pinion, pair.wheel, a=a).alpha_wt, *errors)
    return [ToothContact(position, pinion, wheel, slices) for position in positions], misalignment + in_plane


def states_of(
    contacts: list[ToothContact], forces: np.ndarray, misalignment: float, executor: Executor | None, what: str
) -> list[list[State]]:
    """States of the contacts, each under all mesh forces (n_force,) [N]; what is the text of the progress bar."""
    chunk = ceil(sqrt(len(contacts)))
    spread = map if executor is None else partial(executor.map, chunksize=chunk)
    columns: Iterable[list[State]] = spread(partial(_states_under, forces, misalignment), contacts)
    return list(bar(columns, what, np.ones(len(contacts))))


def _states_under(forces: np.ndarray, misalignment: float, contact: ToothContact) -> list[State]:
    """States of a contact; on one thread, which suits matrices of this size."""
    with one_thread():
        return [contact.state(force, misalignment) for force in forces.tolist()]


def contact_inputs(pair: GearPair, offsets: Offsets | None, resolution: Resolution | None) -> dict[str, float | str]:
    """Inputs of contacts for the attributes of results: the pair at its centre distance, offsets, resolution."""
    values = {name: float(value[0]) for name, value in (offsets or Offsets()).values(pair).items()}
    at_distance = replace(pair, a=values.pop("a"))
    return pair_attributes(at_distance) | values | {"resolution": exact(resolution or Resolution())}


def flank_loads(contact: ToothContact, state: State) -> tuple[list[FlankLoad], list[FlankLoad]]:
    """Loads of a contact on the loaded teeth of pinion and wheel, over the whole width."""
    slices, position = state.slices, contact.position
    loads: tuple[list[FlankLoad], list[FlankLoad]] = ([], [])
    if state.strips is None or state.strip_force is None:
        require(not state.force.any(), "state has no strips, got line loads; solve the contact with ToothContact.state")
        return loads
    for number in np.unique(slices.number[state.force > 0]):
        rows = np.flatnonzero((slices.number == number) & (state.force > 0))
        for side, gear in enumerate((position.pair.pinion, position.pair.wheel)):
            arcs, width = state.strips.arcs[side, rows], state.strips.width[rows]
            edges, force = _sorted_strips(gear, arcs, state.strip_force[rows], width)
            ends = (axial[rows] - side * position.axial for axial in (slices.low, slices.high))
            low, high, edges, force = state.face.unfolded(*ends, edges, force)
            loads[side].append(FlankLoad(-int(number) if side else int(number), edges, low, high, force))
    return loads


def with_loaded_teeth(gear: Gear, density: Density, loads: list[FlankLoad]) -> Density:
    """Density with all loaded teeth and those beside them that stiffen the rim of the gear."""
    teeth = [load.tooth for load in loads]
    beside = BESIDE_ON_BENT_RIM if gear.support else 1
    return density.with_teeth(max([0, *teeth]) + beside, beside - min([0, *teeth]))


def _sorted_strips(gear: Gear, arcs: np.ndarray, force: np.ndarray, width) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n, m + 1) of strips around arcs (n, m), within the flank, and their forces, from root to tip.

    Where the tip's corner touches, several strips may lie there; they keep their width (n, m) on the mating flank.
    """
    order = np.argsort(arcs, axis=1)
    arcs, force, width = (np.take_along_axis(values, order, axis=1) for values in (arcs, force, width))
    midpoints = (arcs[:, 1:] + arcs[:, :-1]) / 2
    first, last = 2 * arcs[:, :1] - midpoints[:, :1], 2 * arcs[:, -1:] - midpoints[:, -1:]
    start, end = flank_ends(gear)
    edges = np.clip(np.hstack([first, midpoints, last]), start, end)
    loaded = width * (force > 0)
    edges[:, 1:] = np.maximum(edges[:, 1:], start + np.cumsum(loaded, axis=1))
    edges[:, :-1] = np.minimum(edges[:, :-1], end - np.cumsum(loaded[:, ::-1], axis=1)[:, ::-1])
    return edges, force
