"""Results of a run in sentences and tables: summary, resonances of each stage, range of the signals."""

from math import pi

import numpy as np
import xarray as xr

from exugear.load_factors.dynamic_factor import MISSING, UNLOADED, dynamic_factor, is_loaded
from exugear.reporting.sections import Table
from exugear.running.energy_balance import energy_balance
from exugear.signals.resonance_table import separated_order_cut
from exugear.signals.resonances import Resonances
from exugear.signals.run_envelopes import dte_envelope
from exugear.signals.signal import signal
from fem.units import rpm, um

#: Least change of the speed over its largest value, and least number of mesh cycles, by which a run is a sweep, whose
#: envelope shows resonances.
SWEEP, CYCLES = 0.05, 10
#: Columns of a table of resonances.
NUMBERS = "mesh_frequency", "amplitude", "harmonic", "harmonic_amplitude", "response_frequency"
#: Number of mesh harmonics listed.
HARMONICS = 5
#: Words for an amplitude that an order cut cannot tell.
UNTOLD = "cannot be told: the speed changes too fast"


def is_sweep(data: xr.Dataset) -> bool:
    """Whether the speed changes so much that an envelope over it shows resonances."""
    speed = np.abs(data["speed"].values)
    cycles = np.trapezoid(np.abs(data["mesh_frequency"].transpose("stage", "time").values), data["time"].values)
    return bool(np.ptp(speed) > SWEEP * speed.max() and cycles.min() >= CYCLES)


def summary(data: xr.Dataset) -> tuple[str, ...]:
    """What happened in each stage, a sentence per fact."""
    items = []
    for number, stage in enumerate(data["stage"].values.tolist()):
        items += [_largest_vibration(data, number, stage), _contact(data, number, stage)]
    return tuple(items)


def _largest_vibration(data: xr.Dataset, number: int, stage: str) -> str:
    outline = dte_envelope(data, number)
    amplitude = f"half the peak-to-peak value of the DTE is at most {_digits(outline.amplitude.max() / um)} µm"
    at = f", at a mesh frequency of {outline.place[outline.amplitude.argmax()]:.0f} Hz" if is_sweep(data) else ""
    return f"{stage}: {amplitude}{at}."


def _digits(value: float) -> str:
    """Three significant digits, zeros at the end among them; words for NaN."""
    return f"{value:#.3g}".rstrip(".") if np.isfinite(value) else UNTOLD


def _contact(data: xr.Dataset, number: int, stage: str) -> str:
    """Whether teeth part or touch with their coast flanks, by the samples."""
    force = data["mesh_force"].isel(stage=number).values
    extreme, mean = force[np.abs(force).argmax()], force.mean()
    vanishes = abs(mean) <= UNLOADED * abs(extreme) or mean * extreme < 0
    ratio = f"while its mean over the run is {rounded(mean)} N" if vanishes else f"{extreme / mean:.3g} times its mean"
    largest = f"the mesh force reaches {rounded(extreme)} N, {ratio}"
    apart, coast = float((force == 0).mean()), float((force < 0).mean())
    if not apart and not coast:
        return f"{stage}: {largest}; the teeth never part."
    lost = f"the teeth are apart in {apart:.2%} of the samples and touch with their coast flanks in {coast:.2%}"
    return f"{stage}: {largest}; {lost}."


def marked(table: xr.Dataset) -> Resonances:
    """The resonances of a table as marks in a plot."""
    return Resonances(table["mesh_frequency"].values, table["amplitude"].values)


def resonances_as_text(data: xr.Dataset, stage: str, table: xr.Dataset) -> Table:
    """Resonances of a stage with the mesh harmonic that excites each of them."""
    number = data["stage"].values.tolist().index(stage)
    frequency = data["mesh_frequency"].isel(stage=number).values
    speed_per_frequency = np.abs(data["speed"].values).max() / frequency.max()
    rows = []
    for peak in range(table.sizes["peak"]):
        f, height, harmonic, amplitude, response = (float(table[name][peak]) for name in NUMBERS)
        exciting = str(table["exciting_stage"][peak].item())
        speed = f * speed_per_frequency / rpm
        heights = _digits(height / um), f"{harmonic:.0f} of {exciting}", _digits(amplitude / um)
        rows.append((f"{f:.1f}", f"{speed:.0f}", *heights, f"{response:.1f}"))
    columns = ("mesh frequency [Hz]", "driving shaft [rpm]", "half peak to peak [µm]")
    exciting_columns = ("excited by mesh harmonic", "its amplitude [µm]", "vibrates at [Hz]")
    return Table(f"Resonances of {stage} in the DTE", (*columns, *exciting_columns), tuple(rows))


def harmonics_as_text(data: xr.Dataset, number: int) -> Table:
    """Largest amplitude of each mesh harmonic in the DTE of a stage along a run, and the speed at which it occurs."""
    dte = signal(data, "dte", stage=number)
    amplitude = separated_order_cut(data, number, harmonics=HARMONICS)["amplitude"]
    rows = []
    for harmonic, cut in enumerate(amplitude.transpose("order", ...), start=1):
        if bool(cut.notnull().any()):
            peak = cut.isel(time=cut.argmax(...)["time"])
            frequency = abs(float(peak["speed"])) * float(dte["mesh_order"]) / (2 * pi)
            places = f"{float(peak['speed']) / rpm:.0f}", f"{frequency:.1f}"
            share = float(cut.notnull().mean())
            known = "" if share == 1 else f" (can be told in {share:.0%} of the points)"
            rows.append((str(harmonic), _digits(float(peak) / um) + known, *places))
        else:
            rows.append((str(harmonic), UNTOLD, "", ""))
    columns = ("mesh harmonic", "largest amplitude [µm]", "driving shaft [rpm]", "mesh frequency [Hz]")
    return Table(f"Mesh harmonics of {data['stage'].values[number]} in the DTE", columns, tuple(rows))


def factor_table(data: xr.Dataset) -> Table:
    """Largest dynamic factor of each stage, and where it occurs."""
    rows = []
    columns = ("stage", "largest K_v", "driving shaft [rpm]", "mesh frequency [Hz]", "static mesh force [N]")
    if not is_loaded(data):
        return Table("Dynamic factors", columns, ())
    for stage, column in dynamic_factor(data).groupby("stage"):
        factor = column.squeeze("stage")
        known = factor["K_v"].notnull()
        if known.any():
            peak = factor.isel(speed=factor["K_v"].argmax(...)["speed"])
            places = f"{float(peak['speed']) / rpm:.0f}", f"{float(peak['mesh_frequency']):.0f}"
            rows.append((str(stage), f"{float(peak['K_v']):.3f}", *places, rounded(peak["static_force"])))
        if not known.all():
            rows.append(
                (str(stage), f"cannot be told in {float((~known).mean()):.0%} of the run: {MISSING}", "", "", "")
            )
    return Table("Dynamic factors", columns, tuple(rows))


def balance(data: xr.Dataset) -> Table:
    """Energies of a run whose powers are recorded, else no rows."""
    columns = ("energy over the run", "[J]")
    if "kinetic_energy" not in data:
        return Table("Energy balance", columns, ())
    energies = energy_balance(data)
    rows = {"work of the drives": energies.work_in, "work on the loads": energies.work_out}
    rows |= {name.replace("_", " "): loss for name, loss in energies.losses.items()}
    rows |= {"increase of stored energy": energies.stored, "residual": energies.residual}
    return Table("Energy balance", columns, tuple((name, rounded(value, 6)) for name, value in rows.items()))


def extremes(data: xr.Dataset) -> Table:
    """Smallest, mean and largest values of what each stage and bearing has recorded."""
    rows = []
    for name, factor, unit in (("dte", um, "µm"), ("mesh_force", 1.0, "N")):
        for stage, values in data[name].groupby("stage"):
            rows.append((f"{data[name].attrs['long_name']}, {stage}", unit, *_range(values / factor)))
    if "bearing_force" in data:
        squares = data["bearing_force"].sel(direction=["x", "y"]) ** 2
        radial = squares.sum("direction") ** 0.5
        for bearing, values in radial.groupby("bearing"):
            rows.append((f"radial force of the bearing {bearing}", "N", *_range(values)))
    return Table("Range of the signals", ("signal", "unit", "smallest", "mean", "largest"), tuple(rows))


def _range(values: xr.DataArray) -> tuple[str, str, str]:
    return rounded(values.min()), rounded(values.mean()), rounded(values.max())


def rounded(value, digits: int = 4) -> str:
    """A number of some significant digits, up to 1e9 without an exponent."""
    return f"{float(f'{float(value):.{digits}g}'):.10g}"
