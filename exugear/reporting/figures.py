"""Figures of a report: the plots of a run as SVG texts."""

from base64 import b64encode
from collections.abc import Mapping
from io import BytesIO

import xarray as xr
from matplotlib import rc_context
from matplotlib.figure import Figure as Drawing

from exugear.load_factors.dynamic_factor import dynamic_factor, is_loaded
from exugear.plots.figures import figure
from exugear.plots.load_plots import plot_dynamic_factor
from exugear.plots.mode_plots import plot_campbell
from exugear.plots.order_plots import plot_waterfall
from exugear.plots.power_plots import plot_power
from exugear.plots.run_plots import plot_bearing_forces, plot_run_up
from exugear.reporting.results import is_sweep, marked
from exugear.reporting.sections import Figure
from exugear.signals.resonances import Resonances

#: Resolution of the parts of a figure that are images [1/inch]: order maps.
RESOLUTION = 160


def run_figures(data: xr.Dataset, resonances: Mapping[str, xr.Dataset]) -> list[Figure]:
    """DTE with its resonances by stage, order maps, dynamic factors and bearing forces of a sweep; losses of a run."""
    figures = []
    if is_sweep(data):
        for number, stage in enumerate(data["stage"].values.tolist()):
            peaks = marked(resonances[stage])
            figures += [_run_up(data, number, stage, peaks), _orders(data, number, stage)]
        if is_loaded(data):
            figures.append(_factors(data))
        if "bearing_force" in data:
            figures.append(_bearings(data))
    if "mesh_loss" in data:
        figures.append(_power(data))
    return figures


def campbell_figure(diagram: xr.Dataset) -> Figure:
    """Campbell diagram of the loaded gearbox."""
    drawing = _wide()
    plot_campbell(diagram, drawing.axes[0])
    text = "circles mark crossings with strain energy in the mesh of the order"
    return embedded(drawing, f"Natural frequencies over the speed of the driving shaft, mesh and shaft orders; {text}.")


def embedded(drawing: Drawing, caption: str) -> Figure:
    """A drawing as the figure of a report; text stays text."""
    content = BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "exugear"}):
        drawing.savefig(content, format="svg", dpi=RESOLUTION, metadata={"Date": None})
    return Figure(caption, b64encode(content.getvalue()).decode("ascii"))


def _wide() -> Drawing:
    """A drawing across the whole width of the page."""
    drawing = figure()
    drawing.set_size_inches(8.0, 4.0)
    return drawing


def _run_up(data: xr.Dataset, number: int, stage: str, peaks: Resonances) -> Figure:
    drawing = _wide()
    plot_run_up(data, drawing.axes[0], number, found=peaks)
    text = "its envelope in windows of whole mesh cycles, resonances marked"
    return embedded(drawing, f"Dynamic transmission error of {stage} over its mesh frequency: {text}.")


def _orders(data: xr.Dataset, number: int, stage: str) -> Figure:
    drawing = _wide()
    plot_waterfall(data, drawing.axes[0], number)
    return embedded(drawing, f"Order map of the DTE of {stage}: amplitude over speed and mesh order.")


def _factors(data: xr.Dataset) -> Figure:
    drawing = _wide()
    plot_dynamic_factor(dynamic_factor(data), drawing.axes[0])
    return embedded(drawing, "Dynamic factor of each stage: largest over mean mesh force in windows of the run.")


def _bearings(data: xr.Dataset) -> Figure:
    drawing = _wide()
    plot_bearing_forces(data, drawing.axes[0])
    return embedded(drawing, "Varying part of the radial bearing forces over the speed of the driving shaft.")


def _power(data: xr.Dataset) -> Figure:
    drawing = _wide()
    plot_power(data, drawing.axes[0])
    return embedded(drawing, "Power that dampers, friction and drag dissipate.")
