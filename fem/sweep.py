"""Contact of a pair over all torques, offsets and phases."""

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from math import ceil, floor, inf, sqrt

import numpy as np

from fem.arguments import Finite, checked
from fem.checks import number
from fem.compliance import Compliance, flank_compliance
from fem.flank import removed
from fem.gear import Gear, GearPair, require
from fem.meeting import Meeting
from fem.mesh import Density
from fem.offsets import ANGLES, in_plane_of_action
from fem.progress import bar
from fem.representation import short
from fem.state import Encounter, State
from fem.threads import one_thread

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


@short()
@dataclass(frozen=True)
class Resolution:
    """How finely a map is solved.

    density     of the FE mesh, whose quadratic elements are made of two `paired`; `teeth` come from the contact ratio
    slices      of the face width where gap or lines of contact vary across it; elsewhere half of the width has 3
    resolved    strips along the profile in every slice (True), or one line load, pressed as Hertz says (False): there
                the peak to peak of wide, crowned helical pairs takes 40 slices and more; `accuracy=` tells
    neighbours  teeth up to so many pitches apart move one another, as programs have it that read the next ones only;
                None: all in contact, which are two pitches apart where three pairs are
    """

    density: Density = field(default=Density(width=4))
    slices: int = 20
    resolved: bool = True
    neighbours: int | None = None

    def __post_init__(self):
        if self.neighbours is not None:
            pitches = f"neighbours must be a whole number of pitches >= 0, or None for all teeth, got {self.neighbours}"
            require(number("neighbours", self.neighbours) % 1 == 0 and self.neighbours >= 0, pitches)
            object.__setattr__(self, "neighbours", int(self.neighbours))
        whole = f"slices must be an even number, at least 2, got {self.slices}"
        require(number("slices", self.slices) % 2 == 0 and self.slices >= 2, whole)
        object.__setattr__(self, "slices", int(self.slices))
        mode = f"resolved must be True (strips) or False (one line load), got {self.resolved!r}"
        require(isinstance(self.resolved, bool | np.bool_), mode)
        object.__setattr__(self, "resolved", bool(self.resolved))
        require(isinstance(self.density, Density), f"density must be a fem.mesh.Density, got {self.density!r}")
        self.density.paired()

    def compared(self) -> "Resolution":
        """About two thirds as fine in every direction, or half as fine again where nothing coarser is left in one."""
        coarser = self.scaled(2 / 3)
        left = self.slices > coarser.slices and self.density.flank > coarser.density.flank
        return coarser if left and self.density.width > coarser.density.width else self.finer()

    def finer(self) -> "Resolution":
        """Half as fine again in every direction."""
        return self.scaled(3 / 2)

    def finer_across(self) -> "Resolution":
        """Half as fine again across the width."""
        finer = self.finer()
        return replace(finer, density=replace(self.density, width=finer.density.width))

    def finer_inside(self) -> "Resolution":
        """Half as fine again but for the elements across the width."""
        finer = self.finer()
        return replace(finer, density=replace(finer.density, width=self.density.width))

    @checked
    def scaled(self, factor: Finite) -> "Resolution":
        """Numbers of elements and slices times a factor."""
        slices = max(2, 2 * round(self.slices * factor / 2))
        return replace(self, density=self.density.scaled(factor), slices=slices)


def sweep(
    pair: GearPair,
    forces: np.ndarray,
    phase: np.ndarray,
    values: dict[str, np.ndarray],
    resolution: Resolution,
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
    column = partial(_column, bodies, slices, resolution.resolved, forces, values)
    meetings = [Meeting(pair, *place) for place in product(values["a"], values["axial"], phase)]
    at_once = ceil(sqrt(len(meetings)) / 2)
    spread = map if executor is None else partial(executor.map, chunksize=at_once)
    columns: Iterable[np.ndarray] = spread(column, meetings)
    states = len(meetings) * forces.size * int(np.prod([values[name].size for name in ANGLES]))
    found = list(bar(columns, f"{what}: {states} states", np.ones(len(meetings))))
    return _ordered(found, [forces.size, *(values[name].size for name in ORDER), phase.size])


def bodies_of(pair: GearPair, values: dict, resolution: Resolution) -> tuple[tuple[Compliance, Compliance], int]:
    """Compliances of pinion and wheel, and the number of slices of what they span."""
    varies, whole = across_width(pair, values)
    bodies = (flank_compliance(*gear, whole=whole) for gear in elastic(pair, values, resolution))
    pitches = inf if resolution.neighbours is None else resolution.neighbours
    pinion, wheel = (replace(body, pitches=pitches) for body in bodies)
    slices = resolution.slices if varies else 6
    return (pinion, wheel), slices if pinion.share == 1 else slices // 2


def elastic(pair: GearPair, values: dict, resolution: Resolution) -> list[tuple[Gear, Density, float]]:
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


def _column(bodies, slices: int, resolved: bool, forces: np.ndarray, values: dict, meeting: Meeting) -> np.ndarray:
    """(n_force, *angles) states of one meeting; on one thread, which suits matrices of this size."""
    encounter = Encounter(meeting, bodies[0], bodies[1], slices)
    angles = np.meshgrid(*(values[name] for name in ANGLES), indexing="ij")
    misalignment = angles[0] + in_plane_of_action(meeting.alpha, *angles[1:])
    force, angle = (x.ravel() for x in np.broadcast_arrays(forces[:, None, None, None], misalignment[None]))
    with one_thread():
        if resolved:
            states = [encounter.state(*one) for one in zip(force.tolist(), angle.tolist(), strict=True)]
        else:
            states = encounter.slice_states(force, angle)
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
