"""The documents: their code runs, their commands are those of CI, their pictures are small, the API pages build."""

import ast
import contextlib
import importlib.util
import io
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fem
from fem.units import rpm, um

ROOT = Path(__file__).parents[1]
README, FEM, EXUGEAR = ROOT / "README.md", ROOT / "fem" / "README.md", ROOT / "exugear" / "README.md"
MEASURED = ROOT / "examples" / "MEASURED.md"
DOCS_OF_EXUGEAR = ROOT / "exugear" / "docs"
START, HOW_TO, REFERENCE = (DOCS_OF_EXUGEAR / f"{name}.md" for name in ("start", "how_to", "reference"))
DOCUMENTS = (README, FEM, EXUGEAR, ROOT / "examples" / "README.md", MEASURED, *sorted(DOCS_OF_EXUGEAR.glob("*.md")))
LARGEST_PICTURE = 60_000


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def blocks(path: Path, language: str = "python") -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text(path), re.DOTALL)


def executed(path: Path, folder: Path, replacements: dict[str, str] | None = None) -> tuple[dict, str]:
    """Names and output of all code of a document, parts of it replaced, run in a folder."""
    names: dict = {}
    code, output = "\n".join(blocks(path)), io.StringIO()
    for shown, shorter in (replacements or {}).items():
        assert shown in code
        code = code.replace(shown, shorter)
    with contextlib.chdir(folder), contextlib.redirect_stdout(output):
        exec(code, names)
    return names, output.getvalue()


@pytest.fixture(scope="module")
def of_fem(tmp_path_factory):
    fewer = {"[0, 20, 60], phases=12": "[0, 60], phases=4", "[0, 50, 100], phases=30": "[0, 100], phases=4"}
    return executed(FEM, tmp_path_factory.mktemp("fem"), fewer)


def test_nine_lines_of_the_readme(tmp_path):
    (code,) = blocks(README)
    statements = [line for line in code.splitlines() if line.strip() and "import" not in line]
    assert len(statements) <= 9
    names, _ = executed(README, tmp_path)
    assert np.median(names["run"].data["dte"].values[0]) == pytest.approx(17 * um, rel=0.1)
    assert (tmp_path / "run_up.png").stat().st_size > 10_000


def test_code_of_the_readme_of_fem(of_fem):
    names, output = of_fem
    assert "mean 16.996 um, peak to peak 6.048 um" in output
    assert names["ste"]["te"].dims == ("torque", "misalignment", "phase")
    ste = names["chosen"]
    kinds = [float(ste[f"error_{kind}"][-1]) for kind in ("mesh", "phase", "torque")]
    assert max(kinds) < 0.03 * float(ste["te"][-1].mean())


def test_the_table_of_the_map_names_all_its_variables(of_fem):
    rows = re.findall(r"^\| (.*?) \| (.*?) \|", text(FEM), re.MULTILINE)
    units = {name: unit for names, unit in rows for name in re.findall(r"`(\w+)`", names)}
    ste = of_fem[0]["chosen"]
    for name in ste.variables:
        if name not in ("torque", "phase", "pair"):
            assert units[name] == ste[name].attrs["units"]


def test_code_of_the_readme_of_exugear(tmp_path):
    names, _ = executed(EXUGEAR, tmp_path)
    assert names["run"].data["bearing_force"].dims == ("bearing", "direction", "time")


@pytest.mark.slow
def test_recipes_run(tmp_path):
    """At the start the bearings of the slow shaft balance the mesh force of the idler; the idler lies 60 deg from x."""
    names, _ = executed(HOW_TO, tmp_path, {"duration=0.5": "duration=0.1", "windows=20": "windows=5"})
    pair, data = names["pair"], names["run"].data
    torque = 150.0 + names["slow"].inertia * 600 * rpm / 0.1
    force, alpha, towards = torque / pair.wheel.r_b, pair.alpha_wt, np.pi / 3
    pushed = force * np.array([np.sin(towards + alpha), -np.cos(towards + alpha), 0.0])
    bearings = data["bearing_force"].sel(bearing=["slow at 0 mm", "slow at 60 mm"]).sum("bearing").isel(time=0)
    assert bearings.values == pytest.approx(-pushed, abs=2e-3 * force)
    assert np.isfinite(data["dte"].values).all()
    losses, balanced, efficiencies = names["losses"], names["balanced"], names["efficiencies"]
    variables = {*data.data_vars, *losses.data_vars, *balanced.data.data_vars}
    assert variables <= set(re.findall(r"`(\w+)`", text(REFERENCE)))
    assert float(losses["friction_loss"].mean()) == pytest.approx(39, rel=0.1)
    assert losses["drag_loss"].mean("time").values == pytest.approx([15, 15], rel=0.05)
    (printed,) = blocks(HOW_TO, "text")
    lines = [
        (x.split(), y.split())
        for x, y in zip(str(balanced.energy_balance(0.01)).splitlines(), printed.splitlines(), strict=True)
    ]
    for actual, stated in lines[1:-1]:
        assert actual[:-2] == stated[:-2]
        assert float(actual[-2]) == pytest.approx(float(stated[-2]), rel=1e-3)
    assert float(efficiencies["efficiency"].sel(speed=100.0, load=150.0)) == pytest.approx(0.9953, abs=1e-4)
    assert float(names["tilted"]["K_H_beta"][0]) == pytest.approx(1.57, abs=0.01)


@pytest.mark.slow
def test_tutorial_ends_at_the_resonances_of_its_modes(tmp_path):
    """Peaks of the run-up lie at the modes that the mesh excites, and at a third of the first, as the text says."""
    names, _ = executed(START, tmp_path)
    modes = names["modes"]
    meshing = modes["frequency"].values[modes["energy_share"].sel(element="motor-output").values > 0.01]
    assert meshing == pytest.approx([1621, 3049, 6834], rel=1e-3)
    expected = np.array([meshing[0] / 3, meshing[0], meshing[1]])
    assert names["peaks"].abscissa == pytest.approx(expected, rel=0.02)
    assert names["strongest"] == pytest.approx(1608, rel=2e-3)
    assert (tmp_path / "gearbox.html").stat().st_size > 100_000


def test_coast_flank_has_the_dte_that_the_readme_states():
    """Under a load that drives, the DTE is -(backlash + te), the mesh force < 0."""
    import exugear

    gear = fem.Gear(z=57, m_n=2.6e-3, b=23e-3, d_a=154.5e-3, d_f=141.7e-3, s_n=3.78e-3, d_bore=60e-3)
    ste = fem.static_transmission_error(fem.GearPair(gear, gear, a=0.15), [0, 50, 150, 350], 12, progress=False)
    shafts = [exugear.Shaft(name, {0.0: gear}) for name in ("fast", "slow")]
    stage = exugear.Stage(*shafts, ste, damping=3600, backlash=20 * um)
    model = exugear.build(exugear.Gearbox([stage]))
    data = exugear.run_up(model, speed=1.0, duration=2 * np.pi / 57, load=-150.0, progress=False).data
    assert float(data["dte"].mean()) == pytest.approx(-20 * um - float(ste["te"].sel(torque=150).mean()), rel=1e-3)
    assert float(data["mesh_force"].mean()) == pytest.approx(-150.0 / gear.r_b, rel=1e-3)


def test_readme_is_short_and_names_the_commands_of_ci():
    assert len(text(README).splitlines()) <= 150
    (command,) = re.findall(r"^python3 -m venv .*pytest$", text(README), re.MULTILINE)
    assert ".[test]" in command


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_files_and_headings(document):
    for target in re.findall(r"\]\(([^)\s]+)\)", text(document)):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        path = document.parent / name if name else document
        assert path.exists(), target
        headings = (
            [re.sub(r"[^\w -]", "", line.lstrip("# ").lower()) for line in text(path).splitlines() if line[:1] == "#"]
            if anchor
            else []
        )
        assert not anchor or anchor in [heading.replace(" ", "-") for heading in headings], target


def test_walk_from_a_run_to_the_involute_names_functions_that_stand_there():
    rooms = re.findall(r"^\| `([\w/]+\.py)` \| `([\w.]+)` \|", text(EXUGEAR), re.MULTILINE)
    assert 8 < len(rooms) <= 12
    for room, function in rooms:
        path = ROOT / room if room.startswith("fem/") else ROOT / "exugear" / room
        definitions = {n.name for n in ast.walk(ast.parse(text(path))) if isinstance(n, ast.FunctionDef | ast.ClassDef)}
        assert {*function.split(".")} <= definitions, (room, function)


def test_commands_of_measured_numbers_name_what_there_is():
    commands = re.findall(r"`((?:fem|exugear|benchmarks|examples)/[\w/]+\.py)(?:::(\w+))?`", text(MEASURED))
    assert len(commands) > 30
    for name, test in commands:
        path = ROOT / name if name.startswith("examples") else ROOT / "tests" / name
        assert path.exists(), name
        assert f"def {test}(" in text(path) if test else True, test


def test_each_measured_number_has_a_command():
    """In tables with a column of commands, whose last cell is then never empty."""
    with_commands = False
    for line in text(MEASURED).splitlines():
        if not line.startswith("|"):
            with_commands = False
        elif line.endswith("| command |"):
            with_commands = True
        assert not with_commands or line.split("|")[-2].strip(), line


def test_measured_numbers_are_stated_by_the_tests_that_assert_them():
    """Each row that tests state stands in the table."""
    literal = r'measured(?:\.cells|\.number)?\(\s*f?"([^"]+)"|row = f?"([^"]+)"'
    sources = [text(path) for path in (ROOT / "tests").rglob("test_*.py") if "measured)" in text(path)]
    stated = {first or second for source in sources for first, second in re.findall(literal, source)}
    rows = re.findall(r"^\| (.+?) \|", text(MEASURED), re.MULTILINE)
    patterns = [re.sub(r"\\\{.*?\\\}", ".+", re.escape(row)) for row in stated]
    assert not [pattern for pattern in patterns if not any(re.match(pattern, row) for row in rows)]
    assert len(stated) > 40


def test_pictures_are_small_and_shown():
    pictures = set((ROOT / "examples" / "figures").glob("*.png"))
    assert max(path.stat().st_size for path in pictures) < LARGEST_PICTURE
    everything = "".join(map(text, DOCUMENTS))
    assert {path.name for path in pictures if path.name not in everything} == set()


@pytest.mark.slow
def test_api_reference_builds_without_warnings(tmp_path):
    """By the command of the README; it shows the public names of both packages, which they import lazily."""
    assert importlib.util.find_spec("pdoc"), "pdoc is missing; install with .[test]"
    (command,) = re.findall(r"^\.venv/bin/pdoc (.*)$", text(README), re.MULTILINE)
    arguments = [str(tmp_path) if part == "api" else part for part in shlex.split(command)]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *filter(None, sys.path)])}
    built = subprocess.run(
        [sys.executable, "-W", "error", "-m", "pdoc", *arguments],
        cwd=ROOT,
        env=surroundings,
        capture_output=True,
        text=True,
    )
    assert built.returncode == 0, built.stderr
    assert "warn" not in built.stderr.lower()
    pages = {name: text(tmp_path / f"{name}.html") for name in ("fem", "exugear")}
    for name, members in {
        "fem": ("static_transmission_error", "Gear", "UpTo"),
        "exugear": ("run_up", "Gearbox", "plan"),
    }.items():
        assert all(f'id="{member}"' in pages[name] for member in members)
    assert 'id="plot_run_up"' in text(tmp_path / "exugear" / "plots.html")
