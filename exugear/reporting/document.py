"""The report as files: an HTML page with all figures inside, and a PDF where a converter is installed."""

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import jinja2

from exugear.reporting.sections import Section
from fem.support.cache import complete_file
from fem.support.user_warning import warn_user

#: Browsers that print a page to PDF, their options, and the time [s] after which printing has failed.
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
HEADLESS, PRINTING_TIME = ("--headless", "--no-sandbox", "--disable-gpu"), 120


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
