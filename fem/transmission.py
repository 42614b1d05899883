"""Static transmission error by finite elements: the table of contents of this package."""

from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from math import ceil, floor

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from fem.compliance import Compliance, flank_compliance
from fem.deviation import PitchDeviation
from fem.flank import removed
from fem.gap import Meeting
from fem.gear import GearPair, require
from fem.hertz import largest_torque
from fem.mesh import Density
from fem.offsets import ANGLES, Offsets, check_places, in_plane_of_action
from fem.state import Encounter
from fem.ste import PHASE, TORQUE, ste_map

#: The tooth behind the loaded one is drawn; further ones change nothing.
BEHIND = 1
ORDER = ("a", "axial", *ANGLES)


@dataclass(frozen=True)
class Resolution:
    """How finely a map is solved.

    density     of the FE mesh; `teeth` is taken from the contact ratio
    slices      of the face width where gap or lines of contact vary across it; elsewhere half of the width has 3
    resolved    strips along the profile in every slice (True), or one line load, pressed as Hertz says (False)
    """

    density: Density = field(default=Density())
    slices: int = 20
    resolved: bool = True

    def __post_init__(self):
        whole = f"slices must be an even number, at least 2, got {self.slices}"
        require(self.slices == int(self.slices) and self.slices >= 2 and self.slices % 2 == 0, whole)


def static_transmission_error(
    pair: GearPair,
    torque,
    phases=30,
    *,
    offsets: Offsets | None = None,
    resolution: Resolution | None = None,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """STE map of a spur or helical pair: "te" [m] in mid-plane on the line of action over (torque, offsets, phase).

    Beside it stand "centroid" of the force across the width [m], "peak_pressure" [Pa], "line_load" [N/m], the
    "load_share" of every pair of teeth, "pairs_in_contact", and over the torque "contact_ratio", that under load.

    torque          pinion torque F r_b1 [N m], one or several increasing values >= 0; 0: unloaded transmission error
    phases          number of equidistant phases from 0 (pair 0 at the pitch point), or their values in [0, 1); with
                    pitch deviations values up to any number of pitches, as each tooth differs
    offsets         of the wheel; those with several values are axes of the map
    resolution      the default is within 0.3 % of the converged mean for spur gears
    executor        any `concurrent.futures.Executor` to spread phases and places over; finite elements are solved here
    progress        show a bar with time left

    The compliance of each different gear is kept in the cache (see `fem.cache.folder`).
    Raises ValueError for bad input, RuntimeError where a contact does not settle.
    Source: Korta et al., section IV; TE = theta_P r_b1 + theta_G r_b2.
    """
    torque, phase = checked_torque(pair, torque), checked_phases(phases, pair)
    offsets, resolution = offsets or Offsets(), resolution or Resolution()
    values = offsets.values(pair)
    check_places(pair, values["a"], values["axial"])
    pair = replace(pair, a=float(values["a"][0])) if "a" not in offsets.axes() else pair
    bodies, slices = bodies_of(pair, values, resolution)
    column = partial(_column, bodies, slices, resolution.resolved, torque / pair.pinion.r_b, values)
    meetings = [Meeting(pair, *place) for place in product(values["a"], values["axial"], phase)]
    columns = (map if executor is None else executor.map)(column, meetings)
    bar = tqdm(columns, "transmission error", len(meetings), disable=not progress, delay=1.0, leave=False)
    states = _ordered(list(bar), [torque.size, *(values[name].size for name in ORDER), phase.size])
    axes = {name: values[name] for name in offsets.axes()}
    fixed = {name: float(values[name][0]) for name in ORDER[1:] if name not in axes}
    fixed["pitches"] = max(1, ceil(phase[-1]))
    return _labelled(pair, torque, phase, axes, states, {"resolution": str(resolution)} | fixed)


def bodies_of(pair: GearPair, values: dict, resolution: Resolution) -> tuple[tuple[Compliance, Compliance], int]:
    """Compliances of pinion and wheel, and the number of slices of what they span."""
    varies, whole = _across_width(pair, values)
    closest = GearPair(pair.pinion, pair.wheel, a=float(values["a"].min()))
    teeth = floor(closest.eps_alpha + closest.eps_beta) + 1
    density = resolution.density.with_teeth(teeth, behind=BEHIND)
    loaded = pair.b + 2 * float(np.abs(values["axial"]).max())
    pinion, wheel = (flank_compliance(g, density, min(g.b, loaded), whole=whole) for g in (pair.pinion, pair.wheel))
    slices = resolution.slices if varies else 6
    return (pinion, wheel), slices if pinion.share == 1 else slices // 2


def _across_width(pair: GearPair, values: dict) -> tuple[bool, bool]:
    """Whether the gap varies across the width, and whether the two halves of the width differ."""
    axial, added = np.linspace(-pair.b / 2, pair.b / 2, 101)[:, None], np.zeros(1)
    for gear in (pair.pinion, pair.wheel):
        roll = np.linspace(gear.roll_form, gear.roll_tip, 101)
        added = added + removed(gear.drive_flank, gear.face, roll, axial)
    tolerance = 1e-15
    turned = bool(pair.beta_b or any(np.any(values[name]) for name in (*ANGLES, "axial")))
    varies = turned or bool(np.ptp(added, axis=0).max() > tolerance)
    return varies, turned or bool(np.abs(added - added[::-1]).max() > tolerance)


def _column(bodies, slices: int, resolved: bool, forces: np.ndarray, values: dict, meeting: Meeting) -> np.ndarray:
    """(n_force, *angles) states of one meeting; on one thread, which suits matrices of this size."""
    encounter = Encounter(meeting, bodies[0], bodies[1], slices)
    angles = np.meshgrid(*(values[name] for name in ANGLES), indexing="ij")
    misalignment = angles[0] + in_plane_of_action(meeting.alpha, *angles[1:])
    force, angle = (x.ravel() for x in np.broadcast_arrays(forces[:, None, None, None], misalignment[None]))
    states = np.empty(force.size, object)
    with threadpool_limits(1):
        loaded = force > 0
        if not resolved and loaded.any():
            states[loaded] = encounter.slice_states(force[loaded], angle[loaded])
        for i in range(force.size):
            if states[i] is None:
                states[i] = encounter.state(float(force[i]), float(angle[i]))
    return _numbers(states).reshape(forces.shape + misalignment.shape)


QUANTITIES = {
    "te": ("m", "static transmission error"),
    "peak_pressure": ("Pa", "largest contact pressure"),
    "line_load": ("N/m", "largest force per length of contact line"),
    "centroid": ("m", "axial place of the resultant force"),
}


def _numbers(states: np.ndarray) -> np.ndarray:
    """The same states as what a map keeps of each: the quantities, and the shares by number of the pair of teeth."""
    kept = np.empty(states.size, object)
    for i, state in enumerate(states):
        shares = {int(k): state.share(k) for k in np.unique(state.cells.number)}
        kept[i] = (state.te, state.peak_pressure(), state.line_load(), state.centroid(), shares)
    return kept


def _ordered(columns: list[np.ndarray], shape: list[int]) -> np.ndarray:
    """Columns of all meetings as one array (n_torque, n_a, n_axial, *angles, n_phase)."""
    n_torque, n_a, n_axial, *angles, n_phase = shape
    stacked = np.stack(columns).reshape(n_a, n_axial, n_phase, n_torque, *angles)
    return np.moveaxis(np.moveaxis(stacked, 3, 0), 3, -1)


def _labelled(pair, torque, phase, axes: dict, states: np.ndarray, attributes: dict) -> xr.Dataset:
    """The map with all its variables; offsets of one value are no axis."""
    grid = (TORQUE, *(name for name in ORDER if name in axes), PHASE)
    shape = [torque.size, *(axes[name].size for name in grid[1:-1]), phase.size]
    states = states.reshape(shape)

    def each(part) -> np.ndarray:
        return np.vectorize(part, otypes=[float])(states)

    found = {name: each(lambda s, i=i: s[i]) for i, name in enumerate(QUANTITIES)}
    data = ste_map(pair, torque, phase, found.pop("te"), {name: axes[name] for name in grid[1:-1]}, **attributes)
    variables = {
        name: (grid, values, dict(zip(("units", "long_name"), QUANTITIES[name], strict=True)))
        for name, values in found.items()
    }
    numbers = sorted({k for state in states.ravel() for k, share in state[4].items() if share > 0})
    shares = (
        np.stack([each(lambda s, k=k: s[4].get(k, 0.0)) for k in numbers], -1) if numbers else np.zeros((*shape, 0))
    )
    count = (shares > 0).sum(axis=-1)
    ratio = np.where(count.sum(axis=-1) > 0, count.mean(axis=-1), 0.0)
    return data.assign(variables).assign(
        {
            "load_share": (
                (*grid, "pair"),
                shares,
                {"units": "1", "long_name": "share of the load on a pair of teeth"},
            ),
            "pairs_in_contact": (grid, count, {"units": "1", "long_name": "pairs of teeth in contact"}),
            "contact_ratio": (grid[:-1], ratio, {"units": "1", "long_name": "effective contact ratio under load"}),
            "pair": ("pair", numbers, {"long_name": "number of the pair of teeth, ahead of pair 0"}),
        }
    )


def checked_torque(pair: GearPair, torque) -> np.ndarray:
    values = np.atleast_1d(np.asarray(torque, float))
    rising = values.ndim == 1 and values.size > 0 and bool((np.diff(values) > 0).all())
    require(rising and values[0] >= 0, f"torque must increase from 0 or above [N m]; sort it, got {torque}")
    largest = largest_torque(pair)
    limit = f"{largest:.4g} N m, where Hertz pressure passes E/20 (pass newton metres)"
    require(bool(values[-1] < largest), f"torque must be finite and below {limit}, got {values[-1]:g}")
    return values


def checked_phases(phases, pair: GearPair) -> np.ndarray:
    if np.ndim(phases) == 0:
        require(4 <= phases < 1e6 and phases == int(phases), f"phases must be a whole number, at least 4, got {phases}")
        return np.arange(int(phases)) / int(phases)
    values = np.asarray(phases, float)
    parts = (*pair.pinion.drive_flank, *pair.wheel.drive_flank)
    end = 1e6 if any(isinstance(part, PitchDeviation) for part in parts) else 1
    rising = values.size > 0 and bool((np.diff(values) > 0).all()) and values.min() >= 0 and values.max() < end
    require(rising, f"phases must increase within [0, 1) as share of a pitch, got {phases}")
    return values
