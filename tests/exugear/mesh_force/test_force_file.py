"""Force laws in files, and laws from tables of other programs."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from paper_gears import paper_gear, paper_pair
from scenes import linear_law, smooth_map
from two_sided_maps import TILTS, both_sides

import exugear
import fem
from exugear import MeshForce
from fem.units import mm, um


@cache
def laws() -> dict[str, MeshForce]:
    """Laws with the least and with the most of fields."""
    both = MeshForce.from_ste(both_sides(TILTS), damping=2700.0, backlash=40 * um, extend=1.5)
    map_ = MeshForce.from_ste(smooth_map(), conserves=False, damping_ramp=2 * um)
    return {"linear": linear_law(), "map": map_, "coast": both, "fixed": both.at(misalignment=1e-5)}


@pytest.mark.parametrize("name", ["linear", "map", "coast", "fixed"])
def test_a_law_is_read_back_to_the_last_bit(tmp_path, name):
    law = laws()[name]
    again = MeshForce.load(law.save(tmp_path / "law.nc"))
    assert again.table.tobytes() == law.table.tobytes()
    for field in ("damping", "damping_ramp", "backlash", "back_phase", "conserves", "fixed_offsets", "mapped_force"):
        assert getattr(again, field) == getattr(law, field)
        if law.coast is not None:
            assert getattr(again.coast, field) == getattr(law.coast, field)
    assert again.coast_unlike == law.coast_unlike and (again.coast is None) == (law.coast is None)
    assert again.offsets.keys() == law.offsets.keys()
    offsets = dict.fromkeys(law.offsets, 2e-5)
    assert again(0.3, 2 * um, 0.1, **offsets) == law(0.3, 2 * um, 0.1, **offsets)


def test_a_saved_law_is_labelled_netcdf(tmp_path):
    with xr.open_dataset(laws()["coast"].save(tmp_path / "law.nc"), engine="h5netcdf") as data:
        assert data["force_table"].dims == ("misalignment", "phase", "deflection_step")
        assert data["damping"].attrs["units"] == "N s/m" and float(data["backlash"]) == 40 * um


def test_damaged_and_other_files_are_refused(tmp_path):
    path = linear_law().save(tmp_path / "law.nc")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"law.nc is damaged or no netCDF file; write it again with MeshForce.save"):
        MeshForce.load(path)
    with pytest.raises(ValueError, match=r"no force law; for an STE map take MeshForce.from_ste\(fem.load\(path\)\)"):
        MeshForce.load(fem.save(smooth_map(), tmp_path / "map.nc"))
    with pytest.raises(OSError, match="create the folder"):
        linear_law().save(tmp_path / "none" / "law.nc")


def table_of(ste: xr.Dataset, units: dict[str, tuple[str, float]]) -> str:
    """A map as text, points in any order."""
    points = ste["te"].to_dataframe().reset_index()[list(units)].sample(frac=1.0, random_state=0)
    rows = [
        ", ".join(f"{x / factor!r}" for x, (_, factor) in zip(row, units.values(), strict=True))
        for row in points.to_numpy().tolist()
    ]
    return "\n".join([", ".join(f"{name} [{unit}]" for name, (unit, _) in units.items()), *rows])


def test_a_table_from_elsewhere_is_the_map_it_was_written_from(tmp_path):
    ste = smooth_map([0, 50.0, 350.0, 700.0], 8)
    path = tmp_path / "te.csv"
    path.write_text(table_of(ste, {"te": ("um", um), "torque": ("kN m", 1e3), "phase": ("%", 1e-2)}))
    again = fem.ste_from_table(path, paper_pair())
    assert again["te"].values == pytest.approx(ste["te"].values, rel=1e-14) and again.attrs == ste.attrs
    law, expected = MeshForce.from_ste(again), MeshForce.from_ste(ste)
    assert law(0.3, 10 * um) == pytest.approx(float(expected(0.3, 10 * um)), rel=1e-12)
    shafts = (exugear.Shaft(name, {0.0: paper_gear()}) for name in ("fast", "slow"))
    assert exugear.Stage(*shafts, again, damping=1000.0).pair == paper_pair()


def test_a_table_over_offsets_has_their_axes(tmp_path):
    ste = both_sides(TILTS).sel(torque=slice(0, None)).transpose("torque", "misalignment", "phase")
    path = tmp_path / "te.csv"
    units = {"misalignment": ("mrad", 1e-3), "torque": ("N m", 1.0), "phase": ("1", 1.0), "te": ("mm", mm)}
    path.write_text(table_of(ste, units))
    again = fem.ste_from_table(path, paper_pair())["te"]
    assert again.dims == ("torque", "misalignment", "phase")
    assert again.values == pytest.approx(ste["te"].values, rel=1e-14)
    assert again["misalignment"].values == pytest.approx(TILTS)


def test_points_given_twice_and_wrong_units_are_refused(tmp_path):
    path = tmp_path / "te.csv"
    path.write_text("torque [N m], phase [1], te [um]\n0, 0, 0\n10, 0, 1\n10, 0.0, 2\n")
    with pytest.raises(ValueError, match=r"lines 3 and 4 of .*te.csv give the same point; remove one"):
        fem.ste_from_table(path, paper_pair())
    path.write_text("torque [N m], phase [1], te [m]\n0, 0, 0\n10, 0, 1.5\n")
    with pytest.raises(ValueError, match=r"te of .*te.csv must lie within 0.01 m, got 1.5 m; correct its unit"):
        fem.ste_from_table(path, paper_pair())


def test_deviations_of_a_measuring_machine(tmp_path):
    path = tmp_path / "flank.txt"
    path.write_text("removed [um] roll [mm] axial [mm]\n1 18 -10\n2 33 -10\n3 18 10\n4 33 10\n")
    grid = fem.Grid.from_table(path)
    assert grid == fem.Grid([18 * mm, 33 * mm], [-10 * mm, 10 * mm], np.array([[1, 3], [2, 4]]) * um)
    path.write_text("removed [um] roll [mm] axial [mm]\n1 18 -10\n2 33 -10\n3 18 10\n")
    with pytest.raises(
        ValueError, match=r"lacks 1 of 2 x 2 points of its grid; add a line for roll 0.033 m, axial 0.01 m"
    ):
        fem.Grid.from_table(path)
