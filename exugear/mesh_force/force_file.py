"""Files of force laws: all fields of an `exugear.MeshForce` and of its coast flank as labelled netCDF."""

from dataclasses import fields as dataclass_fields
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from exugear.mesh_force.layout import OFFSETS
from fem.support.netcdf import read, write
from fem.support.validation import require

TITLE = "force law of a gear mesh"
#: Units of the numbers of a law, and of its offsets; the last dimension of its tables; what stands before the names of
#: a coast flank's variables.
NUMBERS = {"damping": "N s/m", "damping_ramp": "m", "backlash": "m", "back_phase": "1", "mapped_force": "N"}
#: Attribute with the number of pitches of a law over several.
PITCHES = "pitches"
OFFSET_UNITS = dict(zip(OFFSETS, ("m", "rad", "m"), strict=True))
STEP, COAST = "deflection_step", "coast_"
#: What stands before the names of the tooth pairs of a law over a long period, and of the law of a single one.
TEETH, SINGLE = "teeth_", "single_"


def save_force(force, path: Path) -> Path:
    """Write a `MeshForce`; OSError where the file cannot be written."""
    write(_dataset(force), path)
    return path


def load_arguments(path) -> dict[str, Any]:
    """Arguments of the `MeshForce` in a file, with those of its coast flank, or None, as `coast`."""
    data = read(path, "write it again with MeshForce.save")
    is_law = data.attrs.get("title") == TITLE and "force_table" in data
    require(
        is_law,
        f"{path} holds {list(map(str, data))}, no force law; for an STE map take MeshForce.from_ste(fem.load(path))",
    )
    coast = _arguments(data, COAST) if f"{COAST}force_table" in data else None
    return _arguments(data) | {"coast": coast}


def _dataset(force, prefix: str = "") -> xr.Dataset:
    """All fields of a law as variables whose names begin with a prefix."""
    axes = {name: (values, OFFSET_UNITS[name]) for name, values in force.offsets.items()} | {
        "phase": (force.phase, "1")
    }
    over = tuple(f"{prefix}{name}" for name in (*axes, STEP))
    tables = {"deflection": "m", "force_table": "N", "centroid": "m"}
    variables: dict[str, Any] = {}
    for name, units in tables.items():
        values = np.asarray(getattr(force, name))
        table = np.broadcast_to(values, force.force_table.shape)
        variables[name] = ((), values) if values.ndim == 0 else (over, table), units
    variables |= {name: (((), getattr(force, name)), units) for name, units in NUMBERS.items()}
    variables |= {f"fixed_{name}": (((), x), OFFSET_UNITS[name]) for name, x in force.fixed_offsets.items()}
    data = xr.Dataset(
        {f"{prefix}{name}": (*value, {"units": units}) for name, (value, units) in variables.items()},
        {f"{prefix}{name}": (f"{prefix}{name}", x, {"units": units}) for name, (x, units) in axes.items()},
        {"title": TITLE, f"{prefix}conserves": int(force.conserves), f"{prefix}coast_unlike": force.coast_unlike}
        | ({PITCHES: force.pitches} if force.pitches > 1 else {}),
    )
    if force.teeth is not None:
        data = data.merge(_tooth_pairs(force.teeth, prefix), combine_attrs="no_conflicts")
    return data if force.coast is None else data.merge(_dataset(force.coast, COAST), combine_attrs="no_conflicts")


def _tooth_pairs(teeth, prefix: str) -> xr.Dataset:
    """All fields of tooth pairs, with the law of a single one."""
    fields = {
        part.name: np.asarray(getattr(teeth, part.name)) for part in dataclass_fields(teeth) if part.name != "single"
    }
    variables = {
        f"{prefix}{TEETH}{name}": ([f"{prefix}{TEETH}{name}_{i}" for i in range(values.ndim)], values)
        for name, values in fields.items()
    }
    single = _dataset(teeth.single, f"{prefix}{SINGLE}")
    attributes = {name: value for name, value in single.attrs.items() if name.startswith(f"{prefix}{SINGLE}")}
    attributes[f"{prefix}{SINGLE}{PITCHES}"] = teeth.single.pitches
    single.attrs = attributes
    return xr.Dataset(variables).merge(single, combine_attrs="no_conflicts")


def _teeth_arguments(data: xr.Dataset, prefix: str) -> dict[str, Any] | None:
    """Arguments of the tooth pairs in a file, with those of the law of a single one; None for a law without."""
    begins = f"{prefix}{TEETH}"
    values = {
        str(name).removeprefix(begins): x.values for name, x in data.data_vars.items() if str(name).startswith(begins)
    }
    if not values:
        return None
    numbers = {name: x if x.ndim else float(x) for name, x in values.items()}
    single = _arguments(data, f"{prefix}{SINGLE}") | {"pitches": int(data.attrs[f"{prefix}{SINGLE}{PITCHES}"])}
    return numbers | {"single": {name: value for name, value in single.items() if name != "teeth"}}


def _arguments(data: xr.Dataset, prefix: str = "") -> dict[str, Any]:
    """Arguments of a law from the variables whose names begin with a prefix."""
    arrays = {name: data[f"{prefix}{name}"].values for name in ("phase", "deflection", "force_table", "centroid")}
    return {
        **arrays,
        **{name: float(data[f"{prefix}{name}"]) for name in NUMBERS},
        "pitches": int(data.attrs.get(PITCHES, 1)),
        "offsets": {name: data[f"{prefix}{name}"].values for name in OFFSETS if f"{prefix}{name}" in data.dims},
        "fixed_offsets": {n: float(data[f"{prefix}fixed_{n}"]) for n in OFFSETS if f"{prefix}fixed_{n}" in data},
        "conserves": bool(data.attrs[f"{prefix}conserves"]),
        "coast_unlike": str(data.attrs[f"{prefix}coast_unlike"]),
        "teeth": _teeth_arguments(data, prefix),
    }
