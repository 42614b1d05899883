"""Tooth pairs of which a force law over a long period is composed: as data, from their map, and as packed arrays."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import ceil, isnan, nan, prod
from typing import Any

import numpy as np
import scipy
import xarray as xr

from exugear.mesh_force.kernel_records import record_of, start_of_field
from exugear.mesh_force.layout import INCREMENT, TEETH, TOOTH_PAIR
from fem.ste.load_interpolation import deflection_under, over_parts
from fem.ste.ste_map import CENTROID, LAW_OFFSETS, STIFFNESS, TE, TORQUE, pair_of
from fem.support.user_warning import warn_user
from fem.support.validation import set_fields
from fem.units import um

#: Positions in a pitch of single tooth pairs in a law, and number of t of increments.
STEPS, INCREMENT_LOADS = 128, 33
#: Loads of a single tooth pair: least over the lowest of the map, how many below it and up to the largest one, and from
#: there to this multiple of it, along the last stiffness.
LIGHTEST, BELOW, WITHIN, BEYOND, LARGEST = 1e-4, 40, 100, 8, 2.5
#: Most fall of an increment beside the path of contact over the growth of the deflection: without load the slope of a
#: cubic over t that begins flat is three times as large, and both teeth may have one.
MOST_FALL = 0.15
#: Share of its deflection by which the tilt of a tooth pair may move the flanks at the longest arm of its load.
LIMIT = 0.5
#: Most deviation of a tooth pair from its place by pitch deviations [pitches].
MOST_TURN = 0.05
#: Longest arm of loads whose moments do not count [m]: flanks tilt by up to 1e-3.
LEAST_ARM = 1e-6
#: Unloaded deflection of a single tooth pair up to which it is on the path of contact [m].
TOUCHING = 1e-6
#: Error over what deviations add, and error [m], above which a law warns: the theory states up to 8 % (spalls).
LARGEST_SHARE, LEAST_TOLD = 0.08, 0.1 * um


def _absent() -> np.ndarray:
    """Stands for arrays that are not given: no moments, and no increments that meet."""
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class ToothPairs:
    """What a `MeshForce` over a long period is composed of.

    single              law of a single tooth pair over its position: phase 0 is at the position first
    first, last         positions between which tooth pairs may touch, in pitches from the pitch point
    pitch_1, pitch_2    (z,) pitch deviations of the teeth of pinion and wheel [m]
    variant_1, variant_2
                        (z,) numbers of their increments; -1: none
    coupling            (n_distance, n) transmission error of a tooth pair per load on that 1, 2, ... pitches ahead
                        [m/N]
    coupled_first       position of the first coupling; there are coupled_steps in a pitch
    moment_coupling     (3, n_distance, n) transmission error of a tooth pair ahead by a moment of the load on the
                        former, of the former by a moment ahead [1/N], and of moment by moment [rad/(N m)]
    increments          (n_block n_variant, n, n_t) change of the deflection of a tooth [m], over its position and t,
                        for each block of offsets: of pinion, wheel, and of both beside the sum of theirs
    moments             likewise: change of the moment of the load [N m]
    meeting             (n_pinion, n_wheel) which of the latter belongs to increments of pinion and wheel; -1: none
    placed_first        position of the first increment, placed_steps in a pitch
    largest_load        load of the last increment [N]: t = sqrt(load / largest_load), evenly spaced
    error, error_rms    largest and root mean square difference of the law from contacts that were solved whole [m]; NaN
                        where none were. A sample, no bound (`checks` of `fem.tooth_pair_map`)
    added_rms           root mean square of what deviations add in these contacts [m]
    turn                share of a pitch by which a difference of pitch deviations turns the teeth [1/m]
    """

    single: Any
    first: float
    last: float
    pitch_1: np.ndarray
    pitch_2: np.ndarray
    variant_1: np.ndarray
    variant_2: np.ndarray
    coupling: np.ndarray
    coupled_first: float
    coupled_steps: float
    increments: np.ndarray
    placed_first: float
    placed_steps: float
    largest_load: float
    turn: float
    error: float = nan
    error_rms: float = nan
    added_rms: float = nan
    moments: np.ndarray = field(default_factory=_absent)
    moment_coupling: np.ndarray = field(default_factory=_absent)
    meeting: np.ndarray = field(default_factory=_absent)

    def __post_init__(self):
        for name in ("pitch_1", "pitch_2", "coupling", "increments"):
            set_fields(self, **{name: np.array(getattr(self, name), float)})
        none: dict[str, Any] = {
            "moments": np.zeros_like(self.increments),
            "moment_coupling": np.zeros((3, *self.coupling.shape)),
        }
        of_gears = [len(set(x[x >= 0].tolist())) for x in map(np.asarray, (self.variant_1, self.variant_2))]
        none["meeting"] = np.full(of_gears, -1.0)
        for name, values in none.items():
            given = getattr(self, name)
            set_fields(self, **{name: values if np.size(given) == 0 else np.array(given, float)})

    @property
    def blocks(self) -> int:
        """Number of combinations of offsets."""
        return prod(axis.size for axis in self.single.offsets.values())

    def at(self, offsets: Mapping[str, float]) -> "ToothPairs":
        """The tooth pairs at fixed offsets; increments linear between their values."""
        axes = self.single.offsets
        shape = *(axis.size for axis in axes.values()), len(self.increments) // self.blocks
        reduced: dict[str, np.ndarray] = {}
        for name in ("increments", "moments"):
            values = getattr(self, name)
            values = values.reshape(*shape, *values.shape[1:])
            for i, (axis, at) in reversed(list(enumerate(axes.items()))):
                if axis in offsets:
                    values = scipy.interpolate.interp1d(at, values, axis=i, fill_value="extrapolate")(offsets[axis])
            reduced[name] = values.reshape(-1, *values.shape[-2:])
        single = self.single._at(offsets, None)
        return replace(self, single=single, increments=reduced["increments"], moments=reduced["moments"])

    @property
    def proud(self) -> float:
        """Least sum of deviations of two teeth that meet [m]: < 0 where they stand proud."""
        least = float(self.pitch_1.min() + self.pitch_2.min())
        if not self.increments.size:
            return least
        touches = self.single.deflection[..., 0].reshape(-1, self.single.phase.size).min(axis=0)
        place = self.placed_first + np.arange(self.increments.shape[1]) / self.placed_steps
        on_path = np.interp(place, self.first + self.single.phase, touches) < TOUCHING
        of_teeth = self.increments.reshape(self.blocks, -1, *self.increments.shape[1:])[:, : sum(self.meeting.shape)]
        return least + float(of_teeth[:, :, on_path, 0].min(initial=0.0))

    @property
    def tilt_by_load(self) -> float:
        """Limit of the tilt by which the moment of a tooth pair works, per load [rad/N]; 0 where no moments count.

        At the longest arm of a load it moves the flanks by half of what the load deflects them. Under a larger tilt a
        part of the face is without load, and the moment that was solved without tilt is not that of the rest.
        """
        load = self.largest_load * np.linspace(0, 1, INCREMENT_LOADS)[1:] ** 2
        arm = float(np.abs(self.moments[..., 1:] / load).max(initial=0.0))
        return LIMIT / (arm * self.single.stiffness_max) if arm > LEAST_ARM else 0.0

    @property
    def pull(self) -> float:
        """Most by which moments of the loads of tooth pairs let their neighbours touch earlier [m]."""
        of_both = np.split(self.moments.reshape(self.blocks, -1, *self.moments.shape[1:]), self.meeting.shape[:1], 1)
        most = sum(float(np.abs(x).max(initial=0.0)) for x in of_both)
        return most * float(np.abs(self.moment_coupling[:2]).max(initial=0.0))

    def without_deviations(self) -> "ToothPairs":
        """Tooth pairs that are all alike."""
        none = {f"pitch_{i}": np.zeros(1) for i in (1, 2)} | {f"variant_{i}": np.full(1, -1) for i in (1, 2)}
        empty: dict[str, Any] = {
            "increments": self.increments[:0],
            "moments": self.moments[:0],
            "meeting": np.zeros((0, 0)),
        }
        return replace(self, **none, **empty)

    def rows(self, number: np.ndarray) -> np.ndarray:
        """Records TOOTH_PAIR by their numbers, the phases [pitches] at which they meet at the pitch point."""
        tooth_1, tooth_2 = -number % self.pitch_1.size, number % self.pitch_2.size
        pitch_1, pitch_2 = self.pitch_1[tooth_1], self.pitch_2[tooth_2]
        rows = np.empty(number.size, TOOTH_PAIR)
        rows["pitch"] = pitch_1 + pitch_2
        rows["moved"] = np.clip((pitch_2 - pitch_1) * self.turn, -MOST_TURN, MOST_TURN)
        rows["variant_1"], rows["variant_2"] = self.variant_1[tooth_1], self.variant_2[tooth_2]
        return rows

    def table(self, pitches: int) -> np.record:
        """The packed arrays behind the table of a law over a number of pitches."""
        reach = ceil(max(-self.first, self.last)) + 1
        single = self.single.table
        coupling = _with_slopes(np.concatenate([self.coupling[None], self.moment_coupling]))
        increments = _nodes(self.increments, self.moments, self.largest_load)
        arrays = {
            "pairs": self.rows(np.arange(-reach, pitches + reach + 1)),
            "coupling": coupling,
            "meeting": self.meeting,
            "increments": increments,
        }
        kind = np.dtype(
            (
                np.record,
                np.dtype(
                    [
                        ("head", TEETH),
                        *((name, values.dtype, values.shape) for name, values in arrays.items()),
                        ("single", single.dtype),
                    ],
                    align=True,
                ),
            )
        )
        starts = {f"{name}_start": start_of_field(kind, name) for name in (*arrays, "single")}
        starts["pairs_start"] += reach * TOOTH_PAIR.itemsize
        head = record_of(
            TEETH,
            distances=len(self.coupling),
            coupled=self.coupling.shape[1],
            placed=self.increments.shape[1],
            loads=INCREMENT_LOADS,
            in_block=len(self.increments) // self.blocks,
            of_pinion=self.meeting.shape[0],
            of_wheel=self.meeting.shape[1],
            first=self.first,
            last=self.last,
            coupled_first=self.coupled_first,
            coupled_steps=self.coupled_steps,
            placed_first=self.placed_first,
            placed_steps=self.placed_steps,
            largest_load=self.largest_load,
            tilt_by_load=self.tilt_by_load,
            pull=self.pull,
            **starts,
        )
        return record_of(kind, head=head, **arrays, single=single)


def _with_slopes(values: np.ndarray) -> np.ndarray:
    """(..., n, 2) values with their slopes per step."""
    steps = np.arange(values.shape[-1])
    slopes = scipy.interpolate.CubicSpline(steps, values, axis=-1)(steps, 1)
    return np.stack([values, slopes], axis=-1)


def _nodes(values: np.ndarray, moments: np.ndarray, largest_load: float) -> np.ndarray:
    """(n_variant, n, n_t) records INCREMENT: flat at t = 0, where the load grows with t^2.

    Moments grow with t^3 there, so that those of the neighbours do not change at which deflection teeth touch. All
    greater ones lie so much lower that their slopes remain: they would overshoot else.
    """
    nodes = np.zeros(values.shape, INCREMENT)
    if not len(values):
        return nodes
    t, s = np.linspace(0, 1, values.shape[2]), np.arange(values.shape[1])
    slopes = scipy.interpolate.PchipInterpolator(t, values, axis=2)(t, 1)
    slopes[..., 0] = 0
    over_t = scipy.interpolate.CubicHermiteSpline(t, values, slopes, axis=2)
    nodes["value"], nodes["by_t"] = values, slopes * t[1]
    points, weights = np.polynomial.legendre.leggauss(3)
    inner = (t[:-1, None] + t[1] * (points + 1) / 2).ravel()
    shares = (over_t(inner) * inner * np.tile(weights / 2, t.size - 1) * t[1]).reshape(*values.shape[:2], -1, 3)
    nodes["work"][..., 1:] = 2 * largest_load * np.cumsum(shares.sum(axis=-1), axis=-1)
    of_moments = scipy.interpolate.PchipInterpolator(t, moments, axis=2)(t, 1)
    of_moments[..., 0] = 0
    moments = moments - (moments[..., 1] - of_moments[..., 1] * t[1] / 3)[..., None]
    moments[..., 0] = 0
    nodes["moment"], nodes["moment_by_t"] = moments, of_moments * t[1]
    slopes_of = ("value", "by_s"), ("by_t", "by_t_s"), ("work", "work_by_s")
    for name, slope in (*slopes_of, ("moment", "moment_by_s"), ("moment_by_t", "moment_by_t_s")):
        nodes[slope] = scipy.interpolate.CubicSpline(s, nodes[name], axis=1)(s, 1)
    return nodes


def tooth_pairs_of(data: xr.Dataset, law: type) -> ToothPairs:
    """`ToothPairs` from `fem.tooth_pair_map`; law: the class of force laws."""
    pair, parts = pair_of(data), np.asarray(data.attrs["parts"], float)
    first, last = float(parts[0]), float(parts[-1])
    variants = [data[f"{gear}_variant_of"].values for gear in ("pinion", "wheel")]
    meeting = data["meeting_of"].values
    second = np.where(variants[1] >= 0, variants[1] + len(meeting), -1)
    at = data["coupled_position"].values
    return ToothPairs(
        single=law(**_single(data, parts)),
        first=first,
        last=last,
        pitch_1=data["pinion_pitch"].values,
        pitch_2=data["wheel_pitch"].values,
        variant_1=variants[0],
        variant_2=second,
        coupling=data["coupling"].values,
        coupled_first=float(at[0]),
        coupled_steps=float(1 / (at[1] - at[0])),
        moment_coupling=data["moment_coupling"].values,
        increments=_increments(data, "increment"),
        moments=_increments(data, "moment"),
        meeting=np.where(meeting >= 0, meeting + sum(meeting.shape), -1),
        placed_first=float(data["increment_position"][0]),
        placed_steps=float(1 / np.diff(data["increment_position"].values[:2])[0]),
        largest_load=float(data["increment_torque"][-1]) / pair.pinion.r_b,
        turn=1 / (2 * pair.p_bt),
    )


def errors_of(te: np.ndarray, pairs: xr.Dataset) -> dict[str, float]:
    """Errors of te (n_load, n_phase) [m] of a law beside the contacts solved whole, and what deviations add in these.

    A law whose errors are a larger share than the theory states warns; so does one whose share is not known, as maps of
    earlier versions lack te_alike.
    """
    whole = pairs["te_check"].values
    alike = pairs["te_alike"].values if "te_alike" in pairs else np.full(whole.shape, nan)
    error_rms, added_rms = (float(np.sqrt((x**2).mean())) for x in (te - whole, whole - alike))
    if error_rms > LEAST_TOLD and not error_rms <= LARGEST_SHARE * added_rms:
        told = f"the composed law errs by {error_rms / um:.2g} um rms"
        if isnan(added_rms):
            beside = "what deviations add is not in the map, which an earlier version made"
            remedy = "compute it anew by fem.tooth_pair_map"
        else:
            beside = f"where deviations add {added_rms / um:.2g} um"
            remedy = "compute the map of all pitches, or more checks"
        warn_user(f"{told}, {beside}, in {whole.size} states solved whole; {remedy}")
    return {"error": float(np.abs(te - whole).max()), "error_rms": error_rms, "added_rms": added_rms}


def rising(deflection: np.ndarray) -> np.ndarray:
    """Deflections (..., n_load) that rise from load to load, where splines between far positions do not."""
    growth = np.diff(deflection, axis=-1)
    least = np.median(growth.reshape(-1, growth.shape[-1]), axis=0) / 20
    floor = np.append(0.0, np.cumsum(least))
    return np.maximum.accumulate(deflection - floor, axis=-1) + floor


def _single(data: xr.Dataset, parts: np.ndarray) -> Mapping[str, Any]:
    """Arguments of the law of a single tooth pair over its position."""
    axes = {name: data[name].values for name in LAW_OFFSETS if name in data.dims}
    dims = [TORQUE, *axes, "position"]
    te, stiffness, centroid = (data[name].transpose(*dims).values for name in (TE, STIFFNESS, CENTROID))
    loads = data[TORQUE].values[1:] / pair_of(data).pinion.r_b
    force = np.r_[loads[0] * np.geomspace(LIGHTEST, 1, BELOW + 1)[:-1], np.geomspace(loads[0], loads[-1], WITHIN)]
    within = te[:1] + deflection_under(loads, te[1:] - te[0], force, stiffness[1:])
    further = loads[-1] * np.geomspace(1, LARGEST, BEYOND + 1)[1:]
    across = (slice(None),) + (None,) * (te.ndim - 1)
    beyond = te[-1] + (further - loads[-1])[across] / stiffness[-1]
    deflection = np.concatenate([te[:1], within, beyond])
    over = np.log(np.clip(np.r_[0, force, further], loads[0], loads[-1]))
    moved = scipy.interpolate.PchipInterpolator(np.log(loads), centroid[1:])(over)
    pitches = ceil(parts[-1] - parts[0] + 0.25)
    phase = np.arange(pitches * STEPS) / STEPS
    # the law is periodic, tooth pairs are not: behind the last position the curves return to the first
    returns = np.clip((phase + parts[0] - parts[-1]) / (pitches - (parts[-1] - parts[0])), 0, 1)
    returns = returns**2 * (3 - 2 * returns)

    def at_phases(values: np.ndarray) -> np.ndarray:
        curve = over_parts(data["position"].values, np.moveaxis(values, -1, 0), parts, phase + parts[0])
        shares = returns.reshape(-1, *(1,) * (curve.ndim - 1))
        return np.moveaxis((1 - shares) * curve + shares * curve[:1], (0, 1), (-2, -1))

    return {
        "phase": phase,
        "deflection": rising(at_phases(deflection)),
        "force_table": np.broadcast_to(np.r_[0, force, further], (*te.shape[1:-1], phase.size, len(deflection))),
        "centroid": at_phases(moved) if np.abs(centroid).max() > 0 else 0.0,
        "pitches": pitches,
        "offsets": axes,
    }


def _increments(data: xr.Dataset, what: str) -> np.ndarray:
    """(n_block n_variant, n, INCREMENT_LOADS) increments, or moments, at evenly spaced positions and t."""
    t = np.sqrt(data["increment_torque"].values / float(data["increment_torque"][-1]))
    axes = [name for name in LAW_OFFSETS if name in data.dims]
    of_blocks = []
    for of in ("pinion_variant", "wheel_variant", "meeting"):
        of_gear = data[f"{of.removesuffix('_variant')}_{what}"]
        of_blocks.append(of_gear.transpose(*axes, of, "increment_position", "increment_torque").values)
    values = np.concatenate(of_blocks, axis=len(axes))
    if what == "increment" and values.size and not pair_of(data).beta_b:
        values = _rising_beside_path(data, values, axes)
    values = values.reshape(-1, *values.shape[-2:])
    return scipy.interpolate.PchipInterpolator(t, values, axis=2)(np.linspace(0, 1, INCREMENT_LOADS))


def _rising_beside_path(data: xr.Dataset, values: np.ndarray, axes: list[str]) -> np.ndarray:
    """Increments (*axes, n_variant, n, n_load) with which tooth pairs beside the path of contact deflect more the more
    they carry, of spur gears: contacts along tip corners are solved to some 10 nm, more than light loads deflect them.
    """
    parts, position = np.asarray(data.attrs["parts"], float), data["increment_position"].values
    te, stiffness = (data[name].transpose(TORQUE, *axes, "position").values for name in (TE, STIFFNESS))
    loads, of_increments = (data[name].values[1:] for name in (TORQUE, "increment_torque"))
    r_b = pair_of(data).pinion.r_b
    alone = deflection_under(loads / r_b, te[1:] - te[0], of_increments / r_b, stiffness[1:])
    alone = over_parts(data["position"].values, np.moveaxis(alone, -1, 0), parts, position)
    beside = (position < parts[1]) | (position > parts[-2])
    # (*axes, 1, n, n_load)
    alone = np.moveaxis(alone, (0, 1), (-2, -1))[..., None, :, :]
    growth = np.diff(np.concatenate([0 * alone[..., :1], alone], axis=-1), axis=-1)
    values = values.copy()
    for j in range(values.shape[-1] - 2, -1, -1):
        most = values[..., j + 1] + MOST_FALL * np.maximum(growth[..., j], 0)
        values[..., j] = np.where(beside, np.minimum(values[..., j], most), values[..., j])
    return values
