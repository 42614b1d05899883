"""The mesh force F(phase, deflection, rate, offsets) from an STE map or a user's table.

Its table (`exugear.mesh_force.layout`) of 256 x 128 patches inverts a map with a relative error of the force below
1e-4, for forces above 3e-6 of the largest one (tests/exugear/mesh_force/test_force.py).
"""

from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from math import inf, isfinite, lcm, prod
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import scipy
import xarray as xr

from exugear.mesh_force.energy_centroid import energy_centroid
from exugear.mesh_force.fixed_offsets import at_fixed_offsets, blocks_of
from exugear.mesh_force.force_file import load_arguments, save_force
from exugear.mesh_force.force_kernels import damping, range_at, spinning_force, static_force
from exugear.mesh_force.kernel_records import changed
from exugear.mesh_force.layout import OFFSETS, PHASES, steps_in_pitch
from exugear.mesh_force.map_range import beyond_map
from exugear.mesh_force.patches import table_of
from exugear.mesh_force.potential import CONTINUED
from exugear.mesh_force.static_deflection import static_deflections
from exugear.mesh_force.ste_interpolation import loaded_centroid, loaded_deflection, require_rising, te_under
from exugear.mesh_force.tabulation import tabulate, uniform_phases
from exugear.mesh_force.tooth_pairs import ToothPairs, errors_of, tooth_pairs_of
from fem.pair.pair import GearPair
from fem.ste.map_sides import has_right_flanks, left_torques, right_torques, why_unlike
from fem.ste.ste_map import (
    TE,
    TORQUE,
    UNLOADED_RIGHT,
    check,
    deviating_teeth,
    offset_axes,
    pair_of,
    pitches_of,
    ste_map,
)
from fem.support.arguments import FilePath, Finite, Numbers, checked
from fem.support.numba_cache import kept
from fem.support.representation import short
from fem.support.validation import increases, increasing, numbers, require, require_finite, set_fields
from fem.units import um

#: Penetration over which the damping ramps in, unless another is given [m].
DAMPING_RAMP = 1 * um
#: Largest ramp that is no mistake of units [m].
LONGEST_RAMP = 1e-4
#: Tolerance of the deflection under a force [m], below rounding.
FINEST = 1e-20
#: A jump is a change by this share of the force's range over phase, at a fixed deflection, within this part of a pitch.
JUMP_SHARE, JUMP_WIDTH = 0.45, 1 / 256
#: Number of phases at which the force is compared; share of the largest force below which a change is no jump.
FINE, FLAT = 4096, 1e-3
#: Share of the deflection range between the deflection at which jumps are detected and the end of the table.
JUMP_MARGIN = 0.1
#: Laws at fixed offsets by the law that they were made of, the last ones: over 90 pitches such a table takes 0.5 s, and
#: static equilibrium of a set asks for each some ten times.
REDUCED: WeakKeyDictionary[Any, dict[Any, Any]] = WeakKeyDictionary()
MOST_REDUCED = 8


@cache
def mesh_forces(has_offsets: bool):
    """The compiled function (force, table, phase, deflection, rate, *offsets), which writes the force [N].

    All arguments but the table are arrays (n,). The force is that on the flank in contact, > 0 on the driving flank,
    < 0 on the back flank.
    """

    @kept
    def write_forces(force, table, phase, deflection, rate, *offsets):
        for i in range(phase.size):
            drives = deflection[i] >= -0.5 * table.backlash
            at = phase[i] if drives else table.back_phase - phase[i]
            y = deflection[i] if drives else -(deflection[i] + table.backlash)
            of_flank = table_of(table, 1.0 if drives else -1.0)
            if has_offsets:
                static = static_force(of_flank, at, y, offsets[0][i], offsets[1][i], offsets[2][i])
            else:
                static = spinning_force(of_flank, at, y)
            force[i] = (static.force if drives else -static.force) + damping(table, static.penetration) * rate[i]

    return write_forces


@checked
@short(
    deflection="um", force_table="N", damping="N s/m", damping_ramp="um", backlash="um", centroid="mm", mapped_force="N"
)
@dataclass(frozen=True, eq=False)
class MeshForce:
    """Force law of a gear mesh: force over phase and deflection, by default from an STE map (`from_ste`).

    The table holds the driving, left flanks. The coast, right flanks have a law of their own, `coast`, or are their
    mirror image: the driving flanks after half a turn about the line of centres, by which z points the other way.

    phase          (n_phase,) in pitches, increasing in [0, pitches); the law is periodic in it. At phase 0 tooth 0 of
                   the pinion and tooth 0 of the wheel touch at the pitch point in mid-plane
    deflection     along the line of action [m], increasing along the last axis, broadcastable to force_table
    force_table    (*n_offset, n_phase, n_deflection) mesh force [N], 0 in the first column, increasing from contact on
    damping        viscous damping along the line of action [N s/m]; it is not limited: a fast separation may pull
                   within its ramp
    damping_ramp   penetration over which the damping ramps in, so that the force is continuous [m]. An assumption, as
                   no film is computed: where teeth part it moves the jumps (for the pair of the README at 100 N m
                   from 979 to 913 Hz between 0.25 and 4 um)
    pitches        number of pitches after which the law repeats: 1 where all teeth are alike, else that of a gear's
                   teeth, or of all pairs of teeth that meet
    backlash       along the line of action [m]; inf: the back flank never touches
    back_phase     sum of the phases of driving and back flank (`fem.GearPair.back_phase`)
    centroid       axial position of the force centroid [m] from the pinion's mid-plane, a number or like force_table;
                   without it a law over the misalignment derives it from the potential
    offsets        axes of the table before phase, in the order a [m], misalignment [rad], axial [m] (`fem.Offsets`)
    conserves      whether all torques and forces derive from one potential; if not, for comparison, the force acts at
                   its centroid without the torque by the change of the potential over phase and the forces by its
                   change over centre distance and axial offset
    fixed_offsets  values of the offsets at which `at` was evaluated, by name; the axial offset for which a map was made
    mapped_force   largest mesh force of the map [N], above which the table is extrapolated
    coast          `MeshForce` of the coast flanks as driving flanks of the pair after that half turn, over the same
                   offsets, with z the other way; its deflection counts from where they touch without backlash. Damping,
                   backlash and back_phase are those of this law. None: the mirror image
    coast_unlike   why the coast flanks of the pair are not the mirror image that the law takes; "" where they are

    Derived from them:

    table           packed table that the compiled kernels read (`exugear.mesh_force.layout`)
    stiffness_max   largest tangent stiffness [N/m]

    Uniform phases, i / n of the pitches, are kept, others are resampled. Raises ValueError for arrays that do not form
    such a law.
    """

    phase: np.ndarray
    deflection: np.ndarray
    force_table: np.ndarray
    damping: float = field(default=0.0, kw_only=True)
    damping_ramp: float = field(default=DAMPING_RAMP, kw_only=True)
    pitches: int = field(default=1, kw_only=True)
    backlash: float = field(default=inf, kw_only=True)
    back_phase: float = field(default=0.0, kw_only=True)
    centroid: np.ndarray | float = field(default=0.0, kw_only=True)
    offsets: Mapping[str, np.ndarray] = field(default_factory=dict, kw_only=True)
    conserves: bool = field(default=True, kw_only=True)
    fixed_offsets: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    mapped_force: float = field(default=inf, kw_only=True)
    coast: "MeshForce | None" = field(default=None, kw_only=True)
    coast_unlike: str = field(default="", kw_only=True)
    teeth: ToothPairs | None = field(default=None, kw_only=True)
    table: np.record = field(init=False, repr=False)
    stiffness_max: float = field(init=False)

    def __post_init__(self):
        for name in ("phase", "deflection", "force_table", "centroid"):
            set_fields(self, **{name: _frozen(np.array(getattr(self, name), float))})
        set_fields(self, offsets={name: _frozen(np.array(x, float)) for name, x in self.offsets.items()})
        require(self.mapped_force > 0, f"mapped_force must be > 0 N (inf: all is mapped), got {self.mapped_force}")
        _check_scalars(self.damping, self.backlash, self.back_phase)
        micrometre = f"damping_ramp must lie in (0, {LONGEST_RAMP:g}] m, got {self.damping_ramp}; pass metres: 1*um"
        require(0 < self.damping_ramp <= LONGEST_RAMP, micrometre)
        _check_offsets(self.offsets)
        _check_offsets_known(self.fixed_offsets)
        require(self.pitches >= 1, f"pitches must be at least 1, a whole number, got {self.pitches}")
        _check_phase(self.phase, self.pitches)
        _check_table(self.phase, self.deflection, self.force_table, [x.size for x in self.offsets.values()])
        _check_centroid(np.asarray(self.centroid), self.force_table)
        _check_coast(self)
        if "misalignment" in self.offsets and not np.any(self.centroid):
            set_fields(self, centroid=_frozen(self._centroid_by_energy()))
        table = tabulate(self)
        set_fields(self, table=table, stiffness_max=float(table.head.largest_stiffness))

    @classmethod
    @checked
    def from_ste(
        cls,
        ste: xr.Dataset,
        *,
        damping: float = 0.0,
        damping_ramp: float = DAMPING_RAMP,
        backlash: float | None = None,
        conserves: bool = True,
        extend: float = 1.0,
    ) -> "MeshForce":
        """The law whose static deflection is an STE map.

        ste         map of `fem.static_transmission_error`, `fem.ste_map` or, from a table of another program,
                    `fem.ste_from_table`: te [m] over torque from 0 [N m], offsets and phase, smooth and periodic in
                    phase; the force acts at its force centroid where the map has one, else in mid-plane
        damping, damping_ramp
                    as in `MeshForce`
        backlash    along the line of action [m], by default the pair's
        conserves   as in `MeshForce`
        extend      multiple of the largest torque up to which the law is extrapolated with its last stiffness, for
                    impacts; the data of a run then contain for how long and how far it was beyond the map
                    (beyond_map_time, beyond_map_force)

        Torques >= 0 of the map hold the driving, left flanks, torques < 0 the coast, right ones. Without torques < 0
        the law takes the coast flanks as mirror image; coast_unlike says where that is not exact. Below the lowest
        torque the compliance grows with -ln F, like that of a Hertzian line contact.

        A map over several pitches, whose teeth differ (`fem.PitchDeviation`), gives a law over these: its table has
        1.6 MB a pitch, with force centroids 3.2 MB, from 65 pitches on half of that.

        Raises ValueError for a map without torque 0, whose te does not grow with the torque, which ends before the
        teeth that meet are the same again, or which lacks a part of the mesh cycle.
        """
        pair = pair_of(check(ste))
        backlash = pair.backlash if backlash is None else backlash
        given: dict[str, Any] = {"damping": damping, "damping_ramp": damping_ramp, "backlash": backlash}
        given |= {
            "back_phase": pair.back_phase,
            "conserves": conserves,
            "coast_unlike": _unlike(ste),
            "fixed_offsets": fixed_axial_offset(ste),
        }
        driving = _arrays_of(left_torques(ste), pair, extend)
        if has_right_flanks(ste):
            given["coast"] = cls(**_coast_arrays(ste, pair, extend), conserves=conserves)
        return cls(**driving, **given)

    @classmethod
    @checked
    def from_tooth_pairs(
        cls,
        pairs: xr.Dataset,
        *,
        damping: float = 0.0,
        damping_ramp: float = DAMPING_RAMP,
        backlash: float | None = None,
        coast: xr.Dataset | None = None,
    ) -> "MeshForce":
        """The law over all pitches of a hunting period, composed of single tooth pairs.

        pairs       `fem.tooth_pair_map` of the pair with the deviations of all its teeth
        coast       the same of `fem.mirror_image` of the pair; without it the coast flanks are the mirror image of
                    flanks that are alike, which coast_unlike says
        damping, damping_ramp, backlash
                    as in `from_ste`

        Its table has some 2 MB, and 32 bytes for each pitch; its call takes some .2 us. For pitch deviations it
        agrees with the map of all pitches (`from_ste`) within 1 % of what they add; where to take which, and the errors
        of profiles, cracks and spalls by tooth: `exugear/docs/theory.md`.

        Raises ValueError for a dataset that is no map of tooth pairs.
        """
        for name, data in (("pairs", pairs), *([] if coast is None else [("coast", coast)])):
            is_map = data.attrs.get("title") == "tooth pairs"
            made = f"{name} must be made by fem.tooth_pair_map, got {list(map(str, data))}"
            require(is_map, f"{made}; for a map: from_ste")
        pair = pair_of(pairs)
        backlash = pair.backlash if backlash is None else backlash
        given: dict[str, Any] = {"damping": damping, "damping_ramp": damping_ramp, "backlash": backlash}
        given |= {"back_phase": pair.back_phase, "pitches": lcm(*deviating_teeth(pair))}
        given |= {"coast_unlike": "" if coast is not None else why_unlike(pairs), "fixed_offsets": fixed_axial(pairs)}
        if coast is not None:
            given["coast"] = composed_law(tooth_pairs_of(coast, cls), pitches=given["pitches"])
        law = composed_law(tooth_pairs_of(pairs, cls), **given)
        phase, loads = pairs["phase_check"].values, pairs["torque_check"].values / pair.pinion.r_b
        if not phase.size:
            return law
        first = {name: float(values[0]) for name, values in law.offsets.items()}
        te = static_deflections(law.flank_at(1, **first), phase, loads)
        errors = errors_of(te, pairs)
        return replace(law, teeth=replace(law.teeth, **errors))  # type: ignore[type-var]

    @classmethod
    @checked
    def secant(
        cls,
        ste: xr.Dataset,
        torque: float,
        *,
        damping: float = 0.0,
        damping_ramp: float = DAMPING_RAMP,
        backlash: float | None = None,
    ) -> "MeshForce":
        """The law F = k(phase) deflection with the secant stiffness k = F / te at a torque [N m] of the map.

        F and k are along the line of action. The law ends at the largest te of the map. As in the paper it has no
        torque beside that of the force. In a map with torques < 0 the coast flanks have the secant stiffness at minus
        the torque. Raises ValueError for a torque outside the map.

        Source: Palermo et al. 2013, Shweiki et al. (ISMA 2016).
        """
        pair = pair_of(check(ste))
        backlash = pair.backlash if backlash is None else backlash
        given: dict[str, Any] = {"damping": damping, "damping_ramp": damping_ramp, "backlash": backlash}
        pitches = pitches_of(ste)
        phase, r_b = uniform_phases(PHASES * pitches, pitches), pair.pinion.r_b

        def table_of_side(side: xr.Dataset) -> tuple[np.ndarray, ...]:
            reach = np.array([0.0, float(side[TE].max())])
            return phase, reach, np.outer(torque / r_b / te_under(side, torque, phase), reach)

        if has_right_flanks(ste):
            given["coast"] = cls(*table_of_side(right_torques(ste)), pitches=pitches, conserves=False)
        given |= {
            "pitches": pitches,
            "back_phase": pair.back_phase,
            "coast_unlike": _unlike(ste),
            "fixed_offsets": fixed_axial_offset(ste),
        }
        return cls(*table_of_side(left_torques(ste)), **given, conserves=False)

    @checked
    def save(self, path: FilePath) -> Path:
        """Write the law as netCDF; the file is complete or absent, and ends with a digest by which `load` tells damage.

        Raises OSError where the file cannot be written.
        """
        return save_force(self, Path(path))

    @classmethod
    @checked
    def load(cls, path: FilePath) -> "MeshForce":
        """The law that `save` wrote, equal to the last bit; ValueError for a damaged or another file."""
        arguments = load_arguments(path)
        if arguments["coast"] is not None:
            arguments["coast"] = cls(**_with_tooth_pairs(arguments["coast"], cls))
        return cls(**_with_tooth_pairs(arguments, cls))

    def _centroid_by_energy(self) -> np.ndarray:
        """Force centroid (like force_table) [m], by the change of the potential over the misalignment."""
        counts = [self.offsets[name].size if name in self.offsets else 1 for name in OFFSETS]
        shape = self.force_table.shape
        tables = (np.broadcast_to(x, shape).reshape(*counts, *shape[-2:]) for x in (self.deflection, self.force_table))
        return energy_centroid(self.offsets["misalignment"], *tables).reshape(shape)

    @cached_property
    def jumps(self) -> np.ndarray:
        """(n,) phases at which the force of the driving flank jumps, by 45 % of its range within 1/256 of a pitch.

        The force is compared near the largest deflection, with offsets at the middle of their axes. Time steps are
        chosen to meet the jumps (`exugear.planning.sampling`).
        """
        if self.offsets:
            middle = {name: float(values[values.size // 2]) for name, values in self.offsets.items()}
            return self.flank_at(1, **middle).jumps
        if self.teeth is not None:
            alike = replace(self, pitches=1, coast=None, teeth=self.teeth.without_deviations()).jumps_of_law()
            return np.add.outer(np.arange(self.pitches), alike).ravel()
        return self.jumps_of_law()

    def jumps_of_law(self) -> np.ndarray:
        """(n,) phases at which the law jumps; of one that is composed of tooth pairs they are all computed."""
        fine, window = FINE * self.pitches, round(JUMP_WIDTH * FINE)
        phase = np.arange(fine) / FINE
        deflection = np.broadcast_to(self.deflection, self.force_table.shape)
        span = float((deflection[:, -1] - deflection[:, 0]).min())
        values = self(phase, float(deflection[:, -1].min()) - JUMP_MARGIN * span)
        least = max(JUMP_SHARE * np.ptp(values), FLAT * np.abs(values).max())
        steep = np.abs(np.roll(values, -window) - values) > least
        if not steep.any() or steep.all():
            return np.zeros(0)
        begins, ends = (np.flatnonzero(steep & ~np.roll(steep, k)) for k in (1, -1))
        ends = np.where(ends[0] < begins[0], np.roll(ends, -1), ends)
        middles = begins + (ends - begins) % fine / 2 + window / 2
        return np.sort(middles / FINE % self.pitches)

    def __call__(self, phase, deflection, rate=0.0, **offsets) -> np.ndarray:
        """Mesh force [N] at phase [1], deflection [m], rate of the deflection [m/s] and each of the law's offsets.

        Arguments are numbers or arrays that broadcast. The force is > 0 on the driving flank and < 0 on the back flank.
        Raises ValueError beyond the table.
        """
        unknown = set(offsets) ^ set(self.offsets)
        remedy = self._to_map(set(offsets) - set(self.offsets)) or "; give each a value"
        require(not unknown, f"offsets must be {list(self.offsets)}, got {list(offsets)}{remedy}")
        all_offsets = dict.fromkeys(OFFSETS, 0.0) | offsets if self.offsets else {}
        arguments = {"phase": phase, "deflection": deflection, "rate": rate} | all_offsets
        values = np.broadcast_arrays(*(numbers(name, x) for name, x in arguments.items()))
        for name, value in zip(arguments, values, strict=True):
            require_finite(name, value)
        force = np.empty(values[0].shape)
        try:
            flat = (np.ascontiguousarray(x).ravel() for x in values)
            mesh_forces(bool(self.offsets))(force.reshape(-1), self.table.head, *flat)
            return force
        except ValueError as error:
            raise ValueError(beyond_map(self.table.head, error.args)) from None

    @checked
    def at(self, **offsets: float) -> "MeshForce":
        """The law at fixed values of offsets, by name, without their axes; ValueError beyond the axes.

        Each flank is taken at these values, with its own z.
        """
        return self._at(offsets, None if self.coast is None else self.coast.at(**offsets))

    @checked
    def flank_at(self, side: float, **offsets: float) -> "MeshForce":
        """The law of the driving (side 1) or coast flank (-1) alone, at fixed values of offsets, by name."""
        require(side in (1, -1), f"side must be 1, the driving flank, or -1, the coast flank, got {side}")
        of_flank = self.coast if side < 0 and self.coast is not None else self
        return of_flank._at(offsets, None)

    def _at(self, offsets: Mapping[str, float], coast: "MeshForce | None") -> "MeshForce":
        """The driving flank at fixed values of offsets, with a coast flank."""
        unknown = set(offsets) - set(self.offsets)
        require(not unknown, f"offsets may be {list(self.offsets)}, got {list(offsets)}{self._to_map(unknown)}")
        if not offsets:
            return self
        for name, value in offsets.items():
            require_finite(name, value)
        kept = REDUCED.setdefault(self, {})
        key = (tuple(sorted(offsets.items())), id(coast))
        if key not in kept or kept[key].coast is not coast:
            while len(kept) >= MOST_REDUCED:
                del kept[next(iter(kept))]
            kept[key] = self._reduced(offsets, coast)
        return kept[key]

    def _to_map(self, names: Iterable[str]) -> str:
        """Remedy for offsets over which the law has no axis; "" where there are none of them."""
        axes = [f"{name}=(...)" for name in OFFSETS if name in names]
        if not axes:
            return ""
        function = "static_transmission_error" if self.teeth is None else "tooth_pair_map"
        map_over = f"fem.{function}(..., offsets=fem.Offsets({', '.join(axes)}))"
        return f": the law has no such axis; compute its map over it, {map_over}"

    def _reduced(self, offsets: Mapping[str, float], coast: "MeshForce | None") -> "MeshForce":
        """`_at` valid offsets, tabulated anew."""
        try:
            arrays = at_fixed_offsets(self, offsets)
        except ValueError as error:
            raise ValueError(beyond_map(self.table.head, error.args)) from None
        left = {name: values for name, values in self.offsets.items() if name not in offsets}
        if not arrays["centroid"].any():
            arrays["centroid"] = np.array(0.0)
        if self.teeth is not None:
            arrays["teeth"] = self.teeth.at(offsets)
        return replace(self, **arrays, offsets=left, fixed_offsets={**self.fixed_offsets, **offsets}, coast=coast)

    @checked
    def deflection_at(self, phase: Finite, force: float, **offsets: float) -> float:
        """Static deflection [m] on the driving flank under a force >= 0 [N]; ValueError beyond the table."""
        if self.offsets or offsets:
            require({*self.offsets} <= {*offsets}, f"deflection_at needs all of {list(self.offsets)}, got {offsets}")
            return self.flank_at(1, **offsets).deflection_at(phase, force)
        low, top = self.unloaded(phase)
        largest, end = float(self(phase, top)), top + 0.5 * CONTINUED * (top - low)
        remedy = f"must lie in [0, {largest:.4g}] N, the map's range at phase {phase:.4g}, got {force:.4g}"
        require(0 <= force <= float(self(phase, end)), f"force {remedy}; extend the map to a larger torque")
        write_forces, head = mesh_forces(False), self.table.head
        at, deflection, at_rest, value = np.array([float(phase)]), np.empty(1), np.zeros(1), np.empty(1)

        def missing(x: float) -> float:
            deflection[0] = x
            write_forces(value, head, at, deflection, at_rest)
            return value[0] - force

        return scipy.optimize.brentq(missing, low, end, xtol=FINEST)

    @checked
    def ste(self, pair: GearPair, torque: Numbers, phases: int = 16) -> xr.Dataset:
        """Map of the transmission error that the law takes, over all its pitches: te over (torque, phase).

        pair        whose force law it is
        torque      pinion torques [N m], increasing from 0 or above, up to what the law holds
        phases      number of phases in a pitch

        All states of a hunting period of 1,081 pitches take about a second. Raises ValueError for a law over offsets
        (fix them by `at`), and for torques beyond the law.
        """
        require(not self.offsets, f"ste needs a law without offsets, got {list(self.offsets)}; fix them by at(...)")
        values = increasing("torque", np.atleast_1d(numbers("torque", torque)))
        require(bool(values[0] >= 0), f"torque must be >= 0 N m, got {values[0]:g}; take the law of the mirror image")
        require(phases >= 4, f"phases must be at least 4 in a pitch, got {phases}")
        phase, loads = np.arange(phases * self.pitches) / phases, values / pair.pinion.r_b
        largest = min(self._largest_at(at) for at in phase[: phases * min(self.pitches, 2)])
        within = f"torque must lie below {largest * pair.pinion.r_b:.4g} N m, the end of the law, got {values[-1]:g}"
        require(bool(loads[-1] <= largest), within)
        try:
            te = static_deflections(self, phase, loads)
        except ValueError as error:
            raise ValueError(beyond_map(self.table.head, error.args)) from None
        return ste_map(pair, values, phase, te, pitches=self.pitches)

    def _largest_at(self, phase: float) -> float:
        """Force [N] at the end of the table at a phase."""
        return float(self(phase, self.unloaded(phase)[1]))

    @checked
    def unloaded(self, phase: Finite) -> tuple[float, float]:
        """Deflections at loss of contact and at the end of the map [m], of a law without offsets."""
        return range_at(self.table.head, float(phase))


def damped(law: MeshForce, damping: float) -> MeshForce:
    """The law with another damping [N s/m], in whose table nothing else changes; ValueError for one out of range."""
    _check_scalars(damping, law.backlash, law.back_phase)
    return _with_scalar(law, damping=damping)


def widened(law: MeshForce, by: float) -> MeshForce:
    """The law with more backlash [m], in whose table nothing else changes; ValueError for one out of range."""
    _check_scalars(law.damping, law.backlash + by, law.back_phase)
    return _with_scalar(law, backlash=law.backlash + by)


def _with_scalar(law: MeshForce, **scalar: float) -> MeshForce:
    """The law with another damping or backlash."""
    changed_law, table = copy(law), law.table
    flanks = {"head": changed(table.head, **scalar)}
    if law.coast is not None:
        flanks["coast"] = changed(table.coast, head=changed(table.coast.head, **scalar))
    set_fields(changed_law, **scalar, table=changed(table, **flanks))
    return changed_law


def composed_law(teeth: ToothPairs, **given) -> MeshForce:
    """The law of tooth pairs, with its table of teeth that are alike; given: further fields, such as pitches."""
    bare: dict[str, Any] = {"offsets": teeth.single.offsets, "fixed_offsets": given.get("fixed_offsets", {})}
    reach = np.array([0.0, um])
    shape = tuple(axis.size for axis in teeth.single.offsets.values())
    placeholder = np.broadcast_to(reach, (*shape, PHASES, 2)), np.broadcast_to([0.0, 1.0], (*shape, PHASES, 2))
    phase, has_centroid = uniform_phases(PHASES, 1), bool(np.any(teeth.single.centroid) or np.any(teeth.moments))
    # a centroid that is not 0 gives the table that of the tooth pairs
    centroid = np.full((*shape, PHASES, 2), 1e-12) if has_centroid else 0.0
    alike = MeshForce(phase, *placeholder, teeth=teeth.without_deviations(), centroid=centroid, **bare)
    arrays: dict[str, Any] = dict(blocks_of(alike, phase))
    fields = {**arrays, **bare, **given} | ({} if has_centroid else {"centroid": 0.0})
    return MeshForce(phase, **fields, teeth=teeth)


def fixed_axial(pairs: xr.Dataset) -> dict[str, float]:
    """The axial offset [m] for which a map of tooth pairs was made, by name; empty where it is 0."""
    axial = float(pairs.attrs.get("axial", 0.0))
    return {"axial": axial} if axial else {}


def fixed_axial_offset(ste: xr.Dataset) -> dict[str, float]:
    """The axial offset [m] for which a map without that axis was made, by name; empty where it is 0."""
    given = ste.coords.get("axial", ste.attrs.get("axial", 0.0))
    return {"axial": float(given)} if np.size(given) == 1 and float(given) else {}


def _arrays_of(ste: xr.Dataset, pair: GearPair, extend: float) -> dict[str, Any]:
    """Arguments of the law of one flank, from the part of a map under torques >= 0."""
    offsets, r_b, pitches = offset_axes(ste), pair.pinion.r_b, pitches_of(ste)
    steps = steps_in_pitch(prod(axis.size for axis in offsets.values()), pitches)
    phase = uniform_phases(steps * pitches, pitches)
    force, deflection = loaded_deflection(ste, r_b, phase, extend=extend)
    denser = "map more phases, drop the lightest torques, or compose the law: MeshForce.from_tooth_pairs"
    require_rising(force * r_b, np.moveaxis(deflection, -1, 0), phase, f"the map is too coarse in between; {denser}")
    table = np.broadcast_to(force, deflection.shape)
    mapped = float(ste[TORQUE][-1]) / r_b if extend > 1 else inf
    centroid = loaded_centroid(ste, r_b, phase, force)
    arrays = {"phase": phase, "deflection": deflection, "force_table": table, "centroid": centroid}
    return arrays | {"offsets": offsets, "mapped_force": mapped, "pitches": pitches}


def _coast_arrays(ste: xr.Dataset, pair: GearPair, extend: float) -> dict[str, Any]:
    """The same of the right flanks, from the torques < 0 of a map."""
    lacking = f"the map has torques < 0, but no {UNLOADED_RIGHT}, the te at which the right flanks touch without load"
    require(UNLOADED_RIGHT in ste, f"{lacking}; map torque 0 too, or assign it over (*offsets, phase)")
    fixed = {name: -value for name, value in fixed_axial_offset(ste).items()}
    try:
        return _arrays_of(right_torques(ste), pair, extend) | {"fixed_offsets": fixed}
    except ValueError as error:
        raise ValueError(f"right flanks, with torque and te reversed: {error}") from None


def _unlike(ste: xr.Dataset) -> str:
    """Why the coast flanks are not the mirror image; "" where they are, or have a law of their own."""
    return "" if float(ste[TORQUE][0]) < 0 else why_unlike(ste)


def _with_tooth_pairs(arguments: dict[str, Any], law: type) -> dict[str, Any]:
    """Arguments of a law from a file, whose tooth pairs are no longer arguments themselves."""
    teeth = arguments["teeth"]
    return (
        arguments if teeth is None else arguments | {"teeth": ToothPairs(**teeth | {"single": law(**teeth["single"])})}
    )


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def _check_scalars(damping: float, backlash: float, back_phase: float) -> None:
    require(0 <= damping < inf, f"damping must be >= 0 N s/m and finite, got {damping}")
    size = f"backlash must be >= 0 m (inf: no back flank), got {backlash}; it is measured on the line of action"
    require(backlash >= 0, size)
    unit = f"backlash must be below 0.01 m, or inf, got {backlash}; pass metres: 0.2*mm"
    require(backlash < 1e-2 or backlash == inf, unit)
    require(isfinite(back_phase), f"back_phase must be finite, a share of a pitch, got {back_phase}")


def _check_offsets(offsets: Mapping[str, np.ndarray]) -> None:
    named = list(offsets) == [name for name in OFFSETS if name in offsets]
    require(named, f"offsets must be of {list(OFFSETS)} in this order, got {list(offsets)}")
    for name, values in offsets.items():
        increasing(f"{name} of the offsets", values, least=2)
        require_finite(f"{name} of the offsets", values)


def _check_offsets_known(fixed: Mapping[str, float]) -> None:
    known = set(fixed) <= set(OFFSETS) and all(isfinite(x) for x in fixed.values())
    require(known, f"fixed_offsets must be finite values of {list(OFFSETS)}, got {dict(fixed)}")


def _check_coast(force: MeshForce) -> None:
    coast = force.coast
    if coast is None:
        return
    require(isinstance(coast, MeshForce), f"coast must be an exugear.MeshForce or None, got {type(coast).__name__}")
    is_bare = coast.damping == 0 and coast.backlash == inf and coast.coast is None
    require(is_bare, "coast must have no damping, backlash or coast: those of the law count for both flanks")
    alike = f"coast must have the offsets {list(force.offsets)}, got {list(coast.offsets)}"
    require(list(coast.offsets) == list(force.offsets), alike)
    pitches = f"coast must run over as many pitches as the law, {force.pitches}, got {coast.pitches}"
    require(coast.pitches == force.pitches, pitches)


def _check_centroid(centroid: np.ndarray, force: np.ndarray) -> None:
    fits = centroid.ndim == 0 or centroid.shape == force.shape
    require(fits, f"centroid must be a number or like force_table {force.shape}, got {centroid.shape}")
    near = bool(np.isfinite(centroid).all()) and bool(np.abs(centroid).max() < 1)
    require(near, f"centroid must be finite and within 1 m, got {np.abs(centroid).max():g}; pass metres")


def _check_phase(phase: np.ndarray, pitches: int) -> None:
    if not (increasing("phase", phase)[0] >= 0 and phase[-1] < pitches):
        unit = "as share of a pitch" if pitches == 1 else "in pitches"
        raise ValueError(f"phase must increase within [0, {pitches}) {unit}, got {phase}")


def _check_table(phase: np.ndarray, deflection: np.ndarray, force: np.ndarray, counts: list[int]) -> None:
    shapes = f"got {phase.shape}, {deflection.shape}, {force.shape}"
    columns = deflection.shape[-1] if deflection.ndim else 0
    fits = force.shape == (*counts, phase.size, columns) and columns >= 2 and deflection.ndim <= force.ndim
    fits = fits and all(x in (1, y) for x, y in zip(deflection.shape[::-1], force.shape[::-1], strict=False))
    require(fits, f"force_table must be (n_phase, n_defl) over phase (n_phase,) and deflection (n_defl,), {shapes}")
    require(increases(deflection), "deflection must increase along its last axis [m]; sort it and its forces")
    size = np.abs(deflection).max()
    require(size < 1e-2, f"deflection must lie within 0.01 m, got {size:g}; pass metres: 20*um")
    require_finite("force_table", force, "solve or measure the missing points")
    none = "force_table must be 0 in the first column; begin deflection where no teeth touch (the driving flank alone)"
    require(bool((force[..., 0] == 0).all()), none)
    loaded = force[..., 1:] > 0
    rises = (np.diff(force) > 0) == loaded
    grow = "force_table must grow with the deflection once the teeth touch; check its sign and its axes"
    require(bool(rises.all() and loaded[..., -1].all()), grow)
