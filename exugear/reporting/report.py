"""The report of a run."""

from pathlib import Path

from exugear.multibody.model import Model
from exugear.reporting.assumptions import assumptions, errors, versions
from exugear.reporting.document import page, printed
from exugear.reporting.figures import run_figures
from exugear.reporting.inputs import inputs, speed_range
from exugear.reporting.results import (
    balance,
    extremes,
    factor_table,
    harmonics_as_text,
    is_sweep,
    resonances_as_text,
    summary,
)
from exugear.reporting.sections import Section
from exugear.reporting.vibration import vibration
from exugear.running.run import Run
from exugear.running.run_data import stage_data
from exugear.signals.resonance_table import resonance_table
from fem.support.arguments import FilePath, checked
from fem.support.cache import complete_file
from fem.support.validation import require

__all__ = ["report"]


@checked
def report(run: Run, path: FilePath, *, model: Model | None = None, title: str = "Gear dynamics report") -> list[Path]:
    """Write the report of a run: one HTML page with all figures inside, and a PDF beside it where a browser is found.

    run     an `exugear.Run`
    path    of the page, ending in .html; the PDF has the same name
    model   `exugear.Model` of the run: the report then has its vibration modes and its Campbell diagram too
    title   heading of the report

    Returns the files written, each complete. The page holds a summary, figures, tables of resonances, the inputs as
    data sheets, assumptions, the plan, error estimates and versions. Where the browser fails to print, a warning says
    so. Raises ValueError for other suffixes, and with a model for runs without a constant load on the driven shaft.
    """
    stage_data(run)
    html = Path(path)
    require(html.suffix == ".html", f"path must end in .html, got {html.name}; the PDF is written beside it")
    with complete_file(html) as file:
        file.write(page(title, _subtitle(run), _sections(run, model)).encode())
    pdf = html.with_suffix(".pdf")
    return [html, pdf] if printed(html, pdf) else [html]


def _subtitle(run: Run) -> str:
    stages = ", ".join(run.data["stage"].values.tolist())
    return f"{run.data.attrs['title']} of {stages}, {speed_range(run.data)}"


def _sections(run: Run, model: Model | None) -> list[Section]:
    """Sections of the report in the order of the page."""
    data = run.data
    return [
        _results(run),
        *([vibration(model, data)] if model else []),
        inputs(data),
        assumptions(data),
        errors(data, run.wall_time),
        versions(),
    ]


def _results(run: Run) -> Section:
    data = run.data
    if not is_sweep(data):
        recorded = tuple(table for table in (extremes(data), balance(data)) if table.rows)
        return Section("Results", summary(data), recorded, tuple(run_figures(data, {})))
    stages = data["stage"].values.tolist()
    resonances = {stage: resonance_table(data, number) for number, stage in enumerate(stages)}
    tables = [resonances_as_text(data, stage, table) for stage, table in resonances.items()]
    tables += [harmonics_as_text(data, number) for number in range(len(stages))]
    tables += [factor_table(data), extremes(data), balance(data)]
    figures = run_figures(data, resonances)
    return Section("Results", summary(data), tuple(table for table in tables if table.rows), tuple(figures))
