"""What a designer of flanks looks at: measures of a pair under load cases and offsets, by names."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import fields, replace
from itertools import product
from typing import Annotated, Any

import numpy as np
import xarray as xr

from fem.contact.resolution import Resolution, Slices
from fem.elasticity.mesh_density import Density
from fem.pair.offsets import Offsets, check_offsets
from fem.pair.pair import GearPair
from fem.ste.inputs import phases_of_measures
from fem.ste.ste_map import PHASE, TORQUE
from fem.ste.te_measures import peak_to_peak, te_harmonics
from fem.ste.transmission import static_transmission_error
from fem.stress.load_factors import load_factors
from fem.stress.root_stress import ROOT, root_stress
from fem.support.arguments import Numbers, checked
from fem.support.progress import shown
from fem.support.validation import require, text_of

__all__ = ["flank_measures"]

#: Measures from the map: their units and what they are.
OF_MAP = {
    "peak_to_peak": ("m", "peak to peak of the transmission error"),
    "mean": ("m", "mean transmission error"),
    "harmonics": ("m", "amplitude of the mesh harmonics of the transmission error"),
    "hertz_pressure": ("Pa", "largest pressure by Hertz over the mesh cycle"),
    "peak_pressure": ("Pa", "largest contact pressure over the mesh cycle, edges included"),
    "line_load": ("N/m", "largest line load over the mesh cycle"),
    "tip_contact": ("1", "largest share of the load at a tip edge"),
    "contact_ratio": ("1", "contact ratio under load"),
}
#: Measures that need contacts resolved along the profile.
OF_LOADS = {
    "K_H_beta": ("1", "face load factor"),
    "K_H_alpha": ("1", "transverse load factor"),
    "root_stress": ("Pa", "largest tensile stress in the roots over the mesh cycle"),
}
MEASURES = OF_MAP | OF_LOADS


def check_measures(name: str, value: Any) -> None:
    """ValueError unless the value holds different names of measures."""
    listed = isinstance(value, tuple | list) and len(value) > 0 and all(isinstance(x, str) for x in value)
    known = listed and set(value) <= MEASURES.keys() and len(set(value)) == len(value)
    require(known, f"{name} must hold different names among {', '.join(MEASURES)}, got {text_of(value)}")


@checked
def flank_measures(
    pair: GearPair,
    torque: Numbers,
    measures: Annotated[Sequence[str], check_measures] = ("peak_to_peak",),
    phases: Numbers = 30,
    *,
    offsets: Annotated[Offsets, check_offsets] | None = None,
    harmonics: int = 5,
    resolution: Resolution | Slices | None = None,
    root_density: Density = ROOT,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Measures of the flanks of a pair over (torque, *offsets): what sweeps and optimal flanks compare.

    torque          pinion torques > 0 [N m], increasing
    measures        names: "peak_to_peak", "mean", "harmonics" of the transmission error (over `harmonic` too),
                    "hertz_pressure", "peak_pressure", "line_load", "tip_contact": the largest over the mesh cycle,
                    "contact_ratio", "K_H_beta", "K_H_alpha", "root_stress" (over `gear` too)
    phases, offsets, resolution   as for `fem.static_transmission_error`; load factors and root stress resolve the
                    contact along the profile, also where the resolution is `fem.Slices`, which "peak_pressure" refuses
    harmonics       number of mesh harmonics
    root_density    of the solids for the root stress

    Flanks, deviations and offsets change gaps alone. The compliances of both gears are solved once and remembered, as
    are the solids of the root stress: a further call with other flanks costs only contacts, 0.3 to 1.5 ms a state. Gear
    data, and axial offsets of gears of unequal width, change the compliance.

    Raises ValueError for bad input, RuntimeError where a contact does not converge. Warns where teeth differ and phases
    do not reach over all their pitches.
    """
    largest = np.atleast_1d(np.asarray(torque, float))
    require(bool(largest.size and largest[0] > 0), f"torque must be > 0 N m, a load case each, got {torque}")
    edges = "resolution must be a fem.Resolution for peak_pressure, fem.Slices have no edges; take hertz_pressure"
    require("peak_pressure" not in measures or not isinstance(resolution, Slices), edges)
    phases = phases_of_measures(phases, pair)
    options: dict[str, Any] = {"executor": executor, "progress": progress}
    ste = static_transmission_error(pair, torque, phases, offsets=offsets, resolution=resolution, **options)
    data = {name: _of_map(ste, name, harmonics) for name in measures if name in OF_MAP}
    resolved = resolution if isinstance(resolution, Resolution) else Resolution.like(resolution or Resolution())
    further = [name for name in measures if name in OF_LOADS]
    options |= {"resolution": resolved}
    with shown(progress):
        for name in further:
            data[name] = _over_offsets(
                offsets or Offsets(), _OF_LOADS[name](pair, torque, phases, root_density, options)
            )
    for name, values in data.items():
        unit, about = MEASURES[name]
        data[name] = values.assign_attrs(units=unit, long_name=about)
    axes = {name: values for name, values in ste.coords.items() if name not in (PHASE, "pair")}
    return xr.Dataset(data).assign_coords(axes).assign_attrs(ste.attrs)[list(measures)]


def _of_map(ste: xr.Dataset, name: str, harmonics: int) -> xr.DataArray:
    """A measure of a map over (torque, *offsets)."""
    if name == "peak_to_peak":
        return peak_to_peak(ste)[name]
    if name == "harmonics":
        return te_harmonics(ste, harmonics)["amplitude"]
    if name == "mean":
        return ste["te"].mean(PHASE)
    return ste[name] if name == "contact_ratio" else ste[name].max(PHASE)


def _root_stress(pair: GearPair, torque, phases, density: Density, options: dict[str, Any]) -> Callable:
    return lambda offsets: root_stress(pair, torque, phases, offsets=offsets, density=density, **options)[
        "root_stress"
    ].max(PHASE)


def _load_factor(name: str) -> Callable:
    def of(pair: GearPair, torque, phases, density: Density, options: dict[str, Any]) -> Callable:
        return lambda offsets: load_factors(pair, torque, phases, offsets=offsets, **options)[name]

    return of


_OF_LOADS = {"K_H_beta": _load_factor("K_H_beta"), "K_H_alpha": _load_factor("K_H_alpha"), "root_stress": _root_stress}


def _over_offsets(offsets: Offsets, measure: Callable[[Offsets], xr.DataArray]) -> xr.DataArray:
    """A measure at offsets with one value each, over the axes of offsets with several."""
    axes = {part.name: getattr(offsets, part.name) for part in fields(offsets) if part.name in offsets.axes()}
    if not axes:
        return measure(offsets)
    single = [measure(replace(offsets, **dict(zip(axes, at, strict=True)))) for at in product(*axes.values())]
    shape = [len(values) for values in axes.values()]
    stack = np.stack([values.values for values in single]).reshape(*shape, *single[0].shape)
    dims = (*axes, *single[0].dims)
    along = [name for name in single[0].dims if name != TORQUE]
    coordinates: dict[Any, Any] = {**{name: list(values) for name, values in axes.items()}, **single[0].coords}
    return xr.DataArray(stack, coordinates, dims).transpose(TORQUE, *axes, *along)
