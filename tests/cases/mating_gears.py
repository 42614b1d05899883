"""Deformable gears of `fem.nonlinear`: their flanks in contact, gaps and unbalanced forces in given positions."""

import numpy as np
from skfem.element import Element
from twins import plane_twin
from whole_section import FACES

import fem
from fem import Density
from fem.reference.deformable_gear import DeformableGear, discretized, with_edges
from fem.reference.mortar import MatingGears, PairGaps, pair_gaps


def deformable_gear(gear: fem.Gear, density: Density, element: Element, *, half: bool = False) -> DeformableGear:
    """Finite elements of a gear; hexahedra over the whole face width or half of it."""
    return discretized(gear, density, element, face=FACES["equal" if half else "any"])


def mating(pair: fem.GearPair, *gears: DeformableGear, wheel_share: float = 0.5) -> MatingGears:
    """Pinion and wheel in contact; a single deformable gear is both."""
    return MatingGears(pair, (gears[0], gears[-1]), wheel_share)


def gaps_of(gears: MatingGears, phase: float, te: float, u=None, *, candidates=None) -> PairGaps:
    """Gaps of gears with displacements u of pinion and wheel, without by default."""
    u = [gear.undeformed() for gear in gears.gears] if u is None else u
    return pair_gaps(gears, gears.candidates(phase) if candidates is None else candidates, phase, te, u)


def unbalanced_force(gear: DeformableGear, load: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Nodal forces (n_dofs, dim) [N] of a load that stresses under displacements u do not carry."""
    return load.reshape(u.shape) - gear.internal_force(u)


def graded_twin(pair: fem.GearPair, density: Density, refined: int):
    """Pinion in plane strain, with smaller elements where reliefs of either gear begin."""
    return plane_twin(pair.pinion, with_edges(pair, density)[0], refined)
