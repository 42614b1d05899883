"""The STE map as data: names of its axes, checks, load and save."""

from dataclasses import fields
from io import BytesIO
from pathlib import Path

import numpy as np
import scipy
import xarray as xr

from fem.gear.gear import Gear
from fem.gear.material import Material
from fem.microgeometry.flank import alike, from_text, to_text
from fem.pair.pair import GearPair
from fem.support.arguments import FilePath, Numbers, checked
from fem.support.cache import whole
from fem.support.validation import increasing, numbers, require, text_of

SIZES = [f.name for f in fields(Gear) if f.name not in ("material", "flank")]
#: Of these a gear has one.
ROOTS = ("rho_f", "fillet")
TORQUE, PHASE, TE, CENTROID, STIFFNESS = "torque", "phase", "te", "centroid", "stiffness"
OFFSETS = {
    "a": ("m", "working centre distance"),
    "axial": ("m", "axial place of the wheel"),
    "misalignment": ("rad", "misalignment in the plane of action"),
    "f_sigma_delta": ("rad", "parallelism error in the plane of the axes"),
    "f_sigma_beta": ("rad", "parallelism error across the plane of the axes"),
}
AXES = {TORQUE: ("N m", "pinion torque"), **OFFSETS, PHASE: ("1", "phase of the mesh cycle")}
#: Offsets that a force law follows, in this order.
LAW_OFFSETS = ("a", "misalignment", "axial")


@checked
def ste_map(
    pair: GearPair, torque: Numbers, phase: Numbers, te: Numbers, offsets: dict | None = None, **attributes
) -> xr.Dataset:
    """Dataset with te [m] over torque [N m], offsets and phase [1]; pair and further inputs stand in the attributes.

    torque      (n_torque,) pinion torque F r_b1 of the mesh force F, increasing from 0 (unloaded transmission error)
    phase       (n_phase,) position in the mesh cycle as share of a pitch, in [0, 1); 0: pair 0 at the pitch point
    te          (n_torque, *n_offset, n_phase) transmission error on the line of action, > 0: the pinion leads
    offsets     axes between torque and phase: their names (see OFFSETS) and increasing values
    """
    axes = {TORQUE: torque, **(offsets or {}), PHASE: phase}
    values, grid = {name: numbers(name, at) for name, at in axes.items()}, tuple(axes)
    for name, at in values.items():
        axis = f"{name} of the offsets" if name in OFFSETS else name
        require(at.ndim == 1, f"{axis} must be increasing values (n,), got {text_of(axes[name])}")
    te, shape = numbers(TE, te), tuple(at.size for at in values.values())
    require(te.shape == shape, f"te must have the shape {shape} over {grid}, got {te.shape}")
    data = xr.Dataset(
        {TE: (grid, te, {"units": "m", "long_name": "static transmission error"})},
        coords={name: (name, at, _described(name)) for name, at in values.items()},
        attrs={"title": "static transmission error map", **pair_attributes(pair), **attributes},
    )
    check(data)
    return data


def check(data: xr.Dataset) -> xr.Dataset:
    """The same dataset, after checking that it is a usable STE map.

    Raises ValueError for missing names, NaN, axes that do not increase, phases outside [0, 1).
    """
    missing = [name for name in (TE, TORQUE, PHASE) if name not in data.variables]
    require(not missing, f"an STE map has the variables te, torque and phase; missing: {missing}")
    _check_kinds(data)
    te = data[TE].values
    unknown = set(data[TE].dims) - {TORQUE, PHASE, *OFFSETS}
    require(not unknown, f"te may have the axes torque, phase and {list(OFFSETS)}; select one value of {unknown}")
    torque, phase = (increasing(name, data[name].values) for name in (TORQUE, PHASE))
    require(bool(np.isfinite(te).all()), "te must be finite everywhere; solve the missing states or drop their torque")
    require(bool(torque[0] >= 0), f"torque must increase from 0 or above, got {torque}")
    end = data.attrs.get("pitches", 1)
    within = f"phase must increase within [0, {end}) as share of a pitch, got {phase}"
    require(bool(phase[0] >= 0 and phase[-1] < end), within)
    return data


def _check_kinds(data: xr.Dataset) -> None:
    for name in (TE, TORQUE, PHASE):
        kind = f"{name} must hold real numbers, got {data[name].dtype} of shape {data[name].shape}"
        require(data[name].dtype.kind in "fiu" and data[name].size > 0, f"{kind}; make the map with fem.ste_map")
    axes = all(data[name].dims == (name,) and name in data[TE].dims for name in (TORQUE, PHASE))
    require(axes, f"te must have the axes torque and phase, got {data[TE].dims}; keep them: ste.sel(torque=[350.0])")


def _described(name: str) -> dict[str, str]:
    require(name in AXES, f"offsets may be {list(OFFSETS)}, got {name}")
    return dict(zip(("units", "long_name"), AXES[name], strict=True))


def _check_one_for_all(data: xr.Dataset) -> None:
    """ValueError unless the one pitch of the map stands for all."""
    pitches = data.attrs.get("pitches", 1)
    remedy = "average them or select one, as fem.ste_map of the pair without its PitchDeviation"
    require(pitches == 1, f"the map runs over {pitches} pitches, each of its own; {remedy}")
    pair = pair_of(data) if "pinion_flank" in data.attrs else None
    one = "the map is of one pitch, but no two are alike under the PitchDeviation of its flanks"
    either = "map the pair without it, or map all pitches and average them as fem.ste_map of that pair"
    require(pair is None or all(alike(gear.drive_flank) for gear in (pair.pinion, pair.wheel)), f"{one}; {either}")


def over_torque_and_phase(data: xr.Dataset) -> xr.DataArray:
    """Transmission error (torque, phase) of a map.

    ValueError where it has further axes, of which select one value each, or its one pitch does not stand for all.
    """
    _check_one_for_all(check(data))
    return over_torque_and_phases(data)


def over_torque_and_phases(data: xr.Dataset) -> xr.DataArray:
    """The same of a map that may run over several pitches."""
    te = check(data)[TE]
    further = [name for name in te.dims if name not in (TORQUE, PHASE)]
    chosen = ", ".join(f"{name}={data[name].values[0]:g}" for name in further)
    require(not further, f"the map also has the axes {further}; select one value of each: ste.sel({chosen})")
    return te.transpose(TORQUE, PHASE)


def offset_axes(data: xr.Dataset) -> dict[str, np.ndarray]:
    """The map's axes of centre distance [m], misalignment [rad], axial offset [m]; ValueError where it has others."""
    axes = [str(name) for name in data[TE].dims if name not in (TORQUE, PHASE)]
    parallelism = [name for name in axes if name.startswith("f_sigma")]
    chosen = ", ".join(f"{name}={data[name].values[0]:g}" for name in parallelism)
    remedy = f"map `misalignment`, their sum in the plane of action, or select one value of each: ste.sel({chosen})"
    require(not parallelism, f"a force law takes no axes {parallelism}; {remedy}")
    return {name: data[name].values for name in LAW_OFFSETS if name in axes and data[name].size > 1}


def over_offsets(data: xr.Dataset, name: str) -> xr.DataArray:
    """A variable of a map over (torque, a, misalignment, axial, phase), axes of one value dropped."""
    _check_one_for_all(data)
    return (
        data[name]
        .squeeze([d for d in data[name].dims if d in LAW_OFFSETS and data[d].size == 1])
        .transpose(TORQUE, *offset_axes(data), PHASE)
    )


def at_phases(phase: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values (..., n_at) between values (..., n_phase) over a mesh cycle, by a periodic cubic spline."""
    closed = np.concatenate([values, values[..., :1]], axis=-1)
    return scipy.interpolate.CubicSpline(np.append(phase, phase[0] + 1), closed, axis=-1, bc_type="periodic")(at)


def pair_attributes(pair: GearPair) -> dict[str, float | str]:
    """All inputs of a pair as flat numbers and JSON; `pair_of` reads them back."""
    attributes: dict[str, float | str] = {"a": pair.a}
    for name, gear in (("pinion", pair.pinion), ("wheel", pair.wheel)):
        attributes |= {f"{name}_{size}": getattr(gear, size) for size in SIZES if getattr(gear, size) is not None}
        attributes[f"{name}_flank"] = to_text(gear.flank)
        attributes |= {f"{name}_{f.name}": getattr(gear.material, f.name) for f in fields(Material)}
    return attributes


def _gear(attributes, name: str) -> Gear:
    material = Material(**{f.name: float(attributes[f"{name}_{f.name}"]) for f in fields(Material)})
    given = [size for size in SIZES if size not in ROOTS or f"{name}_{size}" in attributes]
    sizes = {size: float(attributes[f"{name}_{size}"]) for size in given}
    flank = from_text(attributes[f"{name}_flank"])
    return Gear(material=material, flank=flank, **sizes)  # type: ignore[arg-type]


@checked
def pair_of(data: xr.Dataset) -> GearPair:
    """The gear pair whose inputs stand in the map's attributes; ValueError where they are not there."""
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
    """Write compressed netCDF whole or not at all, from memory: HDF5 itself does not survive a full disk."""
    path, content = Path(path), BytesIO()
    packed = {name: {"zlib": True, "complevel": 1} for name, values in data.variables.items() if values.dtype == float}
    data.to_netcdf(content, engine="h5netcdf", encoding=packed)
    with whole(path) as file:
        file.write(content.getbuffer())
    return path


@checked
def load(path: FilePath) -> xr.Dataset:
    """Read and check an STE map that `save` or Dataset.to_netcdf wrote; ValueError for a file that is none."""
    return check(read(path, "make the map again"))


def read(path, remedy: str) -> xr.Dataset:
    """The data of a netCDF file, in memory; ValueError with a remedy for a file that is none."""
    try:
        with xr.open_dataset(path, engine="h5netcdf") as data:
            return data.load()
    except (FileNotFoundError, PermissionError):
        raise
    except Exception as error:
        raise ValueError(f"{path} is damaged or no netCDF file; {remedy} ({error})") from None
