"""The report of a run: whole files, what it says, and the page as a browser shows it."""

import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.image import imread
from report_pages import table
from scenes import smooth_box, two_stages
from sweeps import DAMPING, MODE, receptance, swept_by_two_stages
from torsional_trains import geared_train

import exugear
from exugear.reporting.results import harmonics_as_text
from fem.units import rpm, um

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
TITLES = ("Results", "Inputs", "Assumptions and plan", "Error estimates", "Versions")


class Page(HTMLParser):
    """Headings, cells of tables and sources of images of a page, and whether each tag is closed."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.texts: dict[str, list[str]] = {"h2": [], "td": [], "caption": [], "figcaption": [], "li": []}
        self.images: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag == "img":
            self.images.append(dict(attrs)["src"])
        if tag not in ("img", "meta"):
            self.open.append(tag)
        if tag in self.texts:
            self.texts[tag].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        for tag in set(self.open) & self.texts.keys():
            self.texts[tag][-1] += data


@pytest.fixture(scope="module")
def swept() -> exugear.Run:
    """A run-up through the main resonance of the paper's pair, its losses recorded."""
    model = exugear.build(smooth_box())
    speeds = (1500 * rpm, 2600 * rpm)
    return exugear.run_up(model, speed=speeds, duration=0.8, load=150.0, power=True, progress=False)


def page_of(run, folder, **options) -> str:
    """The page of a report without a browser, in which no PDF is printed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PATH", "")
        (path,) = exugear.report(run, folder / "page.html", **options)
    return path.read_text(encoding="utf-8")


def contact_in_words(page: str) -> str:
    """The sentence of a page on the mesh force of the only stage."""
    (sentence,) = [text for text in Page(page).texts["li"] if "the mesh force reaches" in text]
    return sentence


def with_force(run, force) -> exugear.Run:
    """A run with another mesh force."""
    recorded = run.data["mesh_force"]
    return replace(run, data=run.data.assign(mesh_force=recorded.copy(data=np.broadcast_to(force, recorded.shape))))


@pytest.fixture(scope="module")
def short() -> exugear.Run:
    """A run of a single mesh cycle, whose report has no figures."""
    return exugear.run_up(exugear.build(smooth_box()), speed=(50.0, 60.0), duration=0.002, load=150.0, progress=False)


@pytest.fixture(scope="module")
def written(swept, tmp_path_factory):
    return exugear.report(swept, tmp_path_factory.mktemp("report") / "run.html", title="Paper's <pair>")


def test_the_page_is_well_formed_and_complete(written):
    page = Page(written[0].read_text(encoding="utf-8"))
    assert page.open == []
    assert [title.split(" ", 1)[1] for title in page.texts["h2"]] == list(TITLES)
    assert len(page.images) == len(page.texts["figcaption"]) == 4
    assert all(source.startswith("data:image/svg+xml;base64,") for source in page.images)
    assert {"57", "2.6 mm", "150 N m", exugear.__version__} <= set(page.texts["td"])


def test_the_resonance_table_holds_peaks_with_their_harmonics(swept, written):
    table = exugear.resonances(swept)
    cells = Page(written[0].read_text(encoding="utf-8")).texts["td"]
    assert all(f"{frequency:.1f}" in cells for frequency in table["mesh_frequency"].values)
    assert 1 in table["harmonic"].values


def test_the_summary_says_whether_teeth_part(written, short, tmp_path):
    assert "the teeth are apart" in contact_in_words(written[0].read_text(encoding="utf-8"))
    pressed = with_force(short, np.abs(short.data["mesh_force"].values) + 1.0)
    assert contact_in_words(page_of(pressed, tmp_path)).endswith("the teeth never part.")


def test_the_largest_force_of_a_driving_load_is_stated_with_its_sign(tmp_path):
    model = exugear.build(smooth_box())
    run = exugear.run_up(model, speed=100.0, duration=0.05, load=-150.0, progress=False, checks=0)
    force = run.data["mesh_force"].values
    stated = f"reaches {float(f'{force.min():.4g}'):.10g} N, {force.min() / force.mean():.3g} times its mean"
    assert stated in contact_in_words(page_of(run, tmp_path))


def test_a_load_that_crosses_zero_is_reported_in_words(short, tmp_path):
    run = exugear.run_up(exugear.build(smooth_box()), speed=(50.0, 60.0), duration=0.05, load=150.0, progress=False)
    time = run.data["time"].values
    force = 1000 * (time / time[-1] - 0.5) + 50 * np.sin(2 * np.pi * 900 * time)
    page = page_of(with_force(run, force), tmp_path)
    assert "times its mean" not in contact_in_words(page)
    assert "while its mean over the run is" in contact_in_words(page)
    (row, told) = table(page, "Dynamic factors")[::-1]
    assert "cannot be told" in row[1]
    assert "load crosses zero" in row[1]
    assert float(told[1]) < 5
    assert page_of(with_force(short, 0.0), tmp_path)


def test_a_model_of_another_gearbox_is_refused(swept, tmp_path):
    with pytest.raises(ValueError, match=r"model has the stages .*; pass the model of the run"):
        exugear.report(swept, tmp_path / "run.html", model=exugear.build(two_stages()))


def test_a_run_at_constant_speed_has_no_resonances(tmp_path):
    run = exugear.run_up(exugear.build(smooth_box()), speed=150.0, duration=0.05, load=150.0, progress=False)
    page = Page(exugear.report(run, tmp_path / "constant.html")[0].read_text(encoding="utf-8"))
    assert not [caption for caption in page.texts["caption"] if "Resonances" in caption]
    assert "1432.4 rpm" in page.texts["td"]


def test_modes_and_crossings_of_the_model_are_those_of_the_campbell_diagram(swept, tmp_path, monkeypatch):
    """Both figure and tables; without a constant load there are none."""
    monkeypatch.setenv("PATH", "")
    model = exugear.build(smooth_box(exugear.Bearing(radial=2e8, axial=1e8, tilt=1e6, damping_time=2e-5)))
    page = Page(exugear.report(swept, tmp_path / "run.html", model=model)[0].read_text(encoding="utf-8"))
    frequencies = exugear.modes(model, load=150.0)["frequency"].values
    assert {f"{frequency:.1f}" for frequency in frequencies} <= set(page.texts["td"])
    assert len(page.images) == 6  # of the results four, the diagram, and the drawing of the gearbox
    ramp = exugear.Run(swept.data.assign_attrs(load="(0.0, 100.0)"), 1.0, 1e-5)
    with pytest.raises(ValueError, match="run must have a constant load for its vibration modes"):
        exugear.report(ramp, tmp_path / "ramp.html", model=model)
    assert not (tmp_path / "ramp.html").exists()


@pytest.mark.parametrize(("duration", "figures"), [(0.05, 3), (0.002, 0)])
def test_a_short_run_has_the_figures_that_its_mesh_cycles_allow(duration, figures, tmp_path, monkeypatch):
    """25 mesh cycles show harmonics, one shows none: its report is of the range of the signals."""
    monkeypatch.setenv("PATH", "")
    run = exugear.run_up(exugear.build(smooth_box()), speed=(50.0, 60.0), duration=duration, load=150.0, progress=False)
    page = Page(exugear.report(run, tmp_path / "short.html")[0].read_text(encoding="utf-8"))
    assert len(page.images) == figures
    assert any("Mesh harmonics" in caption for caption in page.texts["caption"]) == (figures > 0)
    assert any("Range of the signals" in caption for caption in page.texts["caption"])


def test_a_run_at_rest_has_modes_without_a_campbell_diagram(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    model = exugear.build(smooth_box())
    run = exugear.run_up(model, speed=0.0, duration=0.01, load=150.0, progress=False)
    page = Page(exugear.report(run, tmp_path / "rest.html", model=model)[0].read_text(encoding="utf-8"))
    assert any("Natural frequencies" in caption for caption in page.texts["caption"])
    assert len(page.images) == 1  # the drawing of the gearbox


def test_bearings_friction_and_energies_stand_in_the_report(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    parts = {0.0: exugear.Bearing(radial=2e8, axial=1e8, tilt=1e6, damping_time=2e-5, drag=exugear.Drag(0.1))}
    model = exugear.build(smooth_box(parts=parts))
    drag = exugear.Torque(of_speed=lambda speed: 0.5 * speed)
    run = exugear.run(
        model, drives={}, loads={"slow": drag}, start_speed=50.0, duration=0.01, power=True, progress=False
    )
    cells = Page(exugear.report(run, tmp_path / "run.html")[0].read_text(encoding="utf-8")).texts["td"]
    assert any("radial 2e8 N/m" in cell and "damping time 2e-5 s" in cell for cell in cells)
    assert {"slow: Torque(of_speed=a function)", "residual", "drag loss"} <= set(cells)


@pytest.mark.parametrize(
    ("force", "text"), [(10012.3, "10010"), (1.23456, "1.235"), (0.0, "0"), (123456789, "123500000")]
)
def test_numbers_have_no_exponents_below_a_thousand_million(force, text, short, tmp_path):
    assert f"the mesh force reaches {text} N" in contact_in_words(page_of(with_force(short, force), tmp_path))


def test_a_loaded_run_gives_the_same_report(swept, written, tmp_path, monkeypatch):
    swept.save(tmp_path / "run.nc")
    monkeypatch.setenv("PATH", "")
    (again,) = exugear.report(exugear.Run.load(tmp_path / "run.nc"), tmp_path / "run.html", title="Paper's <pair>")
    assert again.read_text(encoding="utf-8") == written[0].read_text(encoding="utf-8")


def test_bad_paths_are_refused_and_nothing_is_left(swept, tmp_path):
    with pytest.raises(ValueError, match=r"path must end in \.html"):
        exugear.report(swept, tmp_path / "run.pdf")
    with pytest.raises(OSError, match="could not be written"):
        exugear.report(swept, tmp_path / "nowhere" / "run.html")
    assert list(tmp_path.iterdir()) == []


def test_a_browser_that_fails_leaves_the_page_and_warns(short, tmp_path, monkeypatch):
    programs, pages = tmp_path / "programs", tmp_path / "pages"
    for folder in (programs, pages):
        folder.mkdir()
    (programs / "chromium").write_text("#!/bin/sh\nexit 1\n", encoding="utf-8")
    (programs / "chromium").chmod(0o755)
    monkeypatch.setenv("PATH", str(programs))
    with pytest.warns(UserWarning, match="print it from a browser by hand"):
        files = exugear.report(short, pages / "run.html")
    assert files == [pages / "run.html"]
    assert [path.name for path in pages.iterdir()] == ["run.html"]


@pytest.mark.skipif(BROWSER is None, reason="no browser is installed")
def test_a_headless_browser_shows_all_figures(written, tmp_path):
    """The PDF has several pages, and the screenshot shows curves: neither page nor figures are blank."""
    html, pdf = written
    assert pdf.read_bytes().startswith(b"%PDF")
    image = tmp_path / "page.png"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=1000,4000"]
    command = [BROWSER, *options, f"--user-data-dir={tmp_path}/profile", f"--screenshot={image}", html.as_uri()]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    pixels = imread(image)[..., :3]
    coloured = np.ptp(pixels, axis=2) > 0.2
    assert pixels.shape[:2] == (4000, 1000)
    assert coloured.mean() > 0.02


def test_a_reversing_run_lists_mesh_frequencies_above_zero():
    run = exugear.run_up(
        exugear.build(smooth_box()), speed=(40.0, -60.0), duration=0.3, load=150.0, progress=False, checks=0
    )
    assert all(float(row[-1]) > 0 for row in harmonics_as_text(run.data, 0).rows)


def test_a_run_with_several_loads_has_its_vibration_modes(tmp_path):
    model = exugear.build(geared_train())
    options = {"drives": {"turbine": 5.0}, "duration": 0.01, "progress": False}
    run = exugear.run(model, loads={"port": 100.0}, **options)
    text = exugear.report(run, tmp_path / "run.html", model=model)[0].read_text(encoding="utf-8")
    assert "Stages turbine-idler, idler-starboard carry no load" in text
    torque = exugear.run(model, loads={"port": (100.0, 50.0)}, **options)
    with pytest.raises(ValueError, match="run must have a constant load for its vibration modes"):
        exugear.report(torque, tmp_path / "run.html", model=model)


@pytest.mark.parametrize("stage", [0, 1])
def test_harmonics_in_a_report_are_those_of_the_stage_itself(stage):
    """In windows of a single stage the other order, 0.75 beside, would add up to its whole amplitude."""
    table_of_stage = harmonics_as_text(swept_by_two_stages(8.0), stage)
    harmonic, amplitude, _, frequency = table_of_stage.rows[0]
    assert harmonic == "1"
    assert float(amplitude) * um == pytest.approx(4e-6 * receptance(MODE, MODE, DAMPING), rel=0.08)
    assert float(frequency) == pytest.approx(MODE, rel=0.01)
