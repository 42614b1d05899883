"""A sensor on a ring gear, which hears the planets pass: by the modes of an elastic ring, or quasi-static.

Where the run holds the modes of the ring the sensor moves with these, also above their frequencies. Else every mesh of
the ring displaces it by its mesh force times an influence that depends on the positions of both.
A planet that passes modulates the mesh frequency: N equal planets give lines at multiples of N turns of the carrier
alone, at the mesh frequency itself, |z| turns, only where that is a multiple of N and the influence has a mean
(breathing). A wave of n lobes around the ring moves a line by n turns; unequal planets fill the rest.

Sources: P. D. McFadden and J. D. Smith, Proc. Inst. Mech. Eng. C 199 (1985) 65; M. Inalpolat and A. Kahraman, J. Sound
Vib. 323 (2009) 677.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import pi
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.gearbox.planetary_phases import half_thickness
from exugear.running.ring_variables import ring_of_run
from exugear.running.run_data import stage_data
from exugear.signals.signal import MESH_ORDER, MOTION_UNITS, TIME
from fem.ste.ste_map import pair_of, periodic_spline
from fem.support.arguments import checked
from fem.support.validation import require, require_finite

RADIAL, TANGENTIAL = "radial", "tangential"
MESH, AT = "mesh", "at"
#: What a sensor measures, with its unit.
QUANTITIES = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
#: Largest gap between the angles of an influence over the circle [rad].
LARGEST_GAP = pi / 4
#: Share of the largest mesh force below which a force on the back flanks is rounding.
ROUNDING = 1e-6
Influence = Callable[[np.ndarray], np.ndarray] | xr.Dataset


def check_influence(name: str, value: Any) -> None:
    """ValueError unless a value is a function or a dataset of `fem.ring_deflection` around the ring."""
    kinds = f"{name} must be a function of the angle, or a dataset of fem.ring_deflection, got {type(value).__name__}"
    require(callable(value) or isinstance(value, xr.Dataset), kinds)
    if not isinstance(value, xr.Dataset):
        return
    missing = [x for x in (RADIAL, TANGENTIAL) if x not in value or set(value[x].dims) != {MESH, AT}]
    require(not missing, f"{name} must have {RADIAL} and {TANGENTIAL} over {MESH} and {AT}, it lacks {missing}")
    for axis in (MESH, AT):
        angles = np.sort(value[axis].values % (2 * pi))
        gap = np.diff(angles, append=angles[0] + 2 * pi).max()
        around = f"{name} must have angles {axis} all around the ring, got a gap of {gap:.3g} rad"
        require(bool(gap <= LARGEST_GAP), f"{around}; {axis}=np.linspace(0, 2 * np.pi, 360, endpoint=False)")


@checked
@dataclass(frozen=True, eq=False)
class RingSensor:
    """A point of a ring gear whose motion is measured, as by an accelerometer on the outside of its rim.

    angle       of the sensor about the axis of the ring from x, counter-clockwise about z [rad], while the ring stands
                in the reference configuration; the sensor turns with the ring
    influence   None for a run whose ring has modes, `Planetary(ring_modes=...)`: the sensor moves with them, by inertia
                too. Else displacement [m/N] by a unit mesh force: the dataset of `fem.ring_deflection`, with `mesh` and
                `at` all around the ring, from which radial and tangential displacements are interpolated; or, of a ring
                that is the same all around, a function (n,) -> (n,) of the angle from the mesh to the sensor,
                counter-clockwise about z [rad]
    direction   "radial", > 0 outwards, or "tangential", > 0 counter-clockwise; a function has its own
    quantity    "displacement", or by the modes of the ring "velocity" or "acceleration"

    Raises ValueError for an influence that does not go around the ring.
    """

    angle: float
    influence: Annotated[Influence | None, check_influence] = None
    direction: str = field(default=RADIAL, kw_only=True)
    quantity: str = field(default="displacement", kw_only=True)

    def __post_init__(self):
        require_finite("angle", self.angle, "pass radians: 30*deg")
        require(abs(self.angle) <= 2 * pi, f"angle must lie within 2 pi, got {self.angle:g}; pass radians: 30*deg")
        kinds = f'direction must be "{RADIAL}" or "{TANGENTIAL}", got {self.direction!r}'
        require(self.direction in (RADIAL, TANGENTIAL), kinds)
        kinds = f"quantity must be one of {list(QUANTITIES)}, got {self.quantity!r}"
        require(self.quantity in QUANTITIES, kinds)
        still = f"quantity must be 'displacement' with an influence, which is quasi-static, got {self.quantity!r}"
        require(self.influence is None or self.quantity == "displacement", f"{still}; give the set ring_modes=")

    @checked
    def signal(self, run, *, ring: str | None = None) -> xr.DataArray:
        """Motion of the sensor over the time of a run, as a signal whose orders count turns of the carrier.

        run    an `exugear.Run` of a gearbox with planets, or its data
        ring   name of the shaft with the ring; by default the first one

        With an influence quasi-static: the ring follows the mesh forces of the run without inertia of its own. By modes
        without what the modes leave out, which is near the planet alone. Returns a DataArray (time) in m, m/s or m/s^2
        with the coordinates time [s], speed [rad/s] and angle [rad] of the carrier against the ring, and mesh_order,
        the teeth of the ring. Raises ValueError for a run without such a ring or without its modes, and, with an
        influence, for one whose mesh forces lie on the back flanks: the influence is that of the driving ones.
        """
        stage_data(run)
        run_data = run if isinstance(run, xr.Dataset) else run.data
        meshes = _meshes_of_ring(run_data, ring)
        first = meshes[0]
        values = self._by_influence(meshes) if self.influence is not None else self._by_modes(run_data, meshes)
        turned = np.mean([mesh.advance for mesh in meshes], axis=0) * 2 * pi / first.teeth
        angle = np.append(0.0, np.cumsum(np.abs(np.diff(turned))))
        time = first.time
        name = f"carrier against {first.ring}"
        about = {key: {"units": unit, "long_name": f"{key} of the {name}"} for key, unit in MOTION_UNITS.items()}
        coordinates = {
            "time": ("time", time, TIME),
            "speed": ("time", np.gradient(turned, time), about["speed"]),
            "angle": ("time", angle, about["angle"]),
            "mesh_order": ((), float(first.teeth), MESH_ORDER),
        }
        what = f"{self.direction} {self.quantity} of the ring at {self.angle:.4g} rad"
        attributes = {"units": QUANTITIES[self.quantity], "long_name": what}
        return xr.DataArray(np.asarray(values), coordinates, ("time",), attrs=attributes)

    def _by_modes(self, data: xr.Dataset, meshes: list["RingMesh"]) -> np.ndarray:
        """(n_time,) motion of the sensor by the modes of the ring."""
        first, ring = meshes[0], ring_of_run(data, meshes[0].ring)
        without = f"run must hold the modes of the ring {first.ring!r}, or the sensor an influence"
        if ring is None:
            raise ValueError(f"{without}; give the set ring_modes=fem.ring_modes(ring_pair)")
        elastic, of_ring = ring
        amplitudes, rates = (of_ring[f"ring_{x}"].transpose("time", ...).values for x in ("amplitude", "rate"))
        at_rim = first.on_ring(np.array(self.angle)) + first.half_tooth
        shape = _around(elastic.modes[AT].values, elastic.modes[self.direction].transpose(AT, ...).values)(at_rim)
        sign = 1.0 if self.direction == RADIAL else -first.sense
        if self.quantity != "acceleration":
            return sign * ((amplitudes if self.quantity == "displacement" else rates) @ shape)
        acting = [(mesh.force, first.on_ring(mesh.position)) for mesh in meshes]
        return sign * (elastic.accelerations(amplitudes, rates, acting) @ shape)

    def _by_influence(self, meshes: list["RingMesh"]) -> np.ndarray:
        """(n_time,) displacement [m] by the mesh forces."""
        first, forces = meshes[0], np.array([mesh.force for mesh in meshes])
        back = f"run loads the back flanks of {first.ring!r}, mesh forces reach {forces.min():.4g} N"
        driving = "the influence holds for the driving flanks; run it with the load the other way, or with planets kept"
        require(bool(forces.min() >= -ROUNDING * np.abs(forces).max()), f"{back}; {driving} in contact")
        influences = self._influence_on(first)
        return np.sum([mesh.force * influences(mesh.position) for mesh in meshes], axis=0)

    def _influence_on(self, first: "RingMesh") -> Callable[[np.ndarray], np.ndarray]:
        """Influence [m/N] of a mesh by its position about z [rad]; first: the mesh by which the teeth are counted."""
        if not isinstance(self.influence, xr.Dataset):
            function: Any = self.influence
            return lambda position: np.asarray(function(self.angle - position), float)
        table = self.influence[self.direction].transpose(AT, MESH)
        at_rim = first.on_ring(np.array(self.angle)) + first.half_tooth
        by_mesh = _around(table[AT].values, table.values)(at_rim)
        over_mesh = _around(table[MESH].values, by_mesh)
        # Angles on the ring count as its teeth do, which run clockwise where the planets drive it counter-clockwise.
        sign = 1.0 if self.direction == RADIAL else -first.sense
        return lambda position: sign * over_mesh(first.on_ring(position))


@dataclass(frozen=True)
class RingMesh:
    """A mesh of a ring along a run.

    ring, teeth   name of its shaft, number of its teeth
    sense         in which the planets drive it, +1 or -1
    start         angle of the mesh about the ring in the reference configuration [rad], and phase there [pitches]
    advance       (n_time,) pitches by which the mesh has moved around the ring since then
    force, time   (n_time,) [N, s]
    inputs        of the pair, as in the attributes of a map
    """

    ring: str
    teeth: int
    sense: float
    start: tuple[float, float]
    advance: np.ndarray
    force: np.ndarray
    time: np.ndarray
    inputs: Mapping[str, Any]

    @property
    def pitch(self) -> float:
        """Angle of a pitch [rad]."""
        return 2 * pi / self.teeth

    @property
    def position(self) -> np.ndarray:
        """(n_time,) angle of the mesh about z, against the ring [rad]."""
        return self.start[0] - self.sense * self.pitch * self.advance

    @property
    def half_tooth(self) -> float:
        """Half a tooth thickness of the ring on the working circle, as an angle [rad]."""
        known = "wheel_flank" in self.inputs
        require(known, "run must be of a fem.GearPair(planet, ring) for a dataset of its ring; pass a function instead")
        pair = pair_of(xr.Dataset(attrs=self.inputs))
        return half_thickness(pair.wheel, pair.alpha_wt) * self.pitch

    def on_ring(self, angle: np.ndarray) -> np.ndarray:
        """Angles of meshes about z as `fem.ring_deflection` counts them, from the teeth of this mesh on [rad]."""
        return -self.sense * (angle - self.start[0]) + self.pitch * self.start[1]


def _meshes_of_ring(data: xr.Dataset, ring: str | None) -> list[RingMesh]:
    """The meshes of a ring with its planets; ValueError where the run has no such ring."""
    labels = [str(label) for label in data["stage"].values]
    members = data["member"].values.tolist() if "member" in data.coords else [""] * len(labels)
    of_rings = {
        label: member
        for label, member in zip(labels, members, strict=True)
        if member and float(data.attrs[f"{label}_wheel_z"]) < 0
    }
    require(bool(of_rings), "run must be of a gearbox in which planets mesh with a ring, this one has none")
    rings = list(dict.fromkeys(of_rings.values()))
    chosen = rings[0] if ring is None else ring
    require(chosen in rings, f"ring must be one of {rings}, got {ring!r}")
    stages = [label for label, member in of_rings.items() if member == chosen]
    carriers = list(dict.fromkeys(data.attrs.get(f"{label}_carrier") for label in stages))
    several = f"ring {chosen!r} meshes with planets of the carriers {carriers}, a sensor counts the turns of one"
    require(len(carriers) == 1, f"{several}; take exugear.force_seen_from_ring(run, ring=...) with a planet's name")
    older = "run is of an older version, without the phases of its meshes in the reference configuration; run it again"
    require(f"{stages[0]}_phase" in data.attrs, older)
    return [_mesh(data, label, chosen) for label in stages]


def _mesh(data: xr.Dataset, label: str, ring: str) -> RingMesh:
    of_stage = data.sel(stage=label)
    inputs = {name.removeprefix(f"{label}_"): x for name, x in data.attrs.items() if name.startswith(f"{label}_")}
    start = float(inputs["angle"]), float(inputs["phase"])
    advance = of_stage["phase"].values - start[1]
    teeth, sense = round(abs(float(inputs["wheel_z"]))), float(inputs["flank_sense"])
    return RingMesh(ring, teeth, sense, start, advance, of_stage["mesh_force"].values, data["time"].values, inputs)


def _around(angles: np.ndarray, values: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Periodic cubic splines over the circle through values (n, ...) at angles (n,) [rad]."""
    order = np.argsort(angles % (2 * pi))
    at = (angles % (2 * pi))[order]
    return periodic_spline(at, values[order], 2 * pi)
