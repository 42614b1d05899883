"""The mesh force F(phase, deflection, rate, offsets) from an STE map or a user's table.

`force_kernels` has its kernels: 512 x 64 patches invert a map within 1e-4 of the force, from 3e-6 of the largest on
(tests/exugear/mesh_force/test_force.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from math import inf, isfinite

import numpy as np
import xarray as xr

from exugear.mesh_force.force_kernels import (
    AXES,
    BACK_PHASE,
    BACKLASH,
    HEADER,
    OFFSETS,
    PHASE_STEPS,
    damping,
    hermite,
    spinning_force,
    static_force,
    weights_along,
)
from exugear.mesh_force.force_table import PHASES, PHASES_WITH_OFFSETS, U, tabulate
from exugear.mesh_force.jumps import jumps
from exugear.mesh_force.map_range import beyond_map
from exugear.mesh_force.ste_interpolation import loaded_centroid, loaded_deflection, te_under
from fem.ste.ste_map import TORQUE, check, offset_axes, pair_of
from fem.support.arguments import Finite, checked
from fem.support.numba_cache import kept
from fem.support.representation import short
from fem.support.validation import increases, increasing, numbers, require


@cache
def mesh_forces(moves: bool):
    """The function (law, phase, deflection, rate, *offsets) -> force [N] of both flanks of equally long arrays.

    Force > 0 on the driving flank, < 0 on the other. A law whose bodies do not move needs no offsets.
    """

    @kept
    def forces(law, phase, deflection, rate, a, misalignment, axial):
        force = np.empty(phase.size)
        for i in range(phase.size):
            drives = deflection[i] >= -0.5 * law[BACKLASH]
            at = phase[i] if drives else law[BACK_PHASE] - phase[i]
            y = deflection[i] if drives else -(deflection[i] + law[BACKLASH])
            if moves:
                penetration, static, _, _ = static_force(law, at, y, a[i], misalignment[i], axial[i])
            else:
                penetration, static, _ = spinning_force(law, at, y)
            force[i] = (static if drives else -static) + damping(law, penetration) * rate[i]
        return force

    return forces


@checked
@short(deflection="um", force_table="N", damping="N s/m", backlash="um", centroid="mm", mapped_force="N")
@dataclass(frozen=True, eq=False)
class MeshForce:
    """Force law of one gear mesh; the table holds the driving flank, the other is its mirror image.

    phase        (n_phase,) share of a pitch, increasing in [0, 1); the law is periodic in it
    deflection   broadcastable to the force table: along the line of action [m], increasing
    force_table  (*n_offset, n_phase, n_defl) mesh force [N], 0 in the first column, increasing from contact on
    damping      viscous damping along the line of action [N s/m]; ramps in over the first 1 um of penetration, so that
                 the force is continuous, and is not clipped: a fast separation may pull for that micrometre
    backlash     play along the line of action [m]; inf: the other flank is never met
    back_phase   phase + phase of the mirrored contact on the other flank (`fem.GearPair.back_phase`)
    centroid     like force_table: axial place of the force [m], from the pinion's mid-plane
    offsets      axes of the table before phase, in the order a [m], misalignment [rad], axial [m] (`fem.Offsets`)
    mapped_force [N] from which on the table is no longer measured, but continued
    conserves    whether force and torques follow from one potential U(phase, deflection); needs a table without offsets

    Uniform phases i / n are kept, others are resampled. Raises ValueError for what is no such law.
    """

    phase: np.ndarray
    deflection: np.ndarray
    force_table: np.ndarray
    damping: float = field(default=0.0, kw_only=True)
    backlash: float = field(default=inf, kw_only=True)
    back_phase: float = field(default=0.0, kw_only=True)
    centroid: np.ndarray | float = field(default=0.0, kw_only=True)
    offsets: Mapping[str, np.ndarray] = field(default_factory=dict, kw_only=True)
    conserves: bool = field(default=False, kw_only=True)
    mapped_force: float = field(default=inf, kw_only=True)
    law: np.ndarray = field(init=False, repr=False)
    stiffness_max: float = field(init=False)

    def __post_init__(self):
        for name in ("phase", "deflection", "force_table", "centroid"):
            object.__setattr__(self, name, _frozen(np.array(getattr(self, name), float)))
        object.__setattr__(self, "offsets", {name: _frozen(np.array(x, float)) for name, x in self.offsets.items()})
        require(self.mapped_force > 0, f"mapped_force must be > 0 N (inf: all is measured), got {self.mapped_force}")
        _check_scalars(self.damping, self.backlash, self.back_phase)
        _check_offsets(self.offsets, self.conserves)
        _check_table(self.phase, self.deflection, self.force_table, [x.size for x in self.offsets.values()])
        _check_centroid(np.asarray(self.centroid), self.force_table)
        law, stiffness_max = tabulate(self)
        object.__setattr__(self, "law", _frozen(law))
        object.__setattr__(self, "stiffness_max", stiffness_max)

    @classmethod
    @checked
    def from_ste(
        cls,
        ste: xr.Dataset,
        *,
        damping: float = 0.0,
        backlash: float | None = None,
        conserves: bool = False,
        extend: float = 1.0,
    ) -> "MeshForce":
        """The law whose static deflection is the map; backlash is the pair's unless given.

        ste   Dataset of `fem.ste_map`: te [m] over torque from 0 [N m], offsets and phase, smooth and periodic in
              phase; its centroid, where it has one, is where the force acts.
        extend   continue the law with its last stiffness to so many times the largest torque: for impacts, which the
                 data of a run then measure (beyond_map_time, beyond_map_force)
        The map is of the driving, left flanks; the law takes the right ones for their mirror image, also where
        `fem.Sides` differ, which says how to map them.
        Below the lowest torque the compliance grows with -ln F, as that of a Hertzian line contact does.

        Raises ValueError for a map that does not start at torque 0, whose te does not grow with the torque, or whose
        one pitch does not stand for all (`fem.PitchDeviation`).
        """
        pair = pair_of(check(ste))
        offsets = offset_axes(ste)
        n = PHASES_WITH_OFFSETS if offsets else PHASES
        phase = np.arange(n) / n
        force, deflection = loaded_deflection(ste, pair.pinion.r_b, phase, extend=extend)
        backlash = pair.backlash if backlash is None else backlash
        mapped = float(ste[TORQUE][-1]) / pair.pinion.r_b if extend > 1 else inf
        play = {"damping": damping, "backlash": backlash, "back_phase": pair.back_phase, "mapped_force": mapped}
        centroid = loaded_centroid(ste, pair.pinion.r_b, phase, force)
        table = np.broadcast_to(force, deflection.shape)
        return cls(phase, deflection, table, **play, centroid=centroid, offsets=offsets, conserves=conserves)

    @classmethod
    @checked
    def secant(
        cls, ste: xr.Dataset, torque: float, *, damping: float = 0.0, backlash: float | None = None
    ) -> "MeshForce":
        """The law F = k(phase) deflection with the secant stiffness k = F / te at one torque [N m] of the map.

        Source: Palermo et al. 2013, Shweiki et al. (ISMA 2016); F and k along the line of action. Where the map ends,
        at its largest te, the law ends. Raises ValueError for a torque outside the map.
        """
        pair = pair_of(check(ste))
        phase = np.arange(PHASES) / PHASES
        k = torque / pair.pinion.r_b / te_under(ste, torque, phase)
        reach = np.array([0.0, float(ste["te"].max())])
        backlash = pair.backlash if backlash is None else backlash
        table = np.outer(k, reach)
        return cls(phase, reach, table, damping=damping, backlash=backlash, back_phase=pair.back_phase)

    @cached_property
    def jumps(self) -> np.ndarray:
        """(n,) phases at which the force jumps: by 45 % of its range or more within 1/256 of a pitch."""
        return jumps(self)

    def __call__(self, phase, deflection, rate=0.0, **offsets) -> np.ndarray:
        """Mesh force [N] at phase [1], deflection [m], rate [m/s] and the table's offsets by name, broadcast.

        Raises ValueError beyond the table.
        """
        unknown = set(offsets) ^ set(self.offsets)
        require(not unknown, f"offsets must be {list(self.offsets)}, got {list(offsets)}; give each a value")
        arguments = {"phase": phase, "deflection": deflection, "rate": rate} | dict.fromkeys(OFFSETS, 0.0) | offsets
        values = np.broadcast_arrays(*(numbers(name, x) for name, x in arguments.items()))
        for name, value in zip(arguments, values, strict=True):
            require(bool(np.isfinite(value).all()), f"{name} must be finite, got {value}")
        try:
            flat = (np.ascontiguousarray(x).ravel() for x in values)
            return mesh_forces(bool(self.offsets))(self.law, *flat).reshape(values[0].shape)
        except ValueError as error:
            raise ValueError(beyond_map(self.law, error.args)) from None

    @checked
    def at(self, **offsets: float) -> "MeshForce":
        """The law at one value of some of its offsets, which are axes no longer; ValueError beyond them."""
        unknown = set(offsets) - set(self.offsets)
        require(not unknown, f"offsets may be {list(self.offsets)}, got {list(offsets)}")
        if not offsets:
            return self
        values = self._places()
        for i, name in enumerate(OFFSETS):
            if name in offsets:
                values = np.moveaxis(np.moveaxis(values, i, -1) @ self._weights(i, offsets[name])[:, None], -1, i)
        left = {name: values for name, values in self.offsets.items() if name not in offsets}
        values = values.reshape(*(axis.size for axis in left.values()), *values.shape[-2:])
        unloaded, largest, stiffness, centroid = np.split(values, [1, 2, 2 + U.size], axis=-1)
        penetration, phase = largest * U**4, np.arange(values.shape[-2]) / values.shape[-2]
        deflection, force = unloaded + penetration, np.exp(stiffness) * penetration
        middle = centroid if centroid.any() else 0.0
        return replace(self, phase=phase, deflection=deflection, force_table=force, centroid=middle, offsets=left)

    def _places(self) -> np.ndarray:
        """(*places, n_phase, 2 + 2 U.size) unloaded deflection, largest penetration, ln k and centroid over u."""
        n, places = int(self.law[PHASE_STEPS]), [self.offsets.get(name, np.zeros(1)).size for name in OFFSETS]
        blocks = self.law[HEADER : int(self.law[AXES])].reshape(*places, -1)
        edge, patches, centroid = np.split(blocks, [4 * n, blocks.shape[-1] - n * U.size], axis=-1)
        stiffness = np.log(patches.reshape(*places, n, U.size, 4)[..., 0])
        return np.concatenate([edge.reshape(*places, n, 4)[..., ::2], stiffness, centroid.reshape(stiffness.shape)], -1)

    def _weights(self, axis: int, value: float) -> np.ndarray:
        """Weights of the places of an offset."""
        require(isfinite(value), f"{OFFSETS[axis]} must be finite, got {value}")
        try:
            return weights_along(self.law, axis, float(value))
        except ValueError as error:
            raise ValueError(beyond_map(self.law, error.args)) from None

    @checked
    def deflection_at(self, phase: Finite, force: float, **offsets: float) -> float:
        """Static deflection [m] on the driving flank under force >= 0 [N] (bisection); ValueError beyond the table."""
        if self.offsets or offsets:
            return self.at(**offsets).deflection_at(phase, force)
        low, top = self.unloaded(phase)
        largest = float(self(phase, top))
        remedy = f"must lie in [0, {largest:.4g}] N, the map's range at phase {phase:.4g}, got {force:.4g}"
        require(0 <= force <= largest * (1 + 1e-9), f"force {remedy}; extend the map to a larger torque")
        for _ in range(80):
            middle = (low + top) / 2
            low, top = (middle, top) if float(self(phase, middle)) < force else (low, middle)
        return top

    @checked
    def unloaded(self, phase: Finite) -> tuple[float, float]:
        """Deflections at loss of contact and at the end of the map [m], of a law without offsets."""
        n = int(self.law[PHASE_STEPS])
        x = (phase % 1.0) * n
        i = min(int(x), n - 1)
        edge = self.law[HEADER : HEADER + 4 * n].reshape(n, 4)
        (y0, m0, s0, d0), (y1, m1, s1, d1) = edge[i], edge[(i + 1) % n]
        start = hermite(x - i, y0, m0, y1, m1)
        return start, start + hermite(x - i, s0, d0, s1, d1)


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def _check_scalars(damping: float, backlash: float, back_phase: float) -> None:
    require(0 <= damping < inf, f"damping must be >= 0 N s/m and finite, got {damping}")
    play = f"backlash must be >= 0 m (inf: no other flank), got {backlash}; it is meant on the line of action"
    require(backlash >= 0, play)
    unit = f"backlash must be below 0.01 m, or inf, got {backlash}; pass metres: 0.2*mm"
    require(backlash < 1e-2 or backlash == inf, unit)
    require(isfinite(back_phase), f"back_phase must be finite, a share of a pitch, got {back_phase}")


def _check_offsets(offsets: Mapping[str, np.ndarray], conserves: bool) -> None:
    named = list(offsets) == [name for name in OFFSETS if name in offsets]
    require(named, f"offsets must be of {list(OFFSETS)} in this order, got {list(offsets)}")
    for name, values in offsets.items():
        increasing(f"{name} of the offsets", values, least=2)
        require(bool(np.isfinite(values).all()), f"{name} must be finite, got {values}")
    require(not (conserves and offsets), f"a conserving law takes no offsets, got {list(offsets)}; use MeshForce.at")


def _check_centroid(centroid: np.ndarray, force: np.ndarray) -> None:
    fits = centroid.ndim == 0 or centroid.shape == force.shape
    require(fits, f"centroid must be a number or like force_table {force.shape}, got {centroid.shape}")
    near = bool(np.isfinite(centroid).all()) and bool(np.abs(centroid).max() < 1)
    require(near, f"centroid must be finite and within 1 m, got {np.abs(centroid).max():g}; pass metres")


def _check_table(phase: np.ndarray, deflection: np.ndarray, force: np.ndarray, places: list[int]) -> None:
    within = bool(increasing("phase", phase)[0] >= 0 and phase[-1] < 1)
    require(within, f"phase must increase within [0, 1) as share of a pitch, got {phase}")
    shapes = f"got {phase.shape}, {deflection.shape}, {force.shape}"
    columns = deflection.shape[-1] if deflection.ndim else 0
    fits = force.shape == (*places, phase.size, columns) and columns >= 2 and deflection.ndim <= force.ndim
    fits = fits and all(x in (1, y) for x, y in zip(deflection.shape[::-1], force.shape[::-1], strict=False))
    require(fits, f"force_table must be (n_phase, n_defl) over phase (n_phase,) and deflection (n_defl,), {shapes}")
    require(increases(deflection), "deflection must increase along its last axis [m]; sort it and its forces")
    size = np.abs(deflection).max()
    require(size < 1e-2, f"deflection must lie within 0.01 m, got {size:g}; pass metres: 20*um")
    require(bool(np.isfinite(force).all()), "force_table must be finite everywhere")
    none = "force_table must be 0 in the first column; begin deflection where no teeth touch (the driving flank alone)"
    require(bool((force[..., 0] == 0).all()), none)
    loaded = force[..., 1:] > 0
    rises = (np.diff(force) > 0) == loaded
    grow = "force_table must grow with the deflection once the teeth touch; check its sign and its axes"
    require(bool(rises.all() and loaded[..., -1].all()), grow)
