"""Cache and map files are complete or absent; damaged ones are refused; changed sources are computed anew."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import fem
from fem.support import cache


def never():
    raise AssertionError("computed again")


def test_second_call_reads_what_the_first_wrote(folder):
    cache.cached("key", lambda: {"a": np.arange(3.0)})
    assert cache.cached("key", never)["a"] == pytest.approx([0, 1, 2])


def test_other_inputs_are_computed_anew(folder):
    cache.cached("key", lambda: {"a": np.zeros(1)})
    assert cache.cached("different", lambda: {"a": np.ones(1)})["a"] == [1]


def test_interruption_leaves_nothing(folder, monkeypatch):
    def interrupted(file, **arrays):
        file.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(cache.np, "savez", interrupted)
    with pytest.raises(KeyboardInterrupt):
        cache.cached("key", lambda: {"a": np.zeros(1)})
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 nothing", b"garbage"])
def test_damaged_file_is_refused(folder, damage):
    cache.cached("key", lambda: {"a": np.zeros(1)})
    (file,) = folder.iterdir()
    file.write_bytes(damage)
    with pytest.raises(ValueError, match="damaged or foreign; remove it"):
        cache.cached("key", never)


def test_interrupted_map_leaves_the_old_one(paper_pair, tmp_path, monkeypatch):
    path = fem.save(fem.ste_map(paper_pair, [0, 1], [0, 0.5], np.zeros((2, 2))), tmp_path / "map.nc")
    before = path.read_bytes()

    def interrupted(self, part, **options):
        part.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr("xarray.Dataset.to_netcdf", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fem.save(fem.ste_map(paper_pair, [0, 1], [0, 0.5], np.ones((2, 2))), path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["map.nc"]


def test_damaged_map_is_refused(tmp_path):
    path = tmp_path / "map.nc"
    path.write_bytes(b"half a file")
    with pytest.raises(ValueError, match="damaged or no netCDF file"):
        fem.load(path)
    with pytest.raises(FileNotFoundError):
        fem.load(tmp_path / "none.nc")
    over_time = xr.Dataset({"te": ("time", [0.0, 1e-6])}, {"time": [0.0, 1.0]})
    with pytest.raises(ValueError, match=r"holds \['te'\], no STE map; read other data by xarray.open_dataset\(path\)"):
        fem.load(fem.save(over_time, tmp_path / "run.nc"))


@pytest.mark.parametrize("te", [np.full((2, 2), np.nan), np.full((2, 2), np.inf)])
def test_maps_hold_finite_numbers(paper_pair, te):
    with pytest.raises(ValueError, match="te must be finite"):
        fem.ste_map(paper_pair, [0, 1], [0, 0.5], te)


def test_maps_have_increasing_axes(paper_pair):
    with pytest.raises(ValueError, match="torque must increase"):
        fem.ste_map(paper_pair, [1, 0], [0, 0.5], np.zeros((2, 2)))
    with pytest.raises(ValueError, match="phase must increase"):
        fem.ste_map(paper_pair, [0, 1], [0.5, 1.5], np.zeros((2, 2)))


def test_a_folder_that_cannot_be_written_costs_a_warning(tmp_path, monkeypatch):
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path / "file"))
    with pytest.warns(UserWarning, match=r"cache folder .*file cannot be written \(.*\): each .*; set EXUGEAR_CACHE"):
        assert cache.cached("key", lambda: {"a": np.arange(3.0)})["a"] == pytest.approx([0, 1, 2])
    assert not cache.known("key")


def test_a_file_that_cannot_be_removed_does_not_hide_why_it_was_not_written(tmp_path, monkeypatch):
    def read_only(*_, **__):
        raise OSError(30, "Read-only file system")

    for name in ("open", "unlink"):
        monkeypatch.setattr(f"pathlib.Path.{name}", read_only)
    with (
        pytest.raises(OSError, match=r"map.nc could not be written: Read-only file system; make room or choose"),
        cache.complete_file(tmp_path / "map.nc"),
    ):
        pass


#: Sources of a package.
TEXTS = {
    "solver/entry.py": "from a_package.law import force\nfrom a_package.law.force import gain\n",
    "law/force.py": "import a_package.numbers\ngain = a_package.numbers.FACTOR\n",
    "numbers.py": "FACTOR = 2.0\n",
    "beside.py": "UNUSED = 1.0\n",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Folder of a package; `stamp()` imports it anew."""
    for name, text in TEXTS.items():
        file = tmp_path / "a_package" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    yield tmp_path / "a_package"
    for module in [module for module in sys.modules if module.split(".")[0] == "a_package"]:
        del sys.modules[module]


def stamp() -> int:
    importlib.import_module("a_package.beside")
    return cache.source_stamp(importlib.import_module("a_package.solver.entry").__name__)


@pytest.mark.parametrize("name", ["solver/entry.py", "law/force.py", "numbers.py"])
def test_the_checksum_changes_with_every_imported_source(package: Path, name):
    before = stamp()
    assert stamp() == before
    file = package / name
    file.write_text(file.read_text() + "# changed\n")
    assert stamp() != before


def test_the_checksum_does_not_change_with_sources_that_are_not_imported(package: Path):
    before = stamp()
    (package / "beside.py").write_text("UNUSED = 2.0\n")
    assert stamp() == before


def test_imports_of_all_forms_are_seen():
    source = b'''"""A text with a definition:

def nothing(): import numpy
"""
import a.b as c, d
from e import (
    f,  # from g import h
    i as j,
)
if True:
    from k.m import *


def function():
    return 1
'''
    assert set(cache.imported(source)) >= {"a.b", "d", "e", "e.f", "e.i", "k.m"}
    assert not {"g", "c", "j"} & set(cache.imported(source))
