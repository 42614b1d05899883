"""Contact states of a gear pair over all mesh forces, offsets and phases."""

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from math import ceil, floor, inf, nan, sqrt

import numpy as np
import xarray as xr

from fem.contact.mesh_geometry import pair_geometry
from fem.contact.resolution import Discretization, Slices
from fem.contact.tooth_contact import ToothContact
from fem.elasticity.flank_compliance import Compliance, flank_compliances
from fem.elasticity.mesh_density import Density
from fem.gear.gear import Gear
from fem.gear.rim_support import period
from fem.microgeometry.flank import names_teeth, removed, unlike_teeth
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import ANGLES, in_plane_of_action
from fem.pair.pair import GearPair
from fem.ste.contact_ratio import SECTIONS, RigidFlanks, loaded_pitches
from fem.ste.ste_map import LARGEST_GAP, LOAD_SHARE, OFFSETS, PAIR, PHASE, RING_ANGLE, ROUNDING, TE, largest_gap
from fem.support.blas_threads import one_thread
from fem.support.progress import bar
from fem.support.validation import set_fields

FORCE, OVERLAP = "force", "overlap"
#: Variables of each tooth pair, and their values where it is out of reach.
OF_TOOTH_PAIRS = {LOAD_SHARE: 0.0, OVERLAP: nan}
#: Toothed pitches modelled behind the loaded tooth; further ones change te by less than 0.1 %.
TOOTHED_PITCHES_BEHIND = 1
#: `Density.tip_power` of pinion and ring, which touch at their tip corners longer than external gears do: with 1.5 and
#: 1.75 te is up to 0.5 % of its mean off while teeth take over, with 2.25 up to 0.1 %.
TOWARDS_TIPS_IN_RING = 2.25
#: Slices over the whole face width where neither gap nor lines of contact vary across it.
SLICES_OF_EVEN_FACE = 6
#: Change of the gap across the width that counts as none: rounding [m].
EVEN_GAP = 1e-15


@dataclass(frozen=True)
class ContactModel:
    """Pair, offsets and resolution: the common inputs of all contact states of a map.

    offsets     values (n,) of each offset of the wheel, as `Offsets.values` gives them, and of the position on the ring
    """

    pair: GearPair
    offsets: dict[str, np.ndarray]
    resolution: Discretization

    def __post_init__(self):
        set_fields(self, offsets={RING_ANGLE: np.zeros(1)} | self.offsets)

    @property
    def states_per_phase(self) -> int:
        """Number of combinations of offsets."""
        return int(np.prod([self.offsets[name].size for name in OFFSETS]))

    @property
    def turns_on_supports(self) -> bool:
        """Whether states differ with the position of the mesh on the ring."""
        return period(self.pair.wheel.support) is not None

    @property
    def counts_pitches(self) -> bool:
        """Whether teeth differ: the phase counts all pitches, and the position on the ring follows from it."""
        return names_teeth((*self.pair.pinion.drive_flank, *self.pair.wheel.drive_flank))

    def positions(self, phase: np.ndarray) -> list[MeshPosition]:
        """Positions of the mesh over (a, axial, ring angle, phase)."""
        grid = product(self.offsets["a"], self.offsets["axial"], self.offsets[RING_ANGLE], phase)
        counted = self.counts_pitches
        return [MeshPosition(self.pair, a, axial, at, None if counted else angle) for a, axial, angle, at in grid]

    def misalignment(self, alpha: float) -> np.ndarray:
        """(n_misalignment, n_f_sigma_delta, n_f_sigma_beta) misalignment in the plane of action [rad]."""
        misalignment, *parallelism = np.meshgrid(*(self.offsets[name] for name in ANGLES), indexing="ij")
        return misalignment + in_plane_of_action(alpha, *parallelism)


def sweep(
    model: ContactModel,
    forces: np.ndarray,
    phase: np.ndarray,
    *,
    pitches: int = 1,
    executor: Executor | None = None,
    what: str = "transmission error",
) -> xr.Dataset:
    """`STATE_VARIABLES` of a map over (force, *OFFSETS, phase), load shares also over pair, and contact ratios.

    Contact ratios are NaN without load, and where the phases leave a gap of more than a third of a pitch.

    forces      (n_force,) mesh forces >= 0 [N]
    phase       (n_phase,) positions in the mesh cycle
    pitches     number of pitches over which they run
    what        name of the solved quantity in the progress bar

    Raises RuntimeError where a contact does not converge.
    """
    bodies, slices = compliances_of(model.pair, model.offsets, model.resolution)
    positions = model.positions(phase)
    numbers = {number for position in positions for number in position.numbers()}
    pairs = range(min(numbers), max(numbers) + 1)
    solve = partial(_states_at, bodies, slices, model, forces, pairs)
    chunk = ceil(sqrt(len(positions)) / 2)
    spread = map if executor is None else partial(executor.map, chunksize=chunk)
    columns: Iterable[dict[str, np.ndarray]] = spread(solve, positions)
    states = forces.size * phase.size * model.states_per_phase
    solved = list(bar(columns, f"{what}: {states} states", np.ones(len(positions))))
    axes = {FORCE: forces, **model.offsets, PHASE: phase, PAIR: pairs}
    variables = _variables(solved, axes)
    (_, te), (_, overlap) = variables[TE], variables.pop(OVERLAP)
    ratio = _contact_ratio(model, phase, pitches, pairs.start, te, overlap)
    unknown = (forces == 0)[:, None, None, None] | (largest_gap(np.sort(phase), pitches) > LARGEST_GAP + ROUNDING)
    variables["contact_ratio"] = ["a", "axial", RING_ANGLE, FORCE, *ANGLES], np.where(unknown, nan, ratio)
    return xr.Dataset(variables, axes).transpose(FORCE, *OFFSETS, PHASE, PAIR)


def _variables(columns: list[dict[str, np.ndarray]], axes: dict) -> dict[str, tuple[list[str], np.ndarray]]:
    """Dimensions and values of variables, of the columns of all positions in their order."""
    dims = ["a", "axial", RING_ANGLE, PHASE, FORCE, *ANGLES]
    shape = [len(axes[name]) for name in dims]
    variables = {}
    for name in columns[0]:
        further = [PAIR] if name in OF_TOOTH_PAIRS else []
        values = np.stack([column[name] for column in columns])
        variables[name] = dims + further, values.reshape(shape + [len(axes[name]) for name in further])
    return variables


def _contact_ratio(
    model: ContactModel, phase: np.ndarray, pitches: int, first: int, te: np.ndarray, overlap: np.ndarray
) -> np.ndarray:
    """(n_a, n_axial, n_ring, n_force, *angles) contact ratios from te (n_a, n_axial, n_ring, n_phase, n_force, *angles)
    [m] and from overlaps [m], also over the tooth pairs from the first one on."""
    ratio, order = np.empty(te[:, :, :, 0].shape), np.argsort(phase)
    sections = SECTIONS if width_variation(model.pair, model.offsets)[0] else 1
    by_strips = not isinstance(model.resolution, Slices)
    for i, j, ring in np.ndindex(te.shape[:3]):
        position = MeshPosition(model.pair, float(model.offsets["a"][i]), float(model.offsets["axial"][j]), 0.0)
        flanks = RigidFlanks(pair_geometry(position), np.linspace(*position.face, sections), about_te=by_strips)
        misalignment = np.broadcast_to(model.misalignment(position.alpha), ratio.shape[3:]).ravel()
        over_phase = te[i, j, ring, order].reshape(phase.size, -1).T
        of_pairs = overlap[i, j, ring, order].reshape(phase.size, misalignment.size, -1).transpose(1, 2, 0)
        loaded = loaded_pitches(flanks, misalignment, phase[order], pitches, first, over_phase, of_pairs)
        ratio[i, j, ring] = loaded.reshape(ratio.shape[3:])
    return ratio


def _states_at(
    bodies: tuple[Compliance, Compliance],
    slices: int,
    model: ContactModel,
    forces: np.ndarray,
    pairs: range,
    position: MeshPosition,
) -> dict[str, np.ndarray]:
    """`STATE_VARIABLES` (n_force, *angles) at one mesh position; on one thread, which suits matrices of this size."""
    misalignment = model.misalignment(position.alpha)
    force, angle = np.broadcast_arrays(forces[:, None, None, None], misalignment)
    with one_thread():
        contact = ToothContact(position, *bodies, slices)
        solve = contact.slice_quantities if isinstance(model.resolution, Slices) else contact.strip_quantities
        states = solve(force.ravel(), angle.ravel())
    first = position.numbers().start - pairs[0]
    for name, out_of_reach in OF_TOOTH_PAIRS.items():
        values = np.full((force.size, len(pairs)), out_of_reach)
        values[:, first : first + len(position.numbers())] = states[name]
        states[name] = values
    return {name: values.reshape(force.shape + values.shape[1:]) for name, values in states.items()}


def compliances_of(
    pair: GearPair, offsets: dict[str, np.ndarray], resolution: Discretization
) -> tuple[tuple[Compliance, Compliance], int]:
    """Compliances of pinion and wheel, and the number of slices of the modelled part of the face width."""
    varies, whole = width_variation(pair, offsets)
    bodies = flank_compliances(elastic_gears(pair, offsets, resolution), whole=whole)
    pitches = inf if resolution.neighbours is None else resolution.neighbours
    pinion, wheel = (replace(body, pitches=pitches) for body in bodies)
    slices = resolution.slices if varies else SLICES_OF_EVEN_FACE
    return (pinion, wheel), pinion.face.slices(slices)


def elastic_gears(
    pair: GearPair, offsets: dict[str, np.ndarray], resolution: Discretization
) -> list[tuple[Gear, Density, float]]:
    """Pinion and wheel, each with the density of its finite elements and the width that can carry load [m]."""
    closest = GearPair(pair.pinion, pair.wheel, a=float(offsets["a"].min()))
    teeth = floor(closest.eps_alpha + closest.eps_beta) + 1
    density = resolution.density.with_teeth(teeth, behind=TOOTHED_PITCHES_BEHIND)
    if pair.wheel.internal and density.tip_power is None:
        density = replace(density, tip_power=TOWARDS_TIPS_IN_RING)
    loaded = pair.b + 2 * float(np.abs(offsets["axial"]).max())
    return [(gear, density, min(gear.b, loaded)) for gear in (pair.pinion, pair.wheel)]


def width_variation(pair: GearPair, offsets: dict[str, np.ndarray]) -> tuple[bool, bool]:
    """Whether the gap varies across the width, and whether the two halves of the width differ."""
    axial = np.linspace(-pair.b / 2, pair.b / 2, 101)[:, None]
    helical = pair.pinion.beta or pair.wheel.beta
    varies = halves_differ = bool(helical or any(np.any(offsets[name]) for name in (*ANGLES, "axial")))
    rolls = [np.linspace(gear.roll_form, gear.roll_tip, 101) for gear in (pair.pinion, pair.wheel)]
    teeth = product(*(unlike_teeth(gear.drive_flank) for gear in (pair.pinion, pair.wheel)))
    for meeting in () if halves_differ else teeth:
        relief = np.zeros(1)
        for gear, roll, tooth in zip((pair.pinion, pair.wheel), rolls, meeting, strict=True):
            relief = relief + removed(gear.drive_flank, gear.face, roll, axial, tooth=tooth)
        varies |= bool(np.ptp(relief, axis=0).max() > EVEN_GAP)
        halves_differ |= bool(np.abs(relief - relief[::-1]).max() > EVEN_GAP)
    return varies or halves_differ, halves_differ
