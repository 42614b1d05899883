"""The README's code and the main example do what they say."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import fem
from fem.units import um

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "examples"))
import korta_run_up  # noqa: E402


def test_readme_code_runs(tmp_path, monkeypatch):
    code, asked = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(code, names)
    dte = names["run"].data["dte"].values[0]
    assert np.median(dte) == pytest.approx(17 * um, rel=0.1)
    assert (tmp_path / "run_up.png").stat().st_size > 10_000
    exec(asked, names)
    assert names["ste"]["te"].dims == ("torque", "misalignment", "phase")
    kinds = names["ste"]["error_mesh"], names["ste"]["error_phase"], names["ste"]["error_torque"]
    assert max(float(kind[-1]) for kind in kinds) < 0.03 * float(names["ste"]["te"][-1].mean())


def test_readme_names_the_commands_of_ci():
    (command,) = re.findall(r"^python3 -m venv .*pytest$", (ROOT / "README.md").read_text(encoding="utf-8"), re.M)
    assert ".[test]" in command


@pytest.fixture(scope="module")
def short():
    """A tenth of the main job."""
    ste = fem.static_transmission_error(korta_run_up.paper_pair(), (0, 5, 50, 150, 350, 1500), 30, progress=False)
    box = korta_run_up.gearbox(ste, 0.08)
    return ste, box, {load: korta_run_up.run(box, load, 7.0) for load in korta_run_up.TORQUES}


def test_resonances_lie_where_stiffness_and_inertia_put_them(short):
    ste, box, runs = short
    for load, result in runs.items():
        natural = np.sqrt(korta_run_up.mean_stiffness(ste, load) / box.driven.inertia) * 69.63e-3 / 2 / np.pi
        *_, half, main = korta_run_up.superharmonics(korta_run_up.resonances(result))
        assert half == pytest.approx(natural / 2, rel=0.03)
        assert 0.85 * natural < main < 1.02 * natural


def test_fitted_inertia_moves_the_main_resonance_to_the_papers(short):
    _, box, runs = short
    found = korta_run_up.resonances(runs[150.0])
    inertia = korta_run_up.fitted_inertia(box, found)
    assert korta_run_up.main_resonance(found) * np.sqrt(box.driven.inertia / inertia) == pytest.approx(1804)


def test_report_and_figures(short, tmp_path):
    ste, box, runs = short
    curves = ste.sel(torque=[150, 350])
    korta_run_up.draw(tmp_path, curves, ste, runs)
    assert {path.name for path in tmp_path.iterdir()} == {"mesh.png", "ste.png", "run_up.png", "orders.png"}
    text = korta_run_up.report(curves, box, runs, False, korta_run_up.Clock())
    assert "1804" in text and "nothing is fitted" in text
