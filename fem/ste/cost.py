"""What an STE map will cost: states, wall time, memory, before any of it is solved."""

from dataclasses import dataclass, replace
from math import ceil
from typing import Annotated, NamedTuple

import numpy as np

from fem.contact.resolution import Discretization, Resolution, Slices
from fem.elasticity.flank_compliance import NEAR, WHOLE, solutions
from fem.elasticity.mesh_density import Density
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.accuracy import FEWEST_PHASES, UpTo
from fem.ste.error_estimation import CHECKED_PHASES, CHECKED_TORQUES, MESHED_PHASES, MESHED_TORQUES, along, edges_of
from fem.ste.inputs import check_places, checked_accuracy, checked_phases, checked_torque, given, require_one_way
from fem.ste.map_solver import ORDER, QUANTITIES, across_width, elastic
from fem.support.arguments import Finite, Numbers, checked
from fem.support.cache import known

#: Wall time of a state on a two-core machine that does nothing else, measured within a factor of two [s]: of spur pairs
#: whose gap is the same over the width; of all others, with the default slices and a total contact ratio of 2, in
#: proportion to both.
PER_STATE: dict[type[Discretization], tuple[float, float]] = {Resolution: (3.5e-3, 6e-3), Slices: (0.8e-3, 1.3e-3)}
#: Likewise per toothed pitch at the default density: of the near field, and of a solid of half the width. They grow
#: with these powers of the number of elements in the section, and across the width.
NEAR_FIELD, SOLID, SECTION_POWER, WIDTH_POWER = 0.2, 0.25, 1.25, 2.0
#: `UpTo` begins with so many torques.
LEAST_TORQUES = 5


class Part(NamedTuple):
    """Number of states that are solved at these offsets with one resolution."""

    states: int
    offsets: dict[str, np.ndarray]
    resolution: Discretization


@checked
@dataclass(frozen=True)
class MapCost:
    """What a map costs on a two-core machine in one process; print it.

    states        of the map
    checks        further states that estimating its errors takes
    contact       wall time of all these states [s]
    compliances   wall time of the finite elements that are not yet in the cache [s]
    memory        of the map [bytes]
    at_least      whether mesh, torques or phases are chosen while it is solved, which this is the beginning of
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
        each = f"{1e3 * self.contact / (self.states + self.checks):.2g} ms"
        finite = f"compliances {self.compliances:.2g} s" if self.compliances else "compliances in the cache"
        about = f"{'at least' if self.at_least else 'about'} {self.seconds:.2g} s"
        return f"{self.states} states{checks} of {each}, {finite}: {about}, {self.memory / 1e6:.2g} MB of map"


@checked
def map_cost(
    pair: GearPair,
    torque: Numbers | UpTo,
    phases: Numbers | None = 30,
    *,
    offsets: Offsets | None = None,
    accuracy: Annotated[float, checked_accuracy] | None = None,
    resolution: Resolution | Slices | None = None,
) -> MapCost:
    """What `fem.static_transmission_error` of the same arguments costs, before it runs.

    With an accuracy to choose by it is the cost of the coarsest mesh, fewest phases and torques: at least that.
    Raises ValueError for bad input.
    """
    offsets = Offsets() if offsets is None else offsets
    values = offsets.values(pair)
    check_places(pair, values["a"], values["axial"])
    require_one_way(accuracy, resolution)
    if accuracy is None:
        given(pair, torque, phases)
    n_torque = LEAST_TORQUES if isinstance(torque, UpTo) else checked_torque(pair, torque).size
    n_phase = FEWEST_PHASES if phases is None else checked_phases(phases, pair).size
    states = n_torque * n_phase * int(np.prod([values[name].size for name in ORDER]))
    if accuracy is None:
        parts = [Part(states, values, resolution or Resolution())]
    else:
        parts = _coarsest_level(values, states, n_torque, n_phase)
    contact = sum(n * per_state(pair, at, level) for n, at, level in parts)
    checks = sum(n for n, *_ in parts) - states
    return MapCost(states, checks, contact, _uncached(pair, parts), _bytes(pair, states), at_least=bool(checks))


def _coarsest_level(values: dict, states: int, n_torque: int, n_phase: int) -> list[Part]:
    """The map and what its errors take, on the coarsest mesh that `fem.ste.accuracy` tries."""
    level, edges = Slices(), edges_of(values)
    meshed = MESHED_PHASES * (min(n_torque, MESHED_TORQUES) + 1)
    coarse = replace(level, density=level.compared().density)
    section = replace(level, density=replace(coarse.density, width=level.density.width))
    over_phase, over_torque = 2 * n_phase * (CHECKED_TORQUES + 1), 2 * CHECKED_PHASES.size * n_torque
    return [
        Part(states, values, level),
        Part(2 * meshed + over_phase + over_torque + CHECKED_PHASES.size * (n_torque + 1), edges, level),
        Part(meshed, edges, coarse),
        Part(meshed, edges, Resolution.like(coarse)),
        Part(meshed, edges, section),
    ]


def per_state(pair: GearPair, values: dict, resolution: Discretization) -> float:
    """Wall time of a state [s]: more where more slices of more pairs of teeth may touch."""
    even, varying = PER_STATE[type(resolution)]
    varies, _ = across_width(pair, values)
    return varying * resolution.slices / Resolution().slices * pair.eps_gamma / 2 if varies else even


def _uncached(pair: GearPair, parts: list[Part]) -> float:
    """Wall time of the finite elements that are not in the cache [s]."""
    missing = {}
    for _, values, resolution in parts:
        _, whole = across_width(pair, values)
        for gear, density, loaded in elastic(pair, values, resolution):
            for kind, name in solutions(gear, density, loaded, whole=whole).items():
                missing[name] = 0.0 if known(name) else finite_elements(density, kind)
    return sum(missing.values())


def finite_elements(density: Density, kind: str) -> float:
    """Wall time of one solution of a gear's finite elements [s]; kind as `flank_compliance.solutions` names it."""
    pitches = density.teeth + 1 + density.behind
    section = along(density) ** 2 / along(Density()) ** 2
    if kind == NEAR:
        return NEAR_FIELD * pitches * section
    across = density.width / Resolution().density.width * (2 if kind == WHOLE else 1)
    return SOLID * pitches * section**SECTION_POWER * across**WIDTH_POWER


def _bytes(pair: GearPair, states: int) -> int:
    """Of te, what stands beside it, and the shares of all pairs of teeth that may touch."""
    return 8 * states * (3 + len(QUANTITIES) + ceil(pair.eps_gamma) + 1)
