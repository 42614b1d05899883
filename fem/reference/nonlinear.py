"""Static transmission error by one nonlinear contact problem of both gears per phase: the reference method.

Large displacements (St. Venant-Kirchhoff, total Lagrangian), frictionless contact where the flanks are now, Lagrange
multipliers for its pressure. Newton's tangent of the solids is the one at rest, a thousandth off: every step gains
three digits, and one factorization serves all phases and torques.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.linalg import cho_factor, cho_solve
from skfem import ElementHex1, ElementHex2, ElementQuad1, ElementQuad2
from skfem.element import Element

from fem.contact.unilateral import Equilibrium, unilateral_contact
from fem.elasticity.mesh_density import Density
from fem.linalg.direct_solver import Solve
from fem.microgeometry.flank import pitch_deviations
from fem.pair.mesh_position import MeshPosition
from fem.pair.pair import GearPair
from fem.pair.placement import placements
from fem.reference.deformable_gear import ALIKE, Body, added_across, clamped_pair, farthest_tooth, flexibility
from fem.reference.mortar import Gaps, Placement, Touch, gaps, sampling
from fem.reference.st_venant_kirchhoff import internal_force
from fem.ste.inputs import checked_phases, checked_torque
from fem.ste.ste_map import ste_map
from fem.support.arguments import Numbers, checked
from fem.support.progress import bar, shown
from fem.support.representation import exact
from fem.support.validation import number, require, require_kind

__all__ = ["static_transmission_error"]

#: Hats may touch whose gap at rest exceeds the smallest one by less than this, in modules, or by te where that is more.
REACH = 1 / 25
#: Halves of a path of contact count as equal within this share of a pitch.
ROUNDING = 1e-9
ELEMENTS = ElementQuad1, ElementQuad2, ElementHex1, ElementHex2


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
    """STE map of a pair as `fem.static_transmission_error` makes it, by the nonlinear reference method.

    torque      pinion torque F r_b1 [N m], one or several increasing values > 0
    phases      number of equidistant phases from 0, or their values in [0, 1)
    density     of the FE mesh; `Density(flank=66).refined(2)` is within 0.1 % of the converged mean and peak to peak;
                its `edges` are by default where reliefs begin, as in `fem.reference.deformable_gear.with_edges`
    element     of scikit-fem: ElementQuad1() or ElementQuad2() in plane strain (the latter by default), ElementHex1()
                or ElementHex2() in space
    penalty     contact stiffness [Pa/m]; infinite: no penetration at all

    Raises ValueError for unequal face widths and, in plane strain, for helical pairs and flanks that vary across the
    width, RuntimeError where a phase does not converge.
    """
    element, density = element or ElementQuad2(), Density() if density is None else density
    check(pair, element, density)
    require(number("penalty", penalty) > 0, f"penalty must be > 0 [Pa/m]; leave it out for none, got {penalty}")
    torque, phase = checked_load(pair, torque), checked_phases(phases, pair)
    meshing = assembled(pair, density, element, penalty=penalty)
    te = np.empty((torque.size, phase.size))
    with shown(progress):
        for i, at in enumerate(bar(phase, "nonlinear statics")):
            te[:, i] = [equilibrium(meshing, at, one / pair.pinion.r_b).te for one in torque]
    return ste_map(pair, torque, phase, te, method="nonlinear", density=exact(density), penalty=penalty)


def checked_load(pair: GearPair, torque) -> np.ndarray:
    """(n,) pinion torques; ValueError unless they increase from above 0, to what elastic gears may carry [N m]."""
    values = checked_torque(pair, torque)
    require(values[0] > 0, f"torque must be > 0 [N m], got {torque}")
    return values


def check(pair: GearPair, element: Element, density: Density) -> None:
    """ValueError unless teeth of the pair are alike, and in plane strain the same across the width."""
    require_kind("density", density, Density)
    names = ", ".join(f"{one.__name__}()" for one in ELEMENTS)
    require(isinstance(element, ELEMENTS), f"element must be one of {names}, got {element}")
    in_space = "in plane strain; take hexahedra, with fem.nonlinear"
    straight = pair.pinion.beta == 0 or element.dim == 3
    require(straight, f"beta must be 0 {in_space}, got {pair.pinion.beta:g} rad")
    widths = pair.pinion.b, pair.wheel.b
    require(widths[0] == widths[1], f"b of pinion and wheel must be equal, got {widths}; cut the wider one")
    touching, fewest = 2 * farthest_tooth(pair) + 1, min(pair.pinion.z, pair.wheel.z)
    require(touching <= fewest, f"z must be at least the {touching} teeth that may touch, got {fewest}; reduce b")
    for gear in (pair.pinion, pair.wheel):
        require(
            not pitch_deviations(gear.drive_flank),
            "teeth must be alike, got pitch deviations; take fem.static_transmission_error for them",
        )
        varies = np.ptp(added_across(gear), axis=1).max() > ALIKE and element.dim == 2
        require(not varies, f"flanks must be the same across the width {in_space}, got {gear.drive_flank}")


@dataclass(frozen=True)
class Meshing:
    """Both gears, ready to be pressed together: what Newton needs of pinion and wheel.

    lag         share of the transmission error by which the wheel stays behind; the pinion runs ahead by the rest
    """

    pair: GearPair
    bodies: tuple[Body, Body]
    solve: tuple[Solve, Solve]
    flexible: tuple[np.ndarray, np.ndarray]
    penalty: float = np.inf
    lag: float = 0.5

    def places(self, phase: float, te: float) -> tuple[Placement, Placement]:
        """Where the gears stand; the pair with number k touches k pitches ahead of pair 0."""
        gears = placements(MeshPosition(self.pair, self.pair.a, 0.0, phase), te, lag=self.lag)
        pinion, wheel = (Placement(gear.centre[:2], gear.rotation, gear.turn_per_te) for gear in gears)
        return pinion, wheel

    def gaps(self, touch: Touch, places: tuple[Placement, Placement], u) -> Gaps:
        own, mate = touch.own, 1 - touch.own
        flanks = [body.flanks[tooth] for body, tooth in zip(self.bodies, touch.teeth, strict=True)]
        return gaps(flanks[own], flanks[mate], (places[own], places[mate]), (u[own], u[mate]), touch)

    def touches(self, phase: float, te: float = 0.0) -> list[Touch]:
        """Hats of all teeth that come within REACH, or te; they lie on the gear that is nearer to its tip."""
        found, rest = [], [body.rest() for body in self.bodies]
        possible = [touch for touch in self._everywhere(phase) if touch.near.any()]
        at_rest = [self.gaps(touch, self.places(phase, 0.0), rest).gap for touch in possible]
        reach = min(gap.min() for gap in at_rest) + max(REACH * self.pair.pinion.m_n, te)
        for touch, gap in zip(possible, at_rest, strict=True):
            near = touch.near.copy()
            near[near] = gap < reach
            chosen = np.flatnonzero(near.any(axis=1))
            if chosen.size:
                sample = sampling(self.bodies[touch.own].flanks[touch.teeth[touch.own]], chosen)
                found.append(replace(touch, sample=sample, near=near[chosen]))
        return found

    def _everywhere(self, phase: float) -> Iterator[Touch]:
        """All hats of all teeth: on the pinion from the middle of the path of contact on, on the wheel before."""
        pair = self.pair
        middle = (pair.roll_start + pair.roll_end) / 2 - pair.roll_pitch - ROUNDING * pair.p_bt
        for k, own in product(self.bodies[0].flanks, (0, 1)):
            flank = self.bodies[own].flanks[(k, -k)[own]]
            past = (phase + k) * pair.p_bt + flank.width.nodes * np.tan(pair.beta_b) >= middle
            near = np.tile(past if own == 0 else ~past, (flank.arcs.size, 1))
            yield Touch(own, (k, -k), sampling(flank, np.arange(flank.arcs.size)), near)


def assembled(pair: GearPair, density: Density, element: Element, *, penalty=np.inf, lag=0.5) -> Meshing:
    """Statics of a pair."""
    return factorized(pair, clamped_pair(pair, density, element), (0.0, 0.0), penalty=penalty, lag=lag)


def factorized(pair: GearPair, bodies: tuple[Body, Body], masses, *, penalty: float, lag: float) -> Meshing:
    """Meshing whose solids carry diagonal masses (n_dofs,) [N/m] beside their stiffness; a shared one counts once."""
    shared = bodies[0].solid is bodies[1].solid
    first = bodies[0].solver(masses[0])
    second = first if shared else bodies[1].solver(masses[1])
    flexible = flexibility(bodies[0], first)
    other = flexible if shared else flexibility(bodies[1], second)
    return Meshing(pair, bodies, (first, second), (flexible, other), penalty, lag)


@dataclass(frozen=True)
class Rows:
    """Gaps under all hats: values (n,), closing per transmission error (n,), by `Body.transverse` of either gear."""

    gap: np.ndarray
    area: np.ndarray
    closing: np.ndarray
    by: tuple[np.ndarray, np.ndarray]


def rows(meshing: Meshing, touches: list[Touch], phase: float, te: float, u) -> Rows:
    """Gaps of all teeth where the gears are now."""
    places = meshing.places(phase, te)
    found = [meshing.gaps(touch, places, u) for touch in touches]
    gap, area, closing = (np.concatenate([getattr(one, name) for one in found]) for name in ("gap", "area", "closing"))
    by = [np.zeros((gap.size, flexible.shape[0])) for flexible in meshing.flexible]
    first = 0
    for touch, one in zip(touches, found, strict=True):
        last = first + one.gap.size
        for gear in (0, 1):
            part = (one.by_own if gear == touch.own else one.by_mate).reshape(one.gap.size, -1)
            start = list(meshing.bodies[gear].flanks).index(touch.teeth[gear]) * part.shape[1]
            by[gear][first:last, start : start + part.shape[1]] = part
        first = last
    return Rows(gap, area, closing, (by[0], by[1]))


class Correction(NamedTuple):
    """One Newton step: new transmission error [m], steps of the displacements, forces under the hats (n,) [N]."""

    te: float
    du: tuple[np.ndarray, np.ndarray]
    f: np.ndarray


def correction(meshing: Meshing, here: Rows, te: float, residual, force: float, inertia: float = 0.0) -> Correction:
    """Newton step with f >= 0 under the hats, gap >= 0 after the step, and closing . f + inertia (new te - te) = force.

    residual    per gear (n_dofs, dim) forces other than contact that are not balanced yet [N]
    """
    flanks = [body.transverse for body in meshing.bodies]
    free = [solve(r[..., None])[..., 0] for solve, r in zip(meshing.solve, residual, strict=True)]
    moved = sum(g @ (p @ z.ravel()) for g, z, p in zip(here.by, free, flanks, strict=True))
    matrix = sum(under_hats(g, s) for g, s in zip(here.by, meshing.flexible, strict=True))
    matrix = matrix + np.diag(1 / (meshing.penalty * np.cos(meshing.pair.beta_b) * here.area))
    ahead = here.gap + here.closing * te + moved
    te, f = complementarity(matrix, ahead, here.closing, force + inertia * te, inertia)
    du = []
    for solve, g, z, p in zip(meshing.solve, here.by, free, flanks, strict=True):
        du.append(z + solve((p.T @ (f @ g)).reshape(*z.shape, 1))[..., 0])
    return Correction(te, (du[0], du[1]), f)


def under_hats(by: np.ndarray, flexible: np.ndarray) -> np.ndarray:
    """(n, n) by flexible by^T [m/N]; most columns of by are zero."""
    some = np.flatnonzero(by.any(axis=0))
    return by[:, some] @ flexible[np.ix_(some, some)] @ by[:, some].T


def complementarity(matrix, gap, closing, force: float, inertia: float = 0.0) -> tuple[float, np.ndarray]:
    """te and f >= 0 with gap + matrix f - closing te >= 0, complementary, and closing . f + inertia te = force.

    Raises RuntimeError where no active set converges.
    """
    first_touch = gap / closing

    def equilibrium(active: np.ndarray) -> Equilibrium:
        touching = active[0] if active.any() or inertia else first_touch == first_touch.min()
        factor = cho_factor(matrix[np.ix_(touching, touching)], lower=True, check_finite=False)
        per_error, per_gap = cho_solve(factor, np.stack([closing[touching], gap[touching]], axis=1)).T
        stiffness = closing[touching] @ per_error + inertia
        te = np.array([(force + closing[touching] @ per_gap) / stiffness])
        f = np.zeros((1, gap.size))
        f[0, touching] = per_error * te - per_gap
        slack = np.where(touching, 0.0, gap + matrix @ f[0] - closing * te)
        return Equilibrium(te, np.array([stiffness]), f, slack[None])

    state = unilateral_contact(equilibrium, first_touch[None] < first_touch.min() + 1e-9)
    return float(state.te[0]), state.force[0]


class State(NamedTuple):
    """Transmission error [m], displacements of pinion and wheel (n_dofs, dim), forces under the hats (n,) [N]."""

    te: float
    u: tuple[np.ndarray, np.ndarray]
    f: np.ndarray
    touches: list[Touch]


def equilibrium(meshing: Meshing, phase: float, force: float, tolerance: float = 1e-6) -> State:
    """Balance of both gears under the mesh force force > 0 [N].

    Raises RuntimeError where Newton's steps do not fall below tolerance times the displacement.
    """
    phase = phase - round(phase)
    state = _settled(meshing, phase, meshing.touches(phase), force, tolerance)
    if state.te <= REACH * meshing.pair.pinion.m_n:
        return state
    return _settled(meshing, phase, meshing.touches(phase, state.te), force, tolerance)


def _settled(meshing: Meshing, phase: float, touches: list[Touch], force: float, tolerance: float) -> State:
    """The same where no other hats touch."""
    te, u = 0.0, tuple(body.rest() for body in meshing.bodies)
    for _ in range(30):
        residual = [-internal_force(body.solid, v) for body, v in zip(meshing.bodies, u, strict=True)]
        share = meshing.bodies[0].share
        te, du, f = correction(meshing, rows(meshing, touches, phase, te, u), te, residual, force * share)
        u = (u[0] + du[0], u[1] + du[1])
        if max(np.abs(du[0]).max(), np.abs(du[1]).max()) < tolerance * np.abs(u[0]).max():
            return State(te, u, f, touches)
    raise RuntimeError(f"no equilibrium at phase {phase:g} after 30 steps; try a finer density or less torque")
