"""The report of a run."""

from pathlib import Path

import xarray as xr

from exugear.multibody.model import Model
from exugear.plots.gearbox_drawing import plot_gearbox
from exugear.reporting.document import Section, page, printed
from exugear.reporting.inputs import assumptions, errors, inputs, speed_range, versions
from exugear.reporting.load_section import load_section
from exugear.reporting.results import drawn, results, vibration
from exugear.reporting.set_results import set_sections
from exugear.running.run import Run
from exugear.running.run_data import stage_data
from fem.support.arguments import FilePath, checked
from fem.support.cache import complete_file
from fem.support.validation import require

__all__ = ["report"]


@checked
def report(
    run: Run,
    path: FilePath,
    *,
    model: Model | None = None,
    load_distribution: xr.Dataset | None = None,
    title: str = "Gear dynamics report",
) -> list[Path]:
    """Write the report of a run: one HTML page with all figures inside, and a PDF beside it where a browser is found.

    run     an `exugear.Run`
    path    of the page, ending in .html; the PDF has the same name
    model   `exugear.Model` of the run: the report then begins with a drawing of the gearbox, and has its vibration
            modes and its Campbell diagram
    load_distribution
            of the gearbox, as `exugear.load_distribution` returns it: a page with line loads, face load factors,
            deflection lines and bearing forces
    title   heading of the report

    Returns the files written, each complete. The page holds a summary, figures, tables of resonances, of planetary sets
    their members with torques, phases, load sharing, orbits and side bands, the inputs as data sheets, assumptions, the
    plan, error estimates and versions. Where the browser fails to print, a warning says
    so. Raises ValueError for other suffixes, and with a model for runs without a constant load on the driven shaft.
    """
    stage_data(run)
    html = Path(path)
    require(html.suffix == ".html", f"path must end in .html, got {html.name}; the PDF is written beside it")
    with complete_file(html) as file:
        file.write(page(title, _subtitle(run), _sections(run, model, load_distribution)).encode())
    pdf = html.with_suffix(".pdf")
    return [html, pdf] if printed(html, pdf) else [html]


def _subtitle(run: Run) -> str:
    stages = ", ".join(run.data["stage"].values.tolist())
    return f"{run.data.attrs['title']} of {stages}, {speed_range(run.data)}"


def gearbox_section(model: Model) -> Section:
    """The drawing of the gearbox."""
    caption = (
        "The gearbox from the side, to scale: gears with tip and root circles, bearings crossed out; dashed shafts"
    )
    return Section("Gearbox", figures=(drawn(plot_gearbox, f"{caption} have no sections.", model.gearbox),))


def _sections(run: Run, model: Model | None, loads: xr.Dataset | None) -> list[Section]:
    """Sections of the report in the order of the page; what does not fit the run is refused first."""
    data = run.data
    faces = [load_section(loads)] if loads is not None else []
    modal = [vibration(model, data)] if model else []
    return [
        *([gearbox_section(model)] if model else []),
        results(data),
        *set_sections(data),
        *faces,
        *modal,
        inputs(data),
        assumptions(data),
        errors(data, run.wall_time),
        versions(),
    ]
