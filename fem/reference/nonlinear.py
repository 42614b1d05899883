"""Static transmission error by one nonlinear contact problem of both gears per phase: the reference method.

Find the displacements u of both gears, the transmission error te and the contact forces f with

    R(u) = G(u, te)^T f                             internal forces balance the contact forces
    g(u, te) >= 0,  f >= 0,  g . f = 0              no penetration, no tension
    c(u, te) . f = F                                mesh force, torque over base radius

R: internal force of St. Venant-Kirchhoff solids (large displacements), g: weighted gaps of `fem.reference.mortar`,
G = dg/du, c = -dg/dte. Each Newton step linearizes the gaps and takes the stiffness K of the undeformed solids, which
differs from the tangent by a thousandth: every step gains three digits, and one factorization serves all phases and
torques. Elimination of u leaves a complementarity problem of the size of f with the matrix G K^-1 G^T. Sources: Bonet
and Wood (2008) for the solids, Hintermueller, Ito and Kunisch (2003) for the active set.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.linalg import cho_factor, cho_solve
from skfem import ElementHex1, ElementHex2, ElementQuad1, ElementQuad2
from skfem.element import Element

from fem.contact.unilateral import Equilibrium, unilateral_contact
from fem.elasticity.mesh_density import Density
from fem.linalg.direct_solver import Solve
from fem.microgeometry.flank import names_teeth
from fem.pair.pair import GearPair
from fem.reference import mortar
from fem.reference.deformable_gear import (
    EQUAL_WITHIN,
    DeformableGear,
    clamped_pair,
    flank_flexibility,
    last_tooth_in_contact,
    sampled_modification,
)
from fem.reference.mortar import ContactCandidate, MatingGears, PairGaps, pair_gaps
from fem.ste.inputs import checked_phases, checked_torque
from fem.ste.ste_map import ste_map
from fem.support.arguments import Numbers, checked
from fem.support.progress import bar, shown
from fem.support.representation import exact
from fem.support.validation import number, require, require_kind

__all__ = ["static_transmission_error"]


def __dir__() -> list[str]:
    """Public names, for help and completion."""
    return __all__


ELEMENTS = ElementQuad1, ElementQuad2, ElementHex1, ElementHex2
#: Newton steps of one equilibrium.
NEWTON_STEPS = 30


@checked
def static_transmission_error(
    pair: GearPair,
    torque: Numbers,
    phases: Numbers = 30,
    *,
    density: Density | None = None,
    element: Element | None = None,
    penalty: float = np.inf,
    progress: bool = True,
) -> xr.Dataset:
    """STE map of a pair in the format of `fem.static_transmission_error`, by the nonlinear reference method.

    torque      pinion torque F r_b1 [N m], one or several increasing values > 0
    phases      number of equidistant phases from 0, or their values in [0, 1)
    density     of the FE mesh; in plane strain `Density(flank=66).refined(2)` is within 0.1 % of the converged mean and
                peak to peak; of internal pairs te lacks about 0.5 % where teeth take over, on
                `Density(flank=132, tooth=16)` 0.3 %. Its `edges` are by default where reliefs begin, as in
                `fem.reference.deformable_gear.with_edges`. Hexahedra of helical gears need many elements across the
                width: where a contact line crosses several flank elements within one of them, the contact is too soft
                (at 20 deg, on the default 3 elements across half the width, te is a third too large at light load and
                2 % at full load)
    element     of scikit-fem: ElementQuad1() or ElementQuad2() in plane strain (the latter by default), ElementHex1()
                or ElementHex2() in space
    penalty     contact stiffness [Pa/m]; infinite: no penetration at all

    The rim of a ring may be on supports, which in space act on the mean displacement of the rim across the face and
    hold it against tilting and along its axis, as in a map. All teeth of the ring are in the finite elements, and the
    mesh is at the teeth 0 and -1 of the ring: its ring angle is 2 pi phase / |z|, of phases from 1/2 on that of the
    phase less 1.

    Raises ValueError for unequal face widths and, in plane strain, for helical pairs and flanks that vary across the
    width, RuntimeError where a phase does not converge.
    """
    element, density = element or ElementQuad2(), Density() if density is None else density
    check(pair, element, density)
    require(number("penalty", penalty) > 0, f"penalty must be > 0 [Pa/m]; leave it out for none, got {penalty}")
    torque, phase = checked_load(pair, torque), checked_phases(phases, pair)
    problem = static_problem(pair, density, element, penalty=penalty)
    te = np.empty((torque.size, phase.size))
    with shown(progress):
        for column, value in enumerate(bar(phase, "nonlinear statics")):
            te[:, column] = [equilibrium(problem, value, force).te for force in torque / pair.pinion.r_b]
    return ste_map(pair, torque, phase, te, method="nonlinear", density=exact(density), penalty=penalty)


def checked_load(pair: GearPair, torque) -> np.ndarray:
    """(n,) pinion torques [N m]; ValueError unless they increase from above 0 up to what elastic gears carry."""
    values = checked_torque(pair, torque)
    require(values[0] > 0, f"torque must be > 0 [N m], got {torque}")
    return values


def check(pair: GearPair, element: Element, density: Density) -> None:
    """ValueError unless the method models the pair: equal teeth and, in plane strain, no variation across the width."""
    require_kind("density", density, Density)
    names = ", ".join(f"{kind.__name__}()" for kind in ELEMENTS)
    require(isinstance(element, ELEMENTS), f"element must be one of {names}, got {element}")
    in_space = "in plane strain; take hexahedra, with fem.nonlinear"
    straight = pair.pinion.beta == 0 or element.dim == 3
    require(straight, f"beta must be 0 {in_space}, got {pair.pinion.beta:g} rad")
    widths = pair.pinion.b, pair.wheel.b
    require(widths[0] == widths[1], f"b of pinion and wheel must be equal, got {widths}; cut the wider one")
    touching, fewest = 2 * last_tooth_in_contact(pair) + 1, min(pair.pinion.z, abs(pair.wheel.z))
    require(touching <= fewest, f"z must be at least the {touching} teeth that may touch, got {fewest}; reduce b")
    for gear in (pair.pinion, pair.wheel):
        require(
            not names_teeth(gear.drive_flank),
            "teeth must be alike, got deviations of single teeth; take fem.static_transmission_error for them",
        )
        varies = np.ptp(sampled_modification(gear), axis=1).max() > EQUAL_WITHIN and element.dim == 2
        require(not varies, f"flanks must be the same across the width {in_space}, got {gear.drive_flank}")


@dataclass(frozen=True)
class ContactProblem:
    """Mating gears with their factorized stiffness.

    solvers         solvers of pinion and wheel from `DeformableGear.solver`
    flexibility     flexibilities of their flanks from `flank_flexibility` [m/N]
    penalty         contact stiffness [Pa/m]
    """

    mating: MatingGears
    solvers: tuple[Solve, Solve]
    flexibility: tuple[np.ndarray, np.ndarray]
    penalty: float = np.inf

    @property
    def pair(self) -> GearPair:
        return self.mating.pair

    @property
    def gears(self) -> tuple[DeformableGear, DeformableGear]:
        return self.mating.gears

    def displacements(self, forces: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Of pinion and wheel under nodal forces (n_dofs, dim) each; a shared solid is solved once for both."""
        pinion, wheel = self.solvers
        if pinion is wheel:
            both = pinion(np.stack(list(forces), axis=-1))
            return both[..., 0], both[..., 1]
        return pinion(forces[0][..., None])[..., 0], wheel(forces[1][..., None])[..., 0]


def static_problem(pair: GearPair, density: Density, element: Element, *, penalty=np.inf, wheel_share=0.5):
    """`ContactProblem` without masses."""
    return contact_problem(MatingGears(pair, clamped_pair(pair, density, element), wheel_share), penalty=penalty)


def contact_problem(mating: MatingGears, masses=(0.0, 0.0), *, penalty: float = np.inf) -> ContactProblem:
    """Factorized problem; diagonal masses (n_dofs,) [N/m] add to the stiffness, those of a shared solid once."""
    pinion, wheel = mating.gears
    solve = pinion.solver(masses[0])
    flexibility = flank_flexibility(pinion, masses[0])
    if wheel.solid is pinion.solid:
        return ContactProblem(mating, (solve, solve), (flexibility, flexibility), penalty)
    solve_wheel = wheel.solver(masses[1])
    return ContactProblem(mating, (solve, solve_wheel), (flexibility, flank_flexibility(wheel, masses[1])), penalty)


class NewtonStep(NamedTuple):
    """New transmission error [m], steps of the displacements (n_dofs, dim) [m], new contact forces (n,) [N]."""

    te: float
    du: tuple[np.ndarray, np.ndarray]
    contact_forces: np.ndarray


def newton_step(
    problem: ContactProblem, gaps: PairGaps, te: float, residual, force: float, inertia: float = 0.0
) -> NewtonStep:
    """Step to f >= 0, gap >= 0 and closing . f + inertia (new te - te) = force.

    residual    per gear (n_dofs, dim) unbalanced forces apart from the contact [N]
    """
    operators = [gear.flank_operator for gear in problem.gears]
    free_steps = problem.displacements(residual)
    parts = list(zip(gaps.gradients, operators, free_steps, strict=True))
    free_change = sum(gradient @ (operator @ du.ravel()) for gradient, operator, du in parts)
    matrix = sum(gap_flexibility(*side) for side in zip(gaps.gradients, problem.flexibility, strict=True))
    matrix = matrix + np.diag(1 / (problem.penalty * np.cos(problem.pair.beta_b) * gaps.area))
    gap = gaps.gap + gaps.closing * te + free_change
    te, f = complementarity(matrix, gap, gaps.closing, force + inertia * te, inertia)
    loads = [(operator.T @ (f @ gradient)).reshape(du.shape) for gradient, operator, du in parts]
    pressed = problem.displacements(loads)
    return NewtonStep(te, (free_steps[0] + pressed[0], free_steps[1] + pressed[1]), f)


def gap_flexibility(gradient: np.ndarray, flexibility: np.ndarray) -> np.ndarray:
    """(n, n) gradient flexibility gradient^T: change of the gaps per contact force [m/N].

    Most columns of the gradient are zero.
    """
    columns = np.flatnonzero(gradient.any(axis=0))
    return gradient[:, columns] @ flexibility[np.ix_(columns, columns)] @ gradient[:, columns].T


def complementarity(matrix, gap, closing, force: float, inertia: float = 0.0) -> tuple[float, np.ndarray]:
    """te and f >= 0 with gap + matrix f - closing te >= 0, complementary, and closing . f + inertia te = force.

    Raises RuntimeError where no active set converges.
    """
    first_touch = gap / closing

    def solve(_, active: np.ndarray) -> Equilibrium:
        touching = active if active.any() or inertia else first_touch == first_touch.min()
        factor = cho_factor(matrix[np.ix_(touching, touching)], lower=True, check_finite=False)
        per_te, per_gap = cho_solve(factor, np.stack([closing[touching], gap[touching]], axis=1)).T
        stiffness = closing[touching] @ per_te + inertia
        te, f = float((force + closing[touching] @ per_gap) / stiffness), np.zeros(gap.size)
        f[touching] = per_te * te - per_gap
        slack = np.where(touching, 0.0, gap + matrix @ f - closing * te)
        return Equilibrium(te, float(stiffness), f, slack, True)

    state = unilateral_contact(solve)(None, first_touch < first_touch.min() + 1e-9)
    return state.te, state.force


class StaticState(NamedTuple):
    """Transmission error [m], displacements of both gears (n_dofs, dim) [m], contact forces (n,) [N] on candidates."""

    te: float
    u: tuple[np.ndarray, np.ndarray]
    contact_forces: np.ndarray
    candidates: list[ContactCandidate]


def equilibrium(problem: ContactProblem, phase: float, force: float, tolerance: float = 1e-6) -> StaticState:
    """Equilibrium of both gears under the mesh force force > 0 [N].

    Raises RuntimeError where Newton's steps stay larger than tolerance times the displacement.
    """
    phase, mating = phase - round(phase), problem.mating
    state = _newton(problem, phase, mating.candidates(phase), force, tolerance)
    if state.te <= mortar.CANDIDATE_GAP * problem.pair.pinion.m_n:
        return state
    return _newton(problem, phase, mating.candidates(phase, state.te), force, tolerance)


def _newton(
    problem: ContactProblem, phase: float, candidates: list[ContactCandidate], force: float, tolerance: float
) -> StaticState:
    """`equilibrium` with contact of the candidates only."""
    te, u, force = 0.0, tuple(gear.undeformed() for gear in problem.gears), force * problem.gears[0].face.share
    for _ in range(NEWTON_STEPS):
        residual = [-gear.internal_force(displacement) for gear, displacement in zip(problem.gears, u, strict=True)]
        gaps = pair_gaps(problem.mating, candidates, phase, te, u)
        te, du, f = newton_step(problem, gaps, te, residual, force)
        u = (u[0] + du[0], u[1] + du[1])
        if max(np.abs(du[0]).max(), np.abs(du[1]).max()) < tolerance * np.abs(u[0]).max():
            return StaticState(te, u, f, candidates)
    steps = f"after {NEWTON_STEPS} Newton steps"
    raise RuntimeError(f"no equilibrium at phase {phase:g} {steps}; try a finer density or less torque")
