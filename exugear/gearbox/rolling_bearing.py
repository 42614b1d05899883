"""Rolling bearings as data: rows of balls or rollers from their inner geometry, and the states they take under load."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from math import cos, inf, pi, sin
from typing import Any

import numpy as np

from exugear.gearbox.bearing import RIGID, SOFT, Bearing, about_pole
from exugear.gearbox.drag import AnyDrag
from exugear.rolling_bearings.catalogue import HABITS, Sizes, capacity_errors, described, estimated_row, pitch_diameter
from exugear.rolling_bearings.law import LawRecord, Response, law_record, response
from exugear.rolling_bearings.life import dynamic_capacity, reference_life
from exugear.rolling_bearings.rows import SHORT_DROP, TAPERED_DROP, BallRow, RollerRow, Row
from exugear.rolling_bearings.statics import NotCarried, equilibrium
from fem.support.arguments import Finite, Numbers, checked
from fem.support.user_warning import warn_user
from fem.support.validation import require, require_finite
from fem.units import deg, mm, um

#: Ranges of diameters [m], clearances [m] and contact angles [rad] in which they are taken as given in their units.
DIAMETERS, LARGEST_CLEARANCE, LARGEST_ANGLE = (0.1e-3, 3.0), 1e-3, 80 * deg
#: Fewest and most elements of a row.
ELEMENTS = 3, 500
#: Arrangements of pairs: directions of the row with the smaller and with the larger axial position.
ARRANGEMENTS = {"O": (1, -1), "X": (-1, 1), "tandem": (1, 1)}
COORDINATES = 5
#: Largest error of the capacities of an estimated bearing [1]: those of catalogues are within a few per cent.
LARGEST_CAPACITY_ERROR = 0.25
#: Laminae of a roller unless others are given.
LAMINAE = 30


@checked
@dataclass(frozen=True, repr=False)
class RollingBearing:
    """A rolling bearing from its inner geometry, at an axial position of a shaft, whose inner ring turns with it.

    kind           in words
    rows           of balls or rollers (`exugear.rolling_bearings.rows`): make them by `deep_groove`,
                   `angular_contact`, `cylindrical_roller`, `tapered_roller`, `needle`, and pairs by `paired`
    C              dynamic radial capacity of a single row [N]; by default that of ISO 281 for the geometry
    damping_time   damping over stiffness [s]: force = dU/dq + damping_time d2U/dq2 dq/dt
    drag           `Drag`, `BearingDrag` or `SkfDrag`: the torque by which it brakes the shaft
    guidance       stiffness of ribs or thrust washers along the axis, beside that of the rows [N/m]
    estimate       how the geometry was estimated, with its error (`from_catalogue`); empty where it is given
    linear         whether runs take the constant stiffness of the shaft's centred position: `plan` chooses that where
                   the load keeps to it; life and pressures follow from the geometry in any case

    Force and moment are the slopes of one energy U of displacement and tilts (x, y, z, about x, about y), Hertzian
    contacts of balls, laminae of rollers with their profile: the stiffness is symmetric. Rings are rigid, centrifugal
    and gyroscopic forces of the elements are left out. The cage stands unless it is let roll (`rolling`). On a planet
    its inner ring is the pin: it is then the planet that turns.

    T. A. Harris and M. N. Kotzalas, Rolling bearing analysis, CRC Press (2007); ISO/TS 16281:2008, whose formulas and
    constants were compared with public programs that cite its equations, not with its text. One radius D_pw / 2 counts
    in kinematics and moment, where ISO/TS 16281 has the radius of the inner groove's centre in the kinematics.
    """

    kind: str
    rows: tuple[Row, ...]
    C: float = field(kw_only=True)
    damping_time: float = field(default=0.0, kw_only=True)
    drag: AnyDrag | None = field(default=None, kw_only=True)
    guidance: float = field(default=0.0, kw_only=True)
    estimate: str = field(default="", kw_only=True)
    linear: bool = field(default=False, kw_only=True)

    def __post_init__(self):
        require(len(self.rows) > 0, "rows must hold at least one row of balls or rollers, got none")
        require(0 < self.C < inf, f"C must be > 0 N and finite, got {self.C}; pass newtons: 23.4 kN are 23.4e3")
        ratio = f"damping_time must lie in [0, 0.1) s, got {self.damping_time}; pass damping / stiffness"
        require(0 <= self.damping_time < 0.1, ratio)
        stiff = self.guidance == 0 or SOFT <= self.guidance < RIGID
        unit = f"guidance must be 0 or lie in [{SOFT:g}, {RIGID:g}) N/m, got {self.guidance:g}; 20 N/um are 20e6 N/m"
        require(stiff, unit)

    def __getstate__(self) -> dict:
        """The fields alone: the laws are made anew, which takes less time than to send them to another process."""
        return {part.name: getattr(self, part.name) for part in fields(self)}

    def __repr__(self) -> str:
        parts = [f"kind={self.kind!r}", *map(_described, self.rows), f"C={self.C:g} N"]
        parts += [f"damping_time={self.damping_time:g} s"] * (self.damping_time > 0)
        parts += [f"guidance={self.guidance:g} N/m"] * (self.guidance > 0)
        parts += [f"drag={self.drag!r}"] * (self.drag is not None) + ["geometry estimated"] * bool(self.estimate)
        return f"RollingBearing({', '.join(parts)})"

    @classmethod
    @checked
    def deep_groove(
        cls,
        *,
        Z: int,
        D_w: float,
        D_pw: float,
        r_i: float | None = None,
        r_e: float | None = None,
        clearance: float = 0.0,
        C: float | None = None,
        E: float = 210e9,
        nu: float = 0.3,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "RollingBearing":
        """A deep groove ball bearing.

        Z           number of balls
        D_w, D_pw   diameter of the balls, of the pitch circle [m]
        r_i, r_e    radii of the grooves of inner and outer ring [m]; by default 0.52 and 0.53 D_w
        clearance   diametral one in operation [m]
        C           dynamic radial capacity [N]; by default that of ISO 281 for the geometry
        E, nu       Young's modulus [Pa] and Poisson's ratio

        damping_time and drag as in `RollingBearing`. Displacements count from the centred position, so that the axial
        play is part of them. Raises ValueError for impossible geometry and values that suggest another unit.
        """
        _check_elements(Z, D_w, D_pw, E, nu)
        _check_clearance(clearance)
        r_i, r_e = _grooves(D_w, r_i, r_e)
        R_0 = r_i + r_e - D_w - clearance / 2
        require(R_0 > 0, f"clearance {clearance:g} m leaves no contact of grooves r_i = {r_i:g}, r_e = {r_e:g} m")
        row = BallRow(Z, D_w, D_pw, 0.0, E, nu, r_i=r_i, r_e=r_e, R_0=R_0)
        return cls._of("deep groove", row, C, damping_time, drag)

    @classmethod
    @checked
    def angular_contact(
        cls,
        *,
        Z: int,
        D_w: float,
        D_pw: float,
        alpha: float,
        r_i: float | None = None,
        r_e: float | None = None,
        direction: int = 1,
        C: float | None = None,
        E: float = 210e9,
        nu: float = 0.3,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "RollingBearing":
        """An angular contact ball bearing, whose balls just touch both rings in the centred position.

        alpha       contact angle [rad]
        direction   1: it carries axial forces on the shaft along z, -1: against z

        The rest as in `deep_groove`; `paired` makes pairs of it.
        """
        _check_elements(Z, D_w, D_pw, E, nu)
        _check_angle(alpha, direction)
        r_i, r_e = _grooves(D_w, r_i, r_e)
        A = r_i + r_e - D_w
        X_0, R_0 = A * sin(alpha), A * cos(alpha)
        row = BallRow(Z, D_w, D_pw, alpha, E, nu, direction=direction, r_i=r_i, r_e=r_e, X_0=X_0, R_0=R_0)
        return cls._of("angular contact", row, C, damping_time, drag)

    @classmethod
    @checked
    def cylindrical_roller(
        cls,
        *,
        Z: int,
        D_w: float,
        D_pw: float,
        L_we: float,
        clearance: float = 0.0,
        laminae: int = LAMINAE,
        guidance: float = 0.0,
        C: float | None = None,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "RollingBearing":
        """A cylindrical roller bearing of steel; without guidance it carries no axial force.

        Z           number of rollers
        D_w, D_pw   diameter of the rollers, of the pitch circle [m]
        L_we        effective length of a roller [m]
        clearance   diametral one in operation [m]
        laminae     number of laminae into which a roller is cut, with the profile of ISO/TS 16281
        guidance    stiffness of its ribs along the axis, taken the same in both directions and without play [N/m]
        C           dynamic radial capacity [N]; by default that of ISO 281 for the geometry

        damping_time and drag as in `RollingBearing`. Raises ValueError for impossible geometry and values that suggest
        another unit.
        """
        row = _roller_row(Z, D_w, D_pw, L_we, laminae, 0.0, 1, SHORT_DROP, clearance)
        return cls._of("cylindrical roller", row, C, damping_time, drag, guidance)

    @classmethod
    @checked
    def needle(
        cls,
        *,
        Z: int,
        D_w: float,
        D_pw: float,
        L_we: float,
        clearance: float = 0.0,
        laminae: int = LAMINAE,
        guidance: float = 0.0,
        C: float | None = None,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "RollingBearing":
        """A needle roller bearing: as `cylindrical_roller`, with long rollers that only drop near their ends.

        guidance   stiffness of the thrust washers beside it [N/m], which planets on pins need
        """
        row = _roller_row(Z, D_w, D_pw, L_we, laminae, 0.0, 1, SHORT_DROP, clearance)
        return cls._of("needle", row, C, damping_time, drag, guidance)

    @classmethod
    @checked
    def tapered_roller(
        cls,
        *,
        Z: int,
        D_w: float,
        D_pw: float,
        L_we: float,
        alpha: float,
        direction: int = 1,
        laminae: int = LAMINAE,
        C: float | None = None,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "RollingBearing":
        """A tapered roller bearing of steel, whose rollers just touch both rings in the centred position.

        D_w, D_pw   mean diameter of the rollers, and of the circle of their centres [m]
        alpha       contact angle, half the angle of the cup [rad]
        direction   1: it carries axial forces on the shaft along z, -1: against z

        The rest as in `cylindrical_roller`; `paired` makes pairs of it. The small force at the rib is left out.
        """
        _check_angle(alpha, direction)
        row = _roller_row(Z, D_w, D_pw, L_we, laminae, alpha, direction, TAPERED_DROP, 0.0)
        return cls._of("tapered roller", row, C, damping_time, drag)

    @classmethod
    @checked
    def from_catalogue(
        cls,
        kind: str,
        *,
        d: float,
        D: float,
        B: float,
        C: float,
        C_0: float,
        alpha: float = 0.0,
        direction: int = 1,
        clearance: float = 0.0,
        damping_time: float = 0.0,
        drag: AnyDrag | None = None,
    ) -> "RollingBearing":
        """A bearing whose inner geometry is estimated from what catalogues tell; `estimate` tells how well.

        kind        "deep groove", "angular contact", "cylindrical roller" or "tapered roller"
        d, D, B     bore, outer diameter, width [m]
        C, C_0      dynamic and static radial capacity [N]
        alpha       contact angle [rad], of angular contact and tapered roller bearings
        direction   of these, as in `angular_contact`
        clearance   diametral one in operation of the others [m]

        The elements are those that fit the capacities of ISO 281 and ISO 76 and what bearings of a type have in common.
        Needle bearings vary too much: give their geometry. Raises ValueError for other kinds and for sizes that no
        bearing has; warns where no bearing of the kind and size has both capacities.
        """
        kinds = ", ".join(map(repr, HABITS))
        require(kind in HABITS, f"kind must be one of {kinds}, got {kind!r}")
        require(0 < d < D < 3, f"d and D must be 0 < d < D < 3 m, got d = {d:g}, D = {D:g}; pass metres: 25*mm")
        require(0 < B < D, f"B must lie in (0, D), got {B:g} m beside D = {D:g} m; pass metres: 17*mm")
        for name, capacity in (("C", C), ("C_0", C_0)):
            size = f"{name} must lie in (0.5, 500) N/mm^2 of D B, got {capacity:g} N; pass newtons: 23.4 kN are 23.4e3"
            require(0.5 < capacity / (D * B / mm**2) < 500, size)
        _check_clearance(clearance)
        angular = kind in ("angular contact", "tapered roller")
        require(angular == (alpha != 0), f"alpha must be given for bearings with a contact angle only, got {alpha:g}")
        if angular:
            _check_angle(alpha, direction)
        sizes = Sizes(d, D, B, C, C_0, alpha)
        row, text = _estimate(kind, sizes, direction, clearance)
        if max(map(abs, capacity_errors(row, sizes))) > LARGEST_CAPACITY_ERROR:
            warn_user(f"no {kind} bearing of this size has C = {C:g} N and C_0 = {C_0:g} N: {text}; check these")
        return cls(kind, (row,), C=C, damping_time=damping_time, drag=drag, estimate=text)

    @classmethod
    def _of(cls, kind: str, row: Row, C, damping_time: float, drag, guidance: float = 0.0) -> "RollingBearing":
        capacity = dynamic_capacity(row) if C is None else C
        return cls(kind, (row,), C=capacity, damping_time=damping_time, drag=drag, guidance=guidance)

    @checked
    def rolling(self, angle: float = 0.0) -> "RollingBearing":
        """The bearing whose cage rolls with the shaft in runs, so that its stiffness varies as elements pass the load.

        angle   of the first element from x while the shaft has not turned [rad]

        Elements roll without sliding on a ring that stands: the cage turns by (1 - D_w cos(alpha) / D_pw) / 2 of the
        inner ring. The outer ring is passed at Z times that speed (`orders`). Statics and modes take the cage as it
        stands at the start.
        """
        require_finite("angle", angle, "pass rad")
        return replace(self, rows=tuple(replace(row, cage_angle=float(angle)) for row in self.rows))

    @checked
    def on_pin(self) -> "RollingBearing":
        """The bearing as a planet or an idler has it on its pin: the outer ring turns with the shaft, the inner one is
        the pin. Displacements are those of the planet, and `direction` remains that of the axial force on the pin.
        """
        return replace(self, rows=tuple(replace(row, on_pin=True) for row in self.rows))

    @property
    def cage_rolls(self) -> bool:
        """Whether the stiffness in runs varies with the turn of the shaft."""
        return any(row.cage_ratio for row in self.rows)

    @property
    def orders(self) -> dict[str, float]:
        """Frequencies of the first row over that of the shaft: the outer ring stands, on a pin the inner one.

        "cage" of the cage (FTF), "outer" and "inner" at which elements pass a point of that ring (BPFO, BPFI),
        "element" of the turns of an element about itself (BSF), in which a point of it touches each ring once.
        """
        row = self.rows[0]
        slow = (1 - row.gamma) / 2
        spin = row.D_pw / (2 * row.D_w) * (1 - row.gamma**2)
        passing = {"outer": row.Z * slow, "inner": row.Z * (1 - slow)}
        return {"cage": 1 - slow if row.on_pin else slow, **passing, "element": spin}

    @checked
    def paired(self, arrangement: str, *, spacing: float, preload: float = 0.0) -> "RollingBearing":
        """A pair of this bearing, centred between its rows.

        arrangement   "O" (back to back), "X" (face to face) or "tandem", which carries in the direction of this bearing
        spacing       axial distance of the rows' centres [m]
        preload       axial force [N] by which the rows press each other while the pair carries nothing

        Raises ValueError for other arrangements, bearings that are pairs already, and a preload of rows that do not
        press each other.
        """
        arrangements = ", ".join(map(repr, ARRANGEMENTS))
        require(arrangement in ARRANGEMENTS, f"arrangement must be one of {arrangements}, got {arrangement!r}")
        require(len(self.rows) == 1, f"paired needs a bearing of one row, got {len(self.rows)} rows")
        require(0 < spacing < 1, f"spacing must lie in (0, 1) m, got {spacing:g}; pass metres: 20*mm")
        require(0 <= preload < inf, f"preload must be >= 0 N and finite, got {preload}")
        row, directions = self.rows[0], ARRANGEMENTS[arrangement]
        require(row.alpha > 0, f"rows of a pair need a contact angle, which a {self.kind} bearing has not")
        pressing = directions[0] != directions[1] or preload == 0
        require(pressing, f"rows in tandem do not press each other, got preload = {preload:g} N")
        if directions[0] == directions[1]:
            directions = (row.direction, row.direction)
        approach = 0.0
        if preload:
            alone = replace(self, rows=(replace(row, direction=1),))
            approach = float(alone.under((0.0, 0.0, preload, 0.0, 0.0)).displacement[2])
        ends = zip((-spacing / 2, spacing / 2), directions, strict=True)
        rows = (replace(row.preloaded(approach), axial=axial, direction=side) for axial, side in ends)
        return replace(self, kind=f"{self.kind}, {arrangement}", rows=tuple(rows))

    @property
    def reach(self) -> float:
        """Largest radial displacement [m] for which the force is known."""
        return inf

    @cached_property
    def law(self) -> LawRecord:
        """The compiled energy law, laminae of rollers one by one, about the centre of the bearing."""
        return law_record(self.rows, self.guidance)

    @cached_property
    def law_of_runs(self) -> LawRecord:
        """The law with tables of rollers instead of laminae, for many calls."""
        return law_record(self.rows, self.guidance, tables=True)

    @checked
    def record_of_runs(self, lever: Finite) -> LawRecord:
        """The law of runs with its damping, for compiled kernels; lever: its distance above the pole [m]."""
        return law_record(self.rows, self.guidance, lever, self.damping_time, tables=True)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(6, 6) stiffness over x, y, z and about x, y, z at the static capacity: larger than in operation.

        Its parts are those at the radial and at the axial displacement at which the most heavily pressed contact
        reaches the pressure of the static capacity (ISO 76). Without coupling of radial motion and tilt. Of a bearing
        that counts as linear the tangent stiffness of the centred position.
        """
        if self.linear:
            return np.pad(self.displaced([0.0] * COORDINATES).stiffness, (0, 1))
        k = np.zeros((6, 6))
        approach = min(row.static_approach for row in self.rows)
        clearance = max(_radial_play(row) for row in self.rows)
        pushed = np.zeros((3, COORDINATES))
        pushed[0, 0] = clearance + approach
        pushed[1:, 2] = np.array([1.0, -1.0]) * max(_axial_travel(row, approach) for row in self.rows)
        size = np.diagonal(response(self.law, 0.0, pushed).hessian, axis1=1, axis2=2).max(axis=0)
        size[:2], size[3:] = size[:2].max(), size[3:].max()
        k[range(COORDINATES), range(COORDINATES)] = size
        k[2, 2] = max(k[2, 2], self.guidance)
        return k

    @checked
    def at(self, lever: Finite) -> np.ndarray:
        """(6, 6) `stiffness` about a pole on the shaft's axis; lever: axial distance of the bearing from it [m]."""
        return about_pole(self.stiffness, lever)

    @checked
    def displaced(self, displacement: Sequence[float]) -> "LoadedBearing":
        """The bearing at a displacement (5,) of its shaft: x, y, z [m], about x and y [rad]."""
        return LoadedBearing(self, _five("displacement", displacement, "[m, rad]"))

    @checked
    def under(self, force: Sequence[float]) -> "LoadedBearing":
        """The bearing in equilibrium under forces (5,) on its shaft: along x, y, z [N], about x and y [N m].

        The minimum of a convex potential: there is one wherever the load is carried. Raises ValueError where it is not,
        say for an axial force away from the contact angle.
        """
        forces = _five("force", force, "[N, N m]")
        try:
            q = equilibrium(self._potential, forces, self.rows[0].R)
        except NotCarried as error:
            raise ValueError(f"force {forces.tolist()} is not carried by a {self.kind} bearing: {error}") from None
        require(
            not comes_apart(self, q),
            f"force {forces.tolist()} pulls the rings of an {self.kind} bearing apart; press them",
        )
        return LoadedBearing(self, q)

    @checked
    def life(self, displacements: Numbers, revolutions: Numbers = 1.0) -> float:
        """L_10r [revolutions] of a duty cycle or of a run (ISO/TS 16281), damage summed position by position.

        displacements   (n, 5) of the shaft: x, y, z [m], about x and y [rad]; of a load by `under(load).displacement`
        revolutions     (n,) number or share of the revolutions in each

        Balls and rollers share the load as in statics. inf where nothing is loaded.
        """
        q = np.atleast_2d(np.asarray(displacements, float))
        require(q.shape[1:] == (COORDINATES,), f"displacements must be (n, 5) [m, rad], got {q.shape}")
        require_finite("displacements", q)
        weights = np.broadcast_to(np.asarray(revolutions, float), len(q)) if np.ndim(revolutions) == 0 else revolutions
        weights = np.asarray(weights, float)
        matching = weights.shape == (len(q),) and bool((weights >= 0).all()) and bool(weights.sum() > 0)
        require(matching, f"revolutions must be (n,) >= 0 with n = {len(q)}, got {np.shape(revolutions)}")
        return reference_life(self.rows, self.C, q, weights / weights.sum())

    def _potential(self, q: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        energy, gradient, hessian = response(self.law, 0.0, q[None])
        return float(energy[0]), gradient[0], hessian[0]


@dataclass(frozen=True, eq=False)
class LoadedBearing:
    """A rolling bearing at a displacement of its shaft.

    displacement   (5,) x, y, z [m], about x and y [rad], from the centred position
    """

    bearing: RollingBearing
    displacement: np.ndarray

    @cached_property
    def _response(self) -> Response:
        return response(self.bearing.law, 0.0, self.displacement[None])

    @property
    def force(self) -> np.ndarray:
        """(5,) forces [N] and moments [N m] on the shaft that the bearing balances."""
        return self._response.gradient[0]

    @property
    def stiffness(self) -> np.ndarray:
        """(5, 5) tangent stiffness [N/m, N/rad, N m/rad], symmetric."""
        return self._response.hessian[0]

    @property
    def linear(self) -> Bearing:
        """The linear `Bearing` with this tangent stiffness, for runs in which the load hardly changes it."""
        bearing = self.bearing
        return Bearing(
            matrix=np.pad(self.stiffness, (0, 1)).tolist(), damping_time=bearing.damping_time, drag=bearing.drag
        )

    @property
    def loads(self) -> list[np.ndarray]:
        """(Z,) forces of the elements of each row [N], the first on the x axis."""
        return [row.loads(self.displacement[None])[0] for row in self.bearing.rows]

    @property
    def pressures(self) -> list[np.ndarray]:
        """(2, Z) largest pressure [Pa] of the elements of each row, at inner and outer raceway."""
        return [np.array(pressures(row, self.displacement[None]))[:, 0] for row in self.bearing.rows]

    @property
    def life(self) -> float:
        """L_10r [revolutions] (ISO/TS 16281): reached by 90 % of such bearings under this load, lubricated well."""
        return self.bearing.life(self.displacement)


@cache
def _estimate(kind: str, sizes: Sizes, direction: int, clearance: float) -> tuple[Row, str]:
    """The row estimated for a bearing of a catalogue, and how well it fits; kept, as a gearbox has many of a size."""
    diameter = pitch_diameter(sizes)

    def row_of(Z: int, D_w: float, length: float) -> Row:
        row: dict[str, Any] = {"Z": Z, "D_w": D_w, "D_pw": diameter}
        if kind == "deep groove":
            return RollingBearing.deep_groove(**row, clearance=clearance).rows[0]
        if kind == "angular contact":
            return RollingBearing.angular_contact(**row, alpha=sizes.alpha, direction=direction).rows[0]
        length = max(length, 0.1 * D_w)
        if kind == "cylindrical roller":
            return RollingBearing.cylindrical_roller(**row, L_we=length, clearance=clearance).rows[0]
        return _roller_row(Z, D_w, diameter, length, LAMINAE, sizes.alpha, direction, TAPERED_DROP, 0.0)

    row, alternatives = estimated_row(kind, sizes, row_of)
    return row, described(row, alternatives, sizes)


def comes_apart(bearing: RollingBearing, q: np.ndarray) -> bool:
    """Whether a displacement q (5,) [m, rad] pulls the rings of an angular contact bearing apart."""
    return bool(parted(bearing, q[None, :COORDINATES])[0])


def parted(bearing: RollingBearing, q: np.ndarray) -> np.ndarray:
    """(n,) whether displacements q (n, 5) [m, rad] pull the rings of an angular contact bearing apart."""
    return np.any([row.comes_apart(q) for row in bearing.rows], axis=0)


def pressures(row: Row, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest pressures (n, Z) [Pa] at inner and outer raceway of a row at displacements q (n, 5) [m, rad]."""
    if isinstance(row, BallRow):
        loads = row.loads(q)
        return row.inner.pressure(loads), row.outer.pressure(loads)
    assert isinstance(row, RollerRow)
    heaviest = row.lamina_loads(q).max(axis=-1) * row.laminae / row.L_we
    return row.inner.pressure(heaviest), row.outer.pressure(heaviest)


def _five(name: str, values: Sequence[float], unit: str) -> np.ndarray:
    array = np.asarray(values, float)
    require(array.shape == (COORDINATES,), f"{name} must be (5,) over x, y, z and about x, y {unit}, got {array.shape}")
    require_finite(name, array)
    return array


def _described(row: Row) -> str:
    """Geometry of a row in words, in the units of drawings."""
    parts = [f"Z={row.Z}", f"D_w={row.D_w / mm:.6g} mm", f"D_pw={row.D_pw / mm:.6g} mm"]
    parts += [f"alpha={row.alpha / deg:.6g} deg", f"direction={row.direction}"] * (row.alpha > 0)
    if isinstance(row, BallRow):
        parts += [f"r_i={row.r_i / mm:.6g} mm", f"r_e={row.r_e / mm:.6g} mm", f"X_0={row.X_0 / um:.6g} um"]
        parts += [f"R_0={row.R_0 / um:.6g} um"]
    elif isinstance(row, RollerRow):
        parts += [f"L_we={row.L_we / mm:.6g} mm", f"gap={row.gap / um:.6g} um", f"laminae={row.laminae}"]
    parts += [f"axial={row.axial / mm:.6g} mm"] * (row.axial != 0)
    parts += ["on a pin"] * row.on_pin
    parts += [f"cage rolls from {row.cage_angle / deg:.6g} deg"] if row.cage_angle is not None else []
    return f"row({', '.join(parts)})"


def _radial_play(row: Row) -> float:
    """Radial displacement [m] until a row touches."""
    if isinstance(row, BallRow):
        return max(row.A - float(np.hypot(*row.origin)), 0.0)
    assert isinstance(row, RollerRow)
    return max(row.gap, 0.0) / cos(row.alpha)


def _axial_travel(row: Row, approach: float) -> float:
    """Axial displacement [m] at which all elements of a row have an approach [m]; 0 where none has."""
    if isinstance(row, BallRow):
        return float(np.sqrt((row.A + approach) ** 2 - row.R_0**2)) - row.X_0
    assert isinstance(row, RollerRow)
    return (approach + row.gap) / sin(row.alpha) if row.alpha > 0 else 0.0


def _roller_row(
    Z: int, D_w: float, D_pw: float, L_we: float, laminae: int, alpha: float, side: int, drop: float, clearance: float
) -> RollerRow:
    _check_elements(Z, D_w, D_pw, 210e9, 0.3)
    _check_clearance(clearance)
    long = f"L_we must lie in (0, 30) D_w, got {L_we:g} m beside D_w = {D_w:g} m; pass metres: 12*mm"
    require(0 < L_we < 30 * D_w, long)
    require(2 <= laminae <= 500, f"laminae must lie in [2, 500], got {laminae}; 30 are usual")
    gap = clearance / 2
    return RollerRow(Z, D_w, D_pw, alpha, direction=side, L_we=L_we, gap=gap, drop=drop, laminae=laminae)


def _grooves(D_w: float, r_i: float | None, r_e: float | None) -> tuple[float, float]:
    """Radii of the grooves [m], by default those of ISO 281."""
    radii = (0.52 * D_w if r_i is None else r_i), (0.53 * D_w if r_e is None else r_e)
    for name, radius in zip(("r_i", "r_e"), radii, strict=True):
        ratio = f"{name} must lie in (0.5, 0.7) D_w, a groove around the ball, got {radius / D_w:.4g} D_w; pass metres"
        require(0.5 < radius / D_w < 0.7, ratio)
    return radii


def _check_elements(Z: int, D_w: float, D_pw: float, E: float, nu: float) -> None:
    (fewest, most), (least, largest) = ELEMENTS, DIAMETERS
    require(fewest <= Z <= most, f"Z must lie in [{fewest}, {most}], got {Z}")
    for name, value in (("D_w", D_w), ("D_pw", D_pw)):
        size = f"{name} must lie in ({least:g}, {largest:g}) m, got {value:g}; pass metres: 12*mm"
        require(least < value < largest, size)
    require(D_w < 0.6 * D_pw, f"D_w must be below 0.6 D_pw, got {D_w / mm:g} and D_pw = {D_pw / mm:g} mm")
    fits = D_pw * sin(pi / Z)
    crowd = f"Z = {Z} elements of D_w = {D_w / mm:g} mm overlap on D_pw = {D_pw / mm:g} mm"
    require(fits > 0.999 * D_w, f"{crowd}: at most {int(pi / np.arcsin(D_w / D_pw))} fit; take fewer or smaller ones")
    require(1e9 < E < 1e12, f"E must lie in (1e9, 1e12) Pa, got {E:g}; 210 GPa are 210e9")
    require(0 <= nu < 0.5, f"nu must lie in [0, 0.5), got {nu}")


def _check_clearance(clearance: float) -> None:
    micrometres = f"clearance must lie within {LARGEST_CLEARANCE / um:g} um, got {clearance:g} m; pass metres: 10*um"
    require(abs(clearance) < LARGEST_CLEARANCE, micrometres)


def _check_angle(alpha: float, direction: int) -> None:
    radians = f"alpha must lie in (0, {LARGEST_ANGLE / deg:g}) deg (pass radians), got {alpha:g} rad"
    require(0 < alpha < LARGEST_ANGLE, radians)
    require(direction in (1, -1), f"direction must be 1 (along z) or -1, got {direction}")
