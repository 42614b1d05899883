"""Static transmission error by one nonlinear contact problem of both gears per phase: the reference method.

Large displacements (St. Venant-Kirchhoff, total Lagrangian), frictionless contact where the flanks are now, Lagrange
multipliers for its pressure. Newton's tangent of the solids is the one at rest, a thousandth off: every step gains
three digits, and one factorization serves all phases and torques.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.linalg import cho_factor, cho_solve
from skfem import ElementHex1, ElementHex2, ElementQuad1, ElementQuad2
from skfem.element import Element

from fem.body import TEETH, Body, clamped_pair, flexibility
from fem.deviation import PitchDeviation
from fem.flank import removed
from fem.gear import GearPair, require
from fem.mesh import Density
from fem.profile import flank
from fem.progress import bar, shown
from fem.solid import internal_force
from fem.solver import Solve
from fem.ste import ste_map
from fem.touch import Gaps, Placement, Touch, gaps, sampling

#: Reach of the contact search before the gears deflect, in modules.
REACH = 1 / 25
ELEMENTS = ElementQuad1, ElementQuad2, ElementHex1, ElementHex2


def static_transmission_error(
    pair: GearPair,
    torque,
    phases=30,
    *,
    density: Density | None = None,
    element: Element | None = None,
    penalty: float = np.inf,
    progress: bool = True,
) -> xr.Dataset:
    """STE map of a spur pair as `fem.static_transmission_error` makes it, by the nonlinear reference method.

    torque      pinion torque F r_b1 [N m], one or several increasing values > 0
    phases      number of equidistant phases from 0, or their values
    density     of the FE mesh; `Density(flank=66).refined(2)` is within 0.1 % of the converged mean and peak to peak;
                its `edges` are by default where reliefs begin, as in `fem.body.with_edges`
    element     of scikit-fem: ElementQuad1() or ElementQuad2() in plane strain (the latter by default), ElementHex1()
                or ElementHex2() in space
    penalty     contact stiffness [Pa/m]; infinite: no penetration at all

    Raises ValueError for helical pairs, unequal face widths and flanks that the mesh cannot tell apart, RuntimeError
    where a phase does not converge.
    """
    element, density = element or ElementQuad2(), density or Density()
    check(pair, element)
    torque = np.atleast_1d(np.asarray(torque, float))
    rising = torque.size > 0 and torque[0] > 0 and bool((np.diff(torque) > 0).all())
    require(rising, f"torque must increase from above 0 [N m]; sort it, got {torque}")
    phase = np.arange(phases) / phases if np.ndim(phases) == 0 else np.asarray(phases, float)
    meshing = assembled(pair, density, element, penalty=penalty)
    te = np.empty((torque.size, phase.size))
    with shown(progress):
        for i, at in enumerate(bar(phase, "nonlinear statics")):
            te[:, i] = [equilibrium(meshing, at, one / pair.pinion.r_b).te for one in torque]
    return ste_map(pair, torque, phase, te, method="nonlinear", density=str(density), penalty=penalty)


def check(pair: GearPair, element: Element) -> None:
    """ValueError unless teeth of the pair are alike and as symmetric across the width as the mesh of the element."""
    names = ", ".join(f"{one.__name__}()" for one in ELEMENTS)
    require(isinstance(element, ELEMENTS), f"element must be one of {names}, got {element}")
    require(pair.pinion.beta == 0, f"beta must be 0, got {pair.pinion.beta:g} rad; only spur pairs are solved")
    widths = pair.pinion.b, pair.wheel.b
    require(widths[0] == widths[1], f"b of pinion and wheel must be equal, got {widths}; cut the wider one")
    for gear in (pair.pinion, pair.wheel):
        alike = not any(isinstance(part, PitchDeviation) for part in gear.drive_flank)
        require(alike, "teeth must be alike, got pitch deviations; take fem.static_transmission_error for them")
        roll = np.linspace(gear.roll_form, gear.roll_tip, 9)[:, None]
        added = removed(gear.drive_flank, gear.face, roll, np.linspace(-gear.b / 2, gear.b / 2, 9))
        other = added[:, ::-1] if element.dim == 3 else added[:, :1]
        wanted = "symmetric about mid-plane" if element.dim == 3 else "the same across the width; or take ElementHex1()"
        require(np.abs(added - other).max() < 1e-9, f"flanks must be {wanted}, got {gear.drive_flank}")


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
        pair, found = self.pair, []
        back = pair.wheel.r_b * np.tan(pair.alpha_wt)
        for gear, side, centre, roll, share in (
            (pair.pinion, 0.0, 0.0, pair.roll_pitch + phase * pair.p_bt, 1 - self.lag),
            (pair.wheel, np.pi, pair.a, back - phase * pair.p_bt, self.lag),
        ):
            base = np.pi / 2 + float(flank(gear, [0.0]).psi[0])
            angle = side - pair.alpha_wt - base + (roll + share * te) / gear.r_b
            found.append(Placement(np.array([centre, 0.0]), angle, share / gear.r_b))
        return found[0], found[1]

    def gaps(self, touch: Touch, places: tuple[Placement, Placement], u) -> Gaps:
        own, mate = touch.own, 1 - touch.own
        flanks = [body.flanks[tooth] for body, tooth in zip(self.bodies, touch.teeth, strict=True)]
        return gaps(flanks[own], flanks[mate], (places[own], places[mate]), (u[own], u[mate]), touch.sample)

    def touches(self, phase: float) -> list[Touch]:
        """Hats of all teeth that come within REACH; they lie on the gear that is nearer to its tip."""
        found, rest = [], [body.rest() for body in self.bodies]
        for k in TEETH:
            own = 1 if phase + k < 0 else 0
            flank = self.bodies[own].flanks[(k, -k)[own]]
            everywhere = Touch(own, (k, -k), sampling(flank, np.arange(flank.arcs.size)))
            gap = self.gaps(everywhere, self.places(phase, 0.0), rest).gap.reshape(flank.arcs.size, -1)
            near = np.flatnonzero(gap.min(axis=1) < REACH * flank.gear.m_n)
            found += [Touch(own, (k, -k), sampling(flank, near))] if near.size else []
        return found


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
    """Gaps under all hats: values (n,), closing per transmission error (n,), derivatives (n, n_flank_dofs) per gear."""

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
            start = TEETH.index(touch.teeth[gear]) * part.shape[1]
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
    dofs = [body.flank_dofs for body in meshing.bodies]
    free = [solve(r[..., None])[..., 0] for solve, r in zip(meshing.solve, residual, strict=True)]
    moved = sum(g @ z.ravel()[d] for g, z, d in zip(here.by, free, dofs, strict=True))
    matrix = sum(g @ s @ g.T for g, s in zip(here.by, meshing.flexible, strict=True))
    matrix = matrix + np.diag(1 / (meshing.penalty * here.area))
    ahead = here.gap + here.closing * te + moved
    te, f = complementarity(matrix, ahead, here.closing, force + inertia * te, inertia)
    du = []
    for solve, g, z, d in zip(meshing.solve, here.by, free, dofs, strict=True):
        load = np.zeros(z.size)
        load[d] = f @ g
        du.append(z + solve(load.reshape(*z.shape, 1))[..., 0])
    return Correction(te, (du[0], du[1]), f)


def complementarity(matrix, gap, closing, force: float, inertia: float = 0.0) -> tuple[float, np.ndarray]:
    """te and f >= 0 with gap + matrix f - closing te >= 0, complementary, and closing . f + inertia te = force.

    Primal-dual active set (Hintermueller, Ito, Kunisch 2003). Raises RuntimeError where none settles.
    """
    rng = np.random.default_rng(0)
    active = gap / closing < (gap / closing).min() + 1e-9
    for step in range(200):
        factor = cho_factor(matrix[np.ix_(active, active)], lower=True, check_finite=False)
        per_error, per_gap = cho_solve(factor, np.stack([closing[active], gap[active]], axis=1)).T
        te = float((force + closing[active] @ per_gap) / (closing[active] @ per_error + inertia))
        f = np.zeros(gap.size)
        f[active] = per_error * te - per_gap
        slack = gap + matrix @ f - closing * te
        wanted = np.where(active, f > 0, slack < 0)
        if (wanted == active).all():
            return te, f
        active = wanted if step < 30 else np.where(rng.random(active.size) < 0.5, wanted, active)
        if not active.any() and inertia == 0:
            active[np.argmin(slack / closing)] = True
    raise RuntimeError("contact did not settle in 200 active sets; try a neighbouring phase or a finer density")


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
    touches = meshing.touches(phase)
    te, u = 0.0, tuple(body.rest() for body in meshing.bodies)
    for _ in range(30):
        residual = [-internal_force(body.solid, v) for body, v in zip(meshing.bodies, u, strict=True)]
        share = meshing.bodies[0].share
        te, du, f = correction(meshing, rows(meshing, touches, phase, te, u), te, residual, force * share)
        u = (u[0] + du[0], u[1] + du[1])
        if max(np.abs(du[0]).max(), np.abs(du[1]).max()) < tolerance * np.abs(u[0]).max():
            return State(te, u, f, touches)
    raise RuntimeError(f"no equilibrium at phase {phase:g} after 30 steps; try a finer density or less torque")
