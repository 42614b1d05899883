"""The STE map as data: its axes and variables with their units, checks, load and save."""

from dataclasses import fields
from math import floor, lcm
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import xarray as xr

from fem.gear import rim_support
from fem.gear.gear import Gear
from fem.gear.material import Material
from fem.gear.pinion_cutter import PinionCutter
from fem.microgeometry.flank import equal_on_all_teeth, from_text, to_text
from fem.pair.pair import GearPair
from fem.support.arguments import FilePath, Numbers, checked
from fem.support.netcdf import read, write
from fem.support.tables import read_grid
from fem.support.user_warning import warn_user
from fem.support.validation import increasing, numbers, require, require_finite

SIZES = [part.name for part in fields(Gear) if part.name not in ("material", "flank", "cutter", "support")]
#: Sizes that not every gear has: shape of the root fillet, and where an external or an internal gear is clamped.
OPTIONAL = ("rho_f", "fillet", "d_bore", "d_rim")
CUTTER = [part.name for part in fields(PinionCutter)]
TORQUE, PHASE, TE, CENTROID, STIFFNESS, LOAD_SHARE = "torque", "phase", "te", "centroid", "stiffness", "load_share"
PAIR, UNLOADED_RIGHT, RING_ANGLE = "pair", "te_unloaded_right", "ring_angle"
#: Attribute of maps with torques < 0: how the states of the right flanks were obtained, and its values.
RIGHT_FLANKS, SOLVED, MIRRORED = "right_flanks", "solved", "mirror image of the left flanks"
#: Attribute of maps that were made with a larger gap between their phases than others may have [pitches].
PHASE_GAP, LARGEST_GAP = "phase_gap", 1 / 3
#: Attribute of maps of a ring on supports: te by a unit mesh force of another mesh, at evenly spaced angles from it on
#: the ring, largest over the positions [m/N].
CROSS_COMPLIANCE = "cross_compliance"
#: Likewise the part of it that is left out by 1, 2, ... modes of the ring, one list of angles after the other [m/N].
CROSS_LEFT_OUT = "cross_left_out"
#: Offsets of the wheel, and the position of the mesh on a ring between its supports, in the order of the axes of a map.
OFFSETS = {
    "a": ("m", "working centre distance"),
    "axial": ("m", "axial position of the wheel"),
    "misalignment": ("rad", "misalignment in the plane of action"),
    "f_sigma_delta": ("rad", "parallelism error in the plane of the axes"),
    "f_sigma_beta": ("rad", "parallelism error across the plane of the axes"),
    RING_ANGLE: ("rad", "position of the mesh on the ring"),
}
AXES = {
    TORQUE: ("N m", "pinion torque"),
    **OFFSETS,
    PHASE: ("1", "phase of the mesh cycle"),
    PAIR: ("1", "number of the tooth pair: pitches ahead of tooth pair 0"),
}
#: Variables of a map that have a value for each contact state.
STATE_VARIABLES = {
    TE: ("m", "static transmission error"),
    STIFFNESS: ("N/m", "tangent mesh stiffness, change of the mesh force per transmission error"),
    CENTROID: ("m", "axial position of the force centroid"),
    "line_load": ("N/m", "largest force per length of contact line"),
    "hertz_pressure": ("Pa", "largest contact pressure by Hertz of the line load"),
    "peak_pressure": ("Pa", "largest contact pressure, including tip edges"),
    "tip_contact": ("1", "share of the load where the contact reaches a tip edge"),
    LOAD_SHARE: ("1", "share of the load on a tooth pair"),
}
VARIABLES = {
    **STATE_VARIABLES,
    "pairs_in_contact": ("1", "tooth pairs in contact"),
    "contact_ratio": ("1", "contact ratio under load"),
    UNLOADED_RIGHT: ("m", "transmission error at which the right flanks touch without load, backlash left out"),
    "error_mesh": ("m", "estimated root mean square error by the mesh"),
    "error_phase": ("m", "estimated root mean square error by interpolation over phase"),
    "error_torque": ("m", "estimated root mean square error by interpolation over torque"),
    "error_ring_angle": ("m", "estimated root mean square error by interpolation over the ring angle"),
    "error_p2p": ("m", "estimated error of the largest less the least te of the phases"),
    "error_slices": ("m", "estimated error of the peak to peak by the number of slices"),
    "error_p2p_curve": ("m", "estimated error of the peak to peak by fem.peak_to_peak"),
}
#: Largest te of a table that is no mistake of units [m].
LARGEST_TE = 0.01
#: Distance of phases that counts as rounding.
ROUNDING = 1e-9
#: Offsets that a force law follows, in this order.
LAW_OFFSETS = ("a", "misalignment", "axial")


@checked
def ste_map(
    pair: GearPair, torque: Numbers, phase: Numbers, te: Numbers, offsets: dict | None = None, **attributes
) -> xr.Dataset:
    """Map with te [m] over torque [N m], offsets and phase [1]; its attributes hold the pair and the `attributes`.

    torque      (n_torque,) pinion torque F r_b1 of the mesh force F, increasing; 0 gives the unloaded transmission
                error; torques < 0 load the right flanks, whose te counts from where they touch without backlash; assign
                their unloaded one as te_unloaded_right over (*offsets, phase)
    phase       (n_phase,) position in the mesh cycle as share of a pitch, in [0, 1); 0: pair 0 at the pitch point
    te          (n_torque, *n_offset, n_phase) transmission error on the line of action, > 0: the pinion leads
    offsets     axes between torque and phase: increasing values by name (a, axial, misalignment, ...)

    Raises ValueError for axes that do not increase or end, attributes that are inputs of the pair, unknown offsets and
    a te of another shape.
    """
    unknown = set(offsets or {}) - OFFSETS.keys()
    require(not unknown, f"offsets may be {list(OFFSETS)}, got {', '.join(map(str, unknown))}")
    axes = {TORQUE: torque, **(offsets or {}), PHASE: phase}
    in_words = {name: f"{name} of the offsets" if name in OFFSETS else name for name in axes}
    values, grid = {name: increasing(in_words[name], axis) for name, axis in axes.items()}, tuple(axes)
    for name, axis in values.items():
        require_finite(in_words[name], axis)
    inputs = pair_attributes(pair)
    attributes = attributes | gap_attribute(values[PHASE], attributes.get("pitches", 1))
    replaced = sorted(inputs.keys() & attributes.keys())
    require(not replaced, f"attributes {replaced} are inputs of the pair; change the pair instead")
    te, shape = numbers(TE, te), tuple(axis.size for axis in values.values())
    require(te.shape == shape, f"te must have the shape {shape} over {grid}, got {te.shape}")
    data = xr.Dataset(
        {TE: (grid, te, description(TE))},
        coords={name: (name, axis, description(name)) for name, axis in values.items()},
        attrs={"title": "static transmission error map", **inputs, **attributes},
    )
    check(data)
    return data


@checked
def ste_from_table(path: FilePath, pair: GearPair) -> xr.Dataset:
    """The map of a table of te from elsewhere, another program or a rig, with units in its header.

    path    text file (CSV, or separated by blanks) with a line for each point, in any order, under the header

                torque [N m], phase [1], te [um]

            and a column for each offset of the wheel that varies: a [mm], axial [mm], misalignment [mrad],
            f_sigma_delta [mrad], f_sigma_beta [mrad]; other units of the same quantity are converted
    pair    `fem.GearPair` of the table

    Torque, te and phase count as in `fem.ste_map`: torque of the pinion, te on the line of action (an angle of the
    pinion times r_b1), phase 0 where a tooth pair touches at the pitch point in mid-plane.

    Raises FileNotFoundError, and ValueError for a unit that is missing or unknown, NaN, points that are missing or
    given twice, with the line of the file, and for values that are no map.
    """
    units = {name: unit for name, (unit, _) in AXES.items() if name != PAIR}
    axes, values = read_grid(path, units, {TE: STATE_VARIABLES[TE][0]}, optional=OFFSETS)
    largest = float(np.abs(values[TE]).max())
    require(largest < LARGEST_TE, f"te of {path} must lie within {LARGEST_TE} m, got {largest:g} m; correct its unit")
    offsets = {name: axis for name, axis in axes.items() if name in OFFSETS}
    return ste_map(pair, axes[TORQUE], axes[PHASE], values[TE], offsets)


def check(data: xr.Dataset) -> xr.Dataset:
    """The dataset itself, checked to be a usable STE map.

    Raises ValueError for missing names, NaN, axes that do not increase, phases outside [0, 1).
    """
    alone = "a map of tooth pairs (fem.tooth_pair_map) is no STE map"
    remedy = "compose the law, exugear.MeshForce.from_tooth_pairs(pairs), and pass it with the pair"
    require(data.attrs.get("title") != "tooth pairs", f"{alone}; {remedy}")
    missing = [name for name in (TE, TORQUE, PHASE) if name not in data.variables]
    require(not missing, f"an STE map has the variables te, torque and phase; missing: {missing}")
    _check_kinds(data)
    te = data[TE].values
    unknown = set(data[TE].dims) - {TORQUE, PHASE, *OFFSETS}
    require(not unknown, f"te may have the axes torque, phase and {list(OFFSETS)}; select one value of {unknown}")
    torque, phase = (increasing(name, data[name].values) for name in (TORQUE, PHASE))
    require_finite("te", te, "solve the missing states or drop their torque")
    require_finite(TORQUE, torque)
    end = data.attrs.get("pitches", 1)
    if not (phase[0] >= 0 and phase[-1] < end):
        raise ValueError(f"phase must increase within [0, {end}) as share of a pitch, got {phase}")
    if UNLOADED_RIGHT in data:
        _check_unloaded_right(data)
    return data


def _check_unloaded_right(data: xr.Dataset) -> None:
    dims, needed = data[UNLOADED_RIGHT].dims, [name for name in data[TE].dims if name != TORQUE]
    require(set(dims) == set(needed), f"{UNLOADED_RIGHT} must have the axes {needed} of te, got {dims}")
    require_finite(UNLOADED_RIGHT, data[UNLOADED_RIGHT].values, "solve torque 0 of the right flanks")


def number_of_pitches(phase: np.ndarray) -> int:
    """Number of pitches over which phases (n,) run."""
    return floor(phase[-1]) + 1


def largest_gap(phase: np.ndarray, pitches: float = 1) -> float:
    """Largest distance between neighbouring phases (n,) [pitches]; the cycle begins anew after the last."""
    return float(np.diff(phase, append=phase[0] + pitches).max())


def gap_attribute(phase: np.ndarray, pitches: float = 1) -> dict[str, float]:
    """Attribute of data that are made at phases (n,) with a larger gap than `check_whole_cycle` allows to others."""
    gap = largest_gap(phase, pitches)
    return {PHASE_GAP: gap} if gap > LARGEST_GAP + ROUNDING else {}


def phase_weights(phase: np.ndarray, pitches: int) -> np.ndarray:
    """(n_phase,) share of the mesh cycles around each phase, half-way to its neighbours."""
    ahead = np.diff(phase, append=phase[0] + pitches)
    return (ahead + np.roll(ahead, 1)) / (2 * pitches)


def check_whole_cycle(data: xr.Dataset) -> xr.Dataset:
    """The dataset itself; ValueError where its phases leave a gap of more than a third of a pitch in the mesh cycle.

    Data that were made with a larger gap keep it.
    """
    phase = data[PHASE].values
    gap = largest_gap(phase, data.attrs.get("pitches", number_of_pitches(phase)))
    allowed = max(LARGEST_GAP, data.attrs.get(PHASE_GAP, 0.0))
    cycle = f"phase must cover the mesh cycle, but a gap of {gap:.3g} pitches is left between its {phase.size} values"
    remedy = "keep all phases of the map, or make it again with the phases you need"
    require(gap <= allowed + ROUNDING, f"{cycle}, which must be at most {allowed:.3g}; {remedy}")
    return data


def _check_kinds(data: xr.Dataset) -> None:
    for name in (TE, TORQUE, PHASE):
        kind = f"{name} must hold real numbers, got {data[name].dtype} of shape {data[name].shape}"
        require(data[name].dtype.kind in "fiu" and data[name].size > 0, f"{kind}; make the map with fem.ste_map")
    axes = all(data[name].dims == (name,) and name in data[TE].dims for name in (TORQUE, PHASE))
    require(axes, f"te must have the axes torque and phase, got {data[TE].dims}; keep them: ste.sel(torque=[350.0])")


def description(name: str) -> dict[str, str]:
    """Attributes of an axis or a variable of a map: units and long_name."""
    return dict(zip(("units", "long_name"), (AXES | VARIABLES)[name], strict=True))


def pitches_of(data: xr.Dataset) -> int:
    """Number of pitches over which a map runs."""
    return int(data.attrs.get("pitches", 1))


def deviating_teeth(pair: GearPair, *, both_sides: bool = False) -> tuple[int, int]:
    """Numbers of teeth of pinion and wheel after which their left flanks repeat: 1 where all are equal.

    both_sides   whether the right flanks count, too
    """

    def repeats_after(gear: Gear) -> int:
        sides = (gear.drive_flank, gear.coast_flank) if both_sides else (gear.drive_flank,)
        return 1 if all(map(equal_on_all_teeth, sides)) else abs(gear.z)

    return repeats_after(pair.pinion), repeats_after(pair.wheel)


def teeth_of(data: xr.Dataset) -> tuple[int, int]:
    """`deviating_teeth` of the pair of a map, on the sides that it loads."""
    if "pinion_flank" not in data.attrs:
        return 1, 1
    return deviating_teeth(pair_of(data), both_sides=bool(data[TORQUE].values.min() < 0))


def _check_pitches_alike(data: xr.Dataset) -> None:
    """ValueError unless the map covers a single pitch, and all pitches of the pair are alike."""
    pitches = pitches_of(data)
    remedy = "average them or select one, as fem.ste_map of the pair without its PitchDeviation"
    require(pitches == 1, f"the map runs over {pitches} pitches, which differ from one another; {remedy}")
    unlike = "the map is of one pitch, but no two are alike under the PitchDeviation of its flanks"
    remedy = "map the pair without it, or map all pitches and average them as fem.ste_map of that pair"
    require(teeth_of(data) == (1, 1), f"{unlike}; {remedy}")


def warn_of_missing_pitches(pitches: int, teeth: tuple[int, int]) -> None:
    """Warn that measures over some pitches are those of the teeth that meet there; teeth: `deviating_teeth`."""
    period = lcm(*teeth)
    if pitches % period:
        reach = f"phases reach over {pitches} of the {period} pitches after which teeth that differ meet again"
        of_some = "measures are those of the teeth that meet there"
        warn_user(f"{reach}: {of_some}; phases=np.arange({period} * 12) / 12 reach over all")


def check_period(data: xr.Dataset) -> None:
    """ValueError unless the teeth that meet at the end of the map are those of its beginning."""
    pitches, teeth = pitches_of(data), teeth_of(data)
    period = lcm(*teeth)
    runs = f"the map runs over {pitches} pitch{'es' * (pitches > 1)}, but under the PitchDeviation of its flanks"
    whole = f"map all of them, phases=np.arange({16 * period}) / 16, or map the pair without it"
    require(pitches % period == 0, f"{runs} the teeth that meet are the same again after {period} pitches; {whole}")


def over_torque_and_phase(data: xr.Dataset) -> xr.DataArray:
    """Transmission error (torque, phase) of a map.

    Raises ValueError if the map has further axes (select one value of each), or pitches that differ.
    """
    _check_pitches_alike(check(data))
    return over_torque_and_pitches(data)


def over_torque_and_pitches(data: xr.Dataset) -> xr.DataArray:
    """Transmission error (torque, phase) of a map of one or several pitches; ValueError if it has further axes."""
    te = check_whole_cycle(check(data))[TE]
    further = [name for name in te.dims if name not in (TORQUE, PHASE)]
    chosen = ", ".join(f"{name}={data[name].values[0]:g}" for name in further)
    require(not further, f"the map also has the axes {further}; select one value of each: ste.sel({chosen})")
    return te.transpose(TORQUE, PHASE)


def offset_axes(data: xr.Dataset) -> dict[str, np.ndarray]:
    """The map's axes of centre distance [m], misalignment [rad], axial offset [m]; ValueError where it has others."""
    axes = [str(name) for name in data[TE].dims if name not in (TORQUE, PHASE)]
    round_the_ring = "a force law follows the position of the mesh on the ring over whole pitches"
    require(RING_ANGLE not in axes, f"{round_the_ring}, not over the axis {RING_ANGLE}; pass fem.over_pitches(ste)")
    parallelism = [name for name in axes if name.startswith("f_sigma")]
    chosen = ", ".join(f"{name}={data[name].values[0]:g}" for name in parallelism)
    remedy = f"map `misalignment`, their sum in the plane of action, or select one value of each: ste.sel({chosen})"
    require(not parallelism, f"a force law takes no axes {parallelism}; {remedy}")
    return {name: data[name].values for name in LAW_OFFSETS if name in axes and data[name].size > 1}


def over_offsets(data: xr.Dataset, name: str) -> xr.DataArray:
    """A variable of a map over (torque, a, misalignment, axial, phase), axes of one value dropped.

    Raises ValueError where the phases leave a gap in the mesh cycle, or end before the teeth repeat.
    """
    check_period(check_whole_cycle(data))
    return (
        data[name]
        .squeeze([d for d in data[name].dims if d in LAW_OFFSETS and data[d].size == 1])
        .transpose(TORQUE, *offset_axes(data), PHASE)
    )


def at_phases(phase: np.ndarray, values: np.ndarray, queries: np.ndarray, pitches: int = 1) -> np.ndarray:
    """(..., n_query) values at phases between those of values (..., n_phase), by a periodic cubic spline."""
    return np.moveaxis(periodic_spline(phase, np.moveaxis(values, -1, 0), pitches)(queries), 0, -1)


def periodic_spline(phase: np.ndarray, values: np.ndarray, period: float = 1.0) -> Any:
    """scipy's periodic CubicSpline through values (n, ...) at phases (n,) in pitches, or angles, of a period."""
    closed = np.concatenate([values, values[:1]])
    return scipy.interpolate.CubicSpline(np.append(phase, phase[0] + period), closed, bc_type="periodic")


def pair_attributes(pair: GearPair) -> dict[str, float | str]:
    """All inputs of a pair as flat numbers and JSON; `pair_of` reads them back."""
    attributes: dict[str, float | str] = {"a": pair.a}
    for name, gear in (("pinion", pair.pinion), ("wheel", pair.wheel)):
        attributes |= {f"{name}_{size}": getattr(gear, size) for size in SIZES if getattr(gear, size) is not None}
        attributes |= {f"{name}_cutter_{size}": value for size, value in _cutter_sizes(gear).items()}
        attributes[f"{name}_flank"] = to_text(gear.flank)
        attributes |= {f"{name}_support": rim_support.to_text(gear.support)} if gear.support else {}
        attributes |= {f"{name}_{part.name}": getattr(gear.material, part.name) for part in fields(Material)}
    return attributes


def _cutter_sizes(gear: Gear) -> dict[str, float]:
    """The fields that are given of a gear's cutter."""
    sizes = {size: getattr(gear.cutter, size) for size in CUTTER} if gear.cutter is not None else {}
    return {size: value for size, value in sizes.items() if value is not None}


def _gear(attributes, name: str) -> Gear:
    material = Material(**{part.name: float(attributes[f"{name}_{part.name}"]) for part in fields(Material)})
    clamped = "d_rim" if float(attributes[f"{name}_z"]) < 0 else "d_bore"
    stored = [size for size in SIZES if size not in OPTIONAL or size == clamped or f"{name}_{size}" in attributes]
    sizes = {size: float(attributes[f"{name}_{size}"]) for size in stored}
    cut = {size: float(attributes[key]) for size in CUTTER if (key := f"{name}_cutter_{size}") in attributes}
    flank, cutter = from_text(attributes[f"{name}_flank"]), PinionCutter(**cut) if cut else None  # type: ignore[arg-type]
    support = rim_support.from_text(attributes.get(f"{name}_support", "[]"))
    return Gear(material=material, flank=flank, cutter=cutter, support=support, **sizes)  # type: ignore[arg-type]


@checked
def pair_of(data: xr.Dataset) -> GearPair:
    """The gear pair of a map, from the inputs in its attributes; ValueError where these are missing."""
    try:
        return GearPair(_gear(data.attrs, "pinion"), _gear(data.attrs, "wheel"), a=float(data.attrs["a"]))
    except KeyError as missing:
        lacking = f"data must be an STE map, but this map's attributes lack the gear input {missing}"
        raise ValueError(f"{lacking}; make the map with fem.ste_map") from None
    except (TypeError, ValueError) as error:
        foreign = f"data must be an STE map, but this map's attributes are no gear pair: {error}"
        raise ValueError(f"{foreign}; make the map with fem.ste_map") from error


@checked
def save(data: xr.Dataset, path: FilePath) -> Path:
    """Write a map or a run as compressed netCDF; the file is complete or absent, even if the disk is full.

    It ends with a digest of its content, by which `load` tells damage. Other programs read it as any netCDF file.

    Raises OSError where the file cannot be written.
    """
    path = Path(path)
    write(data, path)
    return path


@checked
def load(path: FilePath) -> xr.Dataset:
    """Read and check an STE map that `save` or Dataset.to_netcdf wrote; ValueError for any other file."""
    data = read(path, "make the map again")
    is_map = TE in data and "time" not in data[TE].dims
    require(is_map, f"{path} holds {list(map(str, data))}, no STE map; read other data by xarray.open_dataset(path)")
    return check(data)
