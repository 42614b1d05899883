"""The examples of the reference methods, on coarse meshes and few phases: they compute, compare, print and draw."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from skfem import ElementQuad1, ElementQuad2

from fem import Density, dynamic

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
import korta_convergence
import korta_static_dynamic

COARSE = Density(flank=12, fillet=2, tooth=2, rim=2, body=3, teeth=1, behind=1)


@pytest.fixture
def printed(monkeypatch, capsys, tmp_path):
    """Mean and peak to peak [um] of each line that an example prints, once it has drawn its figure."""

    def run(example, **settings) -> np.ndarray:
        for name, value in settings.items():
            monkeypatch.setattr(example, name, value)
        example.main(tmp_path)
        assert (tmp_path / f"{example.__name__}.png").stat().st_size > 10_000
        return np.array(re.findall(r"mean +([\d.]+) um +peak to peak +([\d.]+) um", capsys.readouterr().out), float)

    return run


def test_quadratic_elements_give_the_converged_curve_on_a_coarse_mesh_and_linear_ones_are_stiffer(printed):
    meshes = ((COARSE, ElementQuad1()), (COARSE.refined(2), ElementQuad1()), (COARSE.refined(2), ElementQuad2()))
    coarse, linear, quadratic = printed(korta_convergence, MESHES=meshes, PHASES=np.arange(6) / 10)
    assert quadratic == pytest.approx([16.42, 5.848], rel=5e-3)
    assert (linear < quadratic).all()
    assert coarse == pytest.approx(quadratic, rel=0.03)


def test_slow_gears_follow_the_statics(printed):
    run = dynamic.RunUp(start=-0.62, run_up=0.12, stop=0.5, steps=120)
    moving, standing = printed(korta_static_dynamic, DENSITY=COARSE, RUN=run)
    assert moving == pytest.approx(standing, rel=3e-3)
