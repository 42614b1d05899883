"""Cost of an STE map before it is solved: states, wall time, memory."""

from dataclasses import dataclass, replace
from math import ceil
from typing import Annotated, NamedTuple

import numpy as np

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.elasticity.flank_compliance import NEAR, RIM, WHOLE, lines_across, solutions
from fem.elasticity.mesh_density import Density
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.accuracy import FEWEST_PHASES, FIRST_TORQUES
from fem.ste.error_estimation import (
    CHECKED_PHASES,
    CHECKED_TORQUES,
    MESHED_PHASES,
    MESHED_TORQUES,
    at_furthest_offsets,
    compared_slices,
    comparisons,
    elements_along,
)
from fem.ste.inputs import UpTo, check_offsets_mesh, checked_accuracy, checked_request
from fem.ste.map_solver import ContactModel, elastic_gears, width_variation
from fem.ste.right_flanks import Symmetry, mirrored_model, shared_phases, symmetry_of
from fem.ste.ring_angle import checked_ring_angles
from fem.ste.ste_map import LOAD_SHARE, RING_ANGLE, STATE_VARIABLES
from fem.support.arguments import Finite, Numbers, checked
from fem.support.cache import known

#: Wall time of a state on an idle two-core machine, within a factor of two [s]: of spur pairs whose gap is the same
#: over the width; of other pairs with the default slices and a total contact ratio of 2, in proportion to these.
PER_STATE: dict[type[Discretization], tuple[float, float]] = {Resolution: (0.6e-3, 2e-3), Slices: (0.2e-3, 0.3e-3)}
#: Wall time at the default density, shared by two cores [s]: of the near field, and of a solid of half the width. The
#: latter grows with this power of the number of elements across the width.
NEAR_FIELD, SOLID, WIDTH_POWER = 0.4, 0.2, 2.3
#: Wall time of a ring whose rim bends, over that of the solid of a clamped one.
FREE_RING = 1.8


@checked
@dataclass(frozen=True)
class MapCost:
    """Cost of a map on a two-core machine in one process; print it.

    states        number of contact states of the map
    checks        number of further states for the estimated errors
    contact       wall time of all these states [s]
    compliances   wall time of the finite elements that are not yet in the cache [s]
    memory        memory of the map [bytes]
    at_least      whether this is a lower bound, as an accuracy chooses mesh, torques or phases while the map is solved
    """

    states: int
    checks: int
    contact: Finite
    compliances: Finite
    memory: int
    at_least: bool

    @property
    def seconds(self) -> float:
        """Wall time [s]."""
        return self.contact + self.compliances

    def __str__(self) -> str:
        checks = f" and {self.checks} to estimate errors" if self.checks else ""
        per_state = f"{1e3 * self.contact / (self.states + self.checks):.2g} ms"
        compliances = f"compliances {self.compliances:.2g} s" if self.compliances else "compliances in the cache"
        total = f"{'at least' if self.at_least else 'about'} {self.seconds:.2g} s"
        return f"{self.states} states{checks} of {per_state}, {compliances}: {total}, {self.memory / 1e6:.2g} MB of map"


class Sweep(NamedTuple):
    """Number of states that are solved with one model."""

    states: int
    model: ContactModel


@checked
def map_cost(
    pair: GearPair,
    torque: Numbers | UpTo,
    phases: Numbers | None = 30,
    *,
    offsets: Offsets | None = None,
    accuracy: Annotated[float, checked_accuracy] | None = None,
    resolution: Resolution | Slices | None = None,
    ring_angles: Numbers | None = None,
) -> MapCost:
    """Cost of `fem.static_transmission_error` with the same arguments, before it runs.

    With an accuracy it is the cost of the coarsest mesh, fewest phases and torques: a lower bound.
    Raises ValueError for bad input.
    """
    values = (Offsets() if offsets is None else offsets).values(pair)
    check_offsets_mesh(pair, values["a"], values["axial"])
    torques, phase = checked_request(pair, torque, phases, accuracy, resolution)
    n_phase = FEWEST_PHASES if phase is None else phase.size
    values = values | {RING_ANGLE: checked_ring_angles(pair, ring_angles)[0]}
    model = ContactModel(pair, values, resolution or (Resolution() if accuracy is None else Slices()))
    sides = _sides(model, torques, phase)
    sweeps = [Sweep(n_torque * n_phase * model.states_per_phase, side) for side, n_torque in sides]
    checked_sides = sides if symmetry_of(model) is Symmetry.NONE else sides[:1]
    checks = [x for side in checked_sides for x in _error_estimates(*side, n_phase) if accuracy is not None]
    if accuracy is None:
        by_slices = [(sweep.states, compared_slices(sweep.model, torques, phase)) for sweep in sweeps]
        checks = [Sweep(states, slices) for states, slices in by_slices if slices]
    n_check = sum(sweep.states for sweep in checks)
    contact = sum(sweep.states * per_state(sweep.model) for sweep in [*sweeps, *checks])
    compliances = _uncached([sweep.model for sweep in [*sweeps, *checks]])
    states = sum(sweep.states for sweep in sweeps)
    return MapCost(states, n_check, contact, compliances, _bytes(pair, states), accuracy is not None)


def _sides(model: ContactModel, torque: np.ndarray | UpTo, phase: np.ndarray | None) -> list[tuple[ContactModel, int]]:
    """The models that are solved, of left flanks and of right ones by the mirror image, with their numbers of loads."""
    if isinstance(torque, UpTo):
        return [(model, FIRST_TORQUES.size)]
    left, right = torque[torque >= 0], np.abs(torque[torque <= 0])
    if torque[0] >= 0:
        return [(model, left.size)]
    if phase is not None and shared_phases(model, phase) is not None:
        return [(model, np.union1d(left, right).size)]
    return [(model, left.size)] * bool(left.size) + [(mirrored_model(model), right.size)]


def _error_estimates(model: ContactModel, n_torque: int, n_phase: int) -> list[Sweep]:
    """Sweeps by which `fem.ste.accuracy` estimates the errors of the first resolution that it tries."""
    model = at_furthest_offsets(model)
    meshed = MESHED_PHASES * (min(n_torque, MESHED_TORQUES) + 1)
    over_phase, over_torque = 2 * n_phase * (CHECKED_TORQUES + 1), 2 * CHECKED_PHASES.size * n_torque
    between = over_phase + over_torque + CHECKED_PHASES.size * (n_torque + 1)
    compared = [replace(model, resolution=resolution) for resolution in comparisons(model.resolution)]
    return [Sweep(meshed + between, model), *(Sweep(meshed, coarse) for coarse in compared)]


def per_state(model: ContactModel) -> float:
    """Wall time of a state [s]: more where more slices of more tooth pairs may touch."""
    even, varying = PER_STATE[type(model.resolution)]
    varies, _ = width_variation(model.pair, model.offsets)
    slices = model.resolution.slices / Resolution().slices
    return varying * slices * model.pair.eps_gamma / 2 if varies else even


def _uncached(models: list[ContactModel]) -> float:
    """Wall time of the finite elements that are not in the cache [s]."""
    missing = {}
    for model in models:
        _, whole = width_variation(model.pair, model.offsets)
        for gear, density, loaded in elastic_gears(model.pair, model.offsets, model.resolution):
            for kind, name in solutions(gear, density, loaded, whole=whole).items():
                beyond = lines_across(gear, density, loaded)[1].nelements - density.width
                missing[name] = 0.0 if known(name) else finite_elements(density, kind, beyond)
    return sum(missing.values())


def finite_elements(density: Density, kind: str, beyond: int) -> float:
    """Wall time of one solution of a gear's finite elements [s].

    kind     as `flank_compliance.solutions` names it
    beyond   number of elements between the loaded width and an end face
    """
    section = elements_along(density) ** 2 / elements_along(Density()) ** 2
    if kind == NEAR:
        return NEAR_FIELD * section
    more = FREE_RING if kind == RIM else 1.0
    across = (density.width + beyond) / Resolution().density.width * (2 if kind == WHOLE else 1)
    return more * SOLID * section * across**WIDTH_POWER


def _bytes(pair: GearPair, states: int) -> int:
    """Memory of the variables of all states, and the load shares of all tooth pairs that may touch [bytes]."""
    scalars, tooth_pairs = len(STATE_VARIABLES.keys() - {LOAD_SHARE}) + 1, ceil(pair.eps_gamma) + 2
    return 8 * states * (scalars + tooth_pairs)
