"""Results of a run in sentences, tables and figures, and the vibration modes of its gearbox under the load."""

from collections.abc import Callable
from math import pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.load_factors.dynamic_factor import MISSING, UNLOADED, dynamic_factor, is_loaded
from exugear.modal.campbell import campbell
from exugear.modal.modes import modes
from exugear.multibody.model import Model
from exugear.plots.figures import figure
from exugear.plots.load_plots import plot_dynamic_factor
from exugear.plots.mode_plots import plot_campbell
from exugear.plots.order_plots import plot_mesh_order_map
from exugear.plots.power_plots import plot_power
from exugear.plots.run_plots import plot_bearing_forces, plot_run_up
from exugear.reporting.document import Figure, Section, Table, embedded
from exugear.running.energy_balance import energy_balance
from exugear.signals.envelope import dte_envelope
from exugear.signals.resonances import resonances, separated_order_cut
from exugear.signals.signal import signal
from fem.support.validation import require
from fem.units import rpm, um

#: Least change of the speed over its largest value, and least number of mesh cycles, by which a run is a sweep, whose
#: envelope shows resonances.
SWEEP, CYCLES = 0.05, 10
#: Difference of the DTE of two meshes, over its size, up to which one of them is drawn.
ALIKE = 1e-3
#: Columns of a table of resonances.
NUMBERS = "mesh_frequency", "amplitude", "harmonic", "harmonic_amplitude", "response_frequency"
#: Number of mesh harmonics listed.
HARMONICS = 5
#: Words for an amplitude that an order cut cannot tell.
UNTOLD = "cannot be told: the speed changes too fast"
#: Least amplification for a crossing to be listed, and the largest number of rows.
LEAST_AMPLIFICATION, MOST_ROWS = 0.2, 24


def results(data: xr.Dataset) -> Section:
    """What a run shows: of a sweep with its resonances."""
    if not is_sweep(data):
        tables, figures = [extremes(data), balance(data)], [_power(data)] if "mesh_loss" in data else []
        return Section("Results", summary(data), tuple(table for table in tables if table.rows), tuple(figures))
    stages = data["stage"].values.tolist()
    of_stages = {stage: resonances(data, number) for number, stage in enumerate(stages)}
    tables = [resonances_as_text(data, stage, table) for stage, table in of_stages.items()]
    tables += [harmonics_as_text(data, number) for number in range(len(stages))]
    tables += [factor_table(data), extremes(data), balance(data)]
    figures = sweep_figures(data, of_stages)
    return Section("Results", summary(data), tuple(table for table in tables if table.rows), tuple(figures))


def sweep_figures(data: xr.Dataset, of_stages: dict[str, xr.Dataset]) -> list[Figure]:
    """DTE with its resonances by stage, order maps, dynamic factors, bearing forces and losses of a sweep."""
    figures, stages = [], list(of_stages)
    for stage, alike in _alike(data).items():
        number, peaks = stages.index(stage), of_stages[stage]
        stage = f"{stage} (× {alike}, of equal planets)" if alike > 1 else stage
        text = "its envelope in windows of whole mesh cycles, resonances marked"
        caption = f"Dynamic transmission error of {stage} over its mesh frequency: {text}."
        figures.append(drawn(plot_run_up, caption, data, stage=number, resonances=peaks))
        caption = f"Order map of the DTE of {stage}: amplitude over speed and mesh order."
        figures.append(drawn(plot_mesh_order_map, caption, data, stage=number))
    if is_loaded(data):
        caption = "Dynamic factor of each stage: largest over mean mesh force in windows of the run."
        figures.append(drawn(plot_dynamic_factor, caption, dynamic_factor(data)))
    if "bearing_force" in data:
        caption = "Varying part of the radial bearing forces over the speed of the driving shaft."
        figures.append(drawn(plot_bearing_forces, caption, data))
    if "mesh_loss" in data:
        figures.append(_power(data))
    return figures


def _alike(data: xr.Dataset) -> dict[str, int]:
    """The first of the meshes of a set with one member whose DTE is as large, and how many these are, by its name."""
    alike: dict[tuple, list[str]] = {}
    for stage in data["stage"].values.tolist():
        dte, carrier = data["dte"].sel(stage=stage), data.attrs.get(f"{stage}_carrier", "")
        sizes = np.array([dte.std(), dte.min(), dte.max()])
        member = str(data["member"].sel(stage=stage).item()) if carrier and "member" in data.coords else stage
        equal = (
            key for key in alike if key[:2] == (carrier, member) and np.allclose(key[2:], sizes, rtol=ALIKE, atol=0)
        )
        alike.setdefault(next(equal, (carrier, member, *sizes)), []).append(stage)
    return {first: 1 + len(others) for first, *others in alike.values()}


def _power(data: xr.Dataset) -> Figure:
    return drawn(plot_power, "Power that dampers, friction and drag dissipate.", data)


def drawn(plot: Callable, caption: str, data: Any, **options) -> Figure:
    """A plot of data across the whole width of the page."""
    drawing = figure()
    drawing.set_size_inches(8.0, 4.0)
    plot(data, drawing.axes[0], **options)
    return embedded(drawing, caption)


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
    at = f", at a mesh frequency of {outline.abscissa[outline.amplitude.argmax()]:.0f} Hz" if is_sweep(data) else ""
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
            speed_and_frequency = f"{float(peak['speed']) / rpm:.0f}", f"{frequency:.1f}"
            share = float(cut.notnull().mean())
            known = "" if share == 1 else f" (can be told in {share:.0%} of the points)"
            rows.append((str(harmonic), _digits(float(peak) / um) + known, *speed_and_frequency))
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
            speed_and_frequency = f"{float(peak['speed']) / rpm:.0f}", f"{float(peak['mesh_frequency']):.0f}"
            rows.append((str(stage), f"{float(peak['K_v']):.3f}", *speed_and_frequency, rounded(peak["static_force"])))
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


def vibration(model: Model, data: xr.Dataset) -> Section:
    """Modes of the gearbox at the load of a run, and the speeds at which orders excite them."""
    loads, stages = _loads(model, data), data["stage"].values.tolist()
    labels = list(model.gearbox.labels)
    require(labels == stages, f"model has the stages {labels}, the run {stages}; pass the model of the run")
    at_rest = modes(model, **loads)
    state = "Meshes have their mean tangent stiffness at the load, bearings theirs; the driving shaft is held."
    if at_rest.attrs["idle_stages"]:
        state += f" Stages {', '.join(at_rest.attrs['idle_stages'])} carry no load: their teeth are open."
    top = float(np.abs(data["speed"]).max())
    if top == 0:
        return Section("Vibration modes", (state,), (_modes(at_rest),))
    diagram = campbell(model, speed=(0.0, top), **loads)
    text = (
        state,
        "Amplification is the DTE of a stage in the mode over its STE of the order: share of the strain energy in the "
        f"mesh over twice the damping ratio. Crossings from {LEAST_AMPLIFICATION:g} on are listed.",
    )
    tables = [table for table in (_modes(at_rest), _crossings(diagram)) if table.rows]
    caption = (
        "Natural frequencies over the speed of the driving shaft, mesh and shaft orders; "
        "circles mark crossings with strain energy in the mesh of the order."
    )
    return Section("Vibration modes", text, tuple(tables), (drawn(plot_campbell, caption, diagram),))


def _loads(model: Model, data: xr.Dataset) -> dict[str, Any]:
    """Constant load on the driven shaft, or loads of several shafts [N m], as arguments; ValueError without them."""
    given = data.attrs.get("load", "no load on the driven shaft alone")
    if not isinstance(given, str) and np.size(given) == 1:
        return {"load": float(given)}
    driven_alone = "drive_end" in data.dims and data["drive_end"].values.tolist() == [model.gearbox.driving.name]
    if driven_alone and "load_end" in data.dims:
        torque = data["load_torque"].transpose("load_end", "time").values
        if bool((np.ptp(torque, axis=1) == 0).all()) and torque.any():
            return {"loads": dict(zip(data["load_end"].values.tolist(), torque[:, 0].tolist(), strict=True))}
    remedy = "leave out model, and use exugear.modes at loads of your choice"
    raise ValueError(f"run must have a constant load for its vibration modes, got {given}; {remedy}")


def _modes(at_rest: xr.Dataset) -> Table:
    rows = []
    for number in range(min(at_rest.sizes["mode"], MOST_ROWS)):
        mode = at_rest.isel(mode=number)
        share = mode["energy_share"]
        strained = f"{share.idxmax('element').item()} ({float(share.max()):.0%})"
        numbers = f"{float(mode['frequency']):.1f}", f"{float(mode['damping_ratio']):.4f}"
        kind = [str(mode["kind"].item())] if "kind" in mode else []
        strained = strained if float(share.max()) > 0 else "none: rigid-body motion"
        rows.append((str(number + 1), *numbers, *kind, strained))
    of_sets = ["kind"] if "kind" in at_rest else []
    columns = ("mode", "frequency [Hz]", "damping ratio", *of_sets, "most of the strain energy in")
    return Table("Natural frequencies at rest under the load", columns, tuple(rows))


def _crossings(diagram: xr.Dataset) -> Table:
    """Crossings of mesh orders with the largest amplifications, by rising speed."""
    gain = _amplifications(diagram)
    listed = np.sort(np.argsort(-gain, kind="stable")[:MOST_ROWS])
    rows = []
    for number in listed[gain[listed] >= LEAST_AMPLIFICATION]:
        crossing = diagram.isel(crossing=int(number))
        numbers = f"{float(crossing['crossing_speed']) / rpm:.0f}", f"{float(crossing['crossing_frequency']):.1f}"
        order, mode = str(crossing["crossing_order"].item()), str(crossing["crossing_mode"].item())
        share = f"{float(crossing['crossing_energy_share']):.0%}"
        rows.append((*numbers, order, mode, share, f"{gain[number]:.2f}" if np.isfinite(gain[number]) else "undamped"))
    of_crossing = "driving shaft [rpm]", "frequency [Hz]", "order", "mode"
    columns = (*of_crossing, "strain energy in the mesh", "amplification")
    return Table("Crossings of mesh orders and modes", columns, tuple(rows))


def _amplifications(diagram: xr.Dataset) -> np.ndarray:
    """(n_crossing,) amplification at every crossing, 0 of shaft orders."""
    modes_met = xr.DataArray(diagram["crossing_mode"].values, dims="crossing")
    speeds_met = xr.DataArray(diagram["crossing_speed"].values, dims="crossing")
    damping = diagram["damping_ratio"].sel(mode=modes_met).sel(speed=speeds_met, method="nearest")
    of_mesh = diagram["order_stage"].sel(order=diagram["crossing_order"]).values != ""
    share = np.where(of_mesh, np.maximum(diagram["crossing_energy_share"].values, 0.0), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(share / (2 * damping.values), posinf=np.inf)
