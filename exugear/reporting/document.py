"""A report as a document: sections of sentences, tables and figures, written as an HTML page and as PDF."""

import shutil
import subprocess
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import jinja2
from matplotlib import rc_context
from matplotlib.figure import Figure as Drawing

from fem.support.cache import complete_file
from fem.support.user_warning import warn_user

#: Browsers that print a page to PDF, their options, and the time [s] after which printing has failed.
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
HEADLESS, PRINTING_TIME = ("--headless", "--no-sandbox", "--disable-gpu"), 120
#: Resolution of the parts of a figure that are images [1/inch]: order maps.
RESOLUTION = 160


class Table(NamedTuple):
    """A table of texts: caption, names of the columns, rows of as many cells."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


class Figure(NamedTuple):
    """A figure: caption, and its SVG as base64 text."""

    caption: str
    svg: str


@dataclass(frozen=True)
class Section:
    """A section of a report.

    title     heading
    items     sentences, shown as a list
    tables    shown below the list
    figures   shown below the tables
    """

    title: str
    items: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()

    @property
    def empty(self) -> bool:
        """Whether there is nothing to show."""
        return not (self.items or self.tables or self.figures)


def embedded(drawing: Drawing, caption: str) -> Figure:
    """A drawing as the figure of a report; text stays text."""
    content = BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "exugear"}):
        drawing.savefig(content, format="svg", dpi=RESOLUTION, metadata={"Date": None})
    return Figure(caption, b64encode(content.getvalue()).decode("ascii"))


def page(title: str, subtitle: str, sections: Sequence[Section]) -> str:
    """The HTML page of a report."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("exugear.reporting", ""), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    shown = [section for section in sections if not section.empty]
    return environment.get_template("page.html.jinja").render(title=title, subtitle=subtitle, sections=shown)


def browser() -> str | None:
    """The browser that prints pages to PDF, None where none is installed."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)


def printed(html: Path, pdf: Path) -> bool:
    """Whether a browser has printed the page to PDF; a warning says why it failed."""
    converter = browser()
    if converter is None:
        return False
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        draft = Path(folder) / "report.pdf"
        options = [f"--user-data-dir={folder}/profile", "--no-pdf-header-footer", f"--print-to-pdf={draft}"]
        try:
            command = [converter, *HEADLESS, *options, html.absolute().as_uri()]
            subprocess.run(command, check=True, capture_output=True, timeout=PRINTING_TIME)
            content = draft.read_bytes()
        except (OSError, subprocess.SubprocessError) as error:
            remedy = f"{html} is complete; print it from a browser by hand"
            warn_user(f"{converter} could not print the report to PDF ({error}); {remedy}")
            return False
    with complete_file(pdf) as file:
        file.write(content)
    return True
