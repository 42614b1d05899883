"""Compiled functions on disk are used again until they or a function that they call change."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import fem
from fem.support import numba_cache, progress

SOURCE = """
from {package}.law.helper import doubled
from fem.support.numba_cache import kept

@kept
def entry(x):
    return doubled(x) + 1.0
"""
#: Without the text fem.support.numba_cache: a number of another folder that is compiled in.
NUMBER = "FACTOR = {factor}"
HELPER = """
from fem.support.numba_cache import compiled
from {package}.numbers.factor import FACTOR

@compiled
def doubled(x):
    return FACTOR * x
"""
#: Functions that differ by a number that they enclose.
VARIANTS = """
from fem.support.numba_cache import kept

def times(n):
    @kept
    def product(x):
        return n * x

    return product

def address(product):
    version = next(iter(product.overloads.values()))
    return version.library.get_pointer_to_function(version.fndesc.llvm_func_name)

def results(*factors):
    products = [times(n) for n in factors]
    values = [product(1.0) for product in products]
    return values, sum(sum(p.stats.cache_hits.values()) for p in products), len(set(map(address, products)))
"""


@pytest.fixture(autouse=True)
def kept_in(tmp_path_factory, monkeypatch) -> Path:
    """Folder of the compiled code of a test."""
    folder = tmp_path_factory.mktemp("kept")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setenv("EXUGEAR_CACHE", str(folder))
    return folder / "compiled"


def write(root: Path, factor: float) -> None:
    """A package of three folders: kernels call a law, which reads a number; unchanged files keep their time."""
    name = f"package_of_{root.name}"
    texts = {"kernels/module": SOURCE, "law/helper": HELPER, "numbers/factor": NUMBER}
    for path, text in texts.items():
        file = root / name / f"{path}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        content = text.format(package=name, factor=factor)
        if not file.exists() or file.read_text() != content:
            file.write_text(content)


def entry_in(root: Path, monkeypatch):
    """The function of the kernel's module as a new process would import it."""
    name = f"package_of_{root.name}"
    for module in [module for module in sys.modules if module.split(".")[0] == name]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.syspath_prepend(root)
    return importlib.import_module(f"{name}.kernels.module").entry


def test_compiling_is_announced_as_long_as_all_of_it_takes(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    monkeypatch.setattr(progress, "on_terminal", lambda: True)
    monkeypatch.setattr(progress, "DELAY", 1e-9)
    monkeypatch.setattr(progress, "TICK", 1e-3)
    write(tmp_path, 2.0)
    for compiles in (True, False):
        entry_in(tmp_path, monkeypatch)(1.0)
        assert ("compiling the contact, once after an installation: 0" in capsys.readouterr().err) == compiles
    write(tmp_path, 3.0)
    with progress.shown(False):
        entry_in(tmp_path, monkeypatch)(1.0)
    assert capsys.readouterr().err == ""


def test_compiled_code_is_renewed_when_a_module_of_another_folder_changes(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    results = []
    for factor in (2.0, 2.0, 3.0):
        write(tmp_path, factor)
        entry = entry_in(tmp_path, monkeypatch)
        results.append((entry(1.0), sum(entry.stats.cache_hits.values())))
    assert results == [(3.0, 0), (3.0, 1), (4.0, 0)]


def test_damaged_files_and_a_full_disk_cost_a_compilation(tmp_path, monkeypatch, kept_in):
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    write(tmp_path, 2.0)
    entry_in(tmp_path, monkeypatch)(1.0)
    for suffix in (".nbi", ".nbc"):
        for file in kept_in.rglob(f"*{suffix}"):
            file.write_bytes(file.read_bytes()[:30])
        hits = []
        for _ in range(2):
            entry = entry_in(tmp_path, monkeypatch)
            assert entry(1.0) == 3.0
            hits.append(sum(entry.stats.cache_hits.values()))
        assert hits == [0, 1], "compiled anew once, then read"

    def no_room(*_):
        raise OSError(28, "No space left on device")

    write(tmp_path, 3.0)
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile.save", no_room)
    assert entry_in(tmp_path, monkeypatch)(1.0) == 4.0


#: A process with a version of numba with which its private parts were not tested.
UNTESTED = """
import sys
import numba
numba.version_info = numba.version_info._replace(short=(0, 99))
import fem.support.numba_cache as numba_cache
assert numba_cache.private is None and "fem.support.numba_private" not in sys.modules
assert type(numba_cache.compiled(lambda x: x)) is type(numba.njit(lambda x: x))
from {package}.kernels.module import entry
print(entry(1.0), sum(entry.stats.cache_hits.values()))
"""


def test_without_private_parts_of_numba_code_is_kept_and_never_out_of_date(tmp_path, kept_in):
    paths = os.pathsep.join([str(tmp_path), str(Path(fem.__file__).parents[1])])
    command = [sys.executable, "-B", "-c", UNTESTED.format(package=f"package_of_{tmp_path.name}")]
    for factor, hits in ((2.0, 0), (2.0, 1), (3.0, 0), (2.0, 1)):
        write(tmp_path, factor)
        environment = os.environ | {"PYTHONPATH": paths}
        process = subprocess.run(command, env=environment, capture_output=True, text=True)
        assert process.stdout.split() == [str(factor + 1), str(hits)], process.stderr
    assert list(kept_in.rglob("*.nbc"))


@pytest.mark.slow
def test_without_private_parts_of_numba_maps_are_the_same(tmp_path):
    """All of the contact, compiled by numba alone."""
    script = """
import sys
import numba
if len(sys.argv) > 1:
    numba.version_info = numba.version_info._replace(short=(0, 99))
import fem
gear = fem.Gear(z=25, m_n=2e-3, b=20e-3, d_bore=20e-3, flank=[fem.TipRelief(15e-6, 1.5e-3)])
options = {"resolution": fem.Slices(density=fem.Density(flank=8)), "progress": False}
te = fem.static_transmission_error(fem.GearPair(gear, gear), [0, 50.0], [0.0, 0.5], **options)["te"].values
print(*(f"{x:.12e}" for x in te.ravel()))
"""
    environment = os.environ | {"PYTHONPATH": str(Path(fem.__file__).parents[1])}
    printed = [
        subprocess.run([sys.executable, "-c", script, *plain], env=environment, capture_output=True, text=True).stdout
        for plain in ([], ["plain"])
    ]
    expected, plain = ([float(x) for x in text.split()] for text in printed)
    assert len(expected) == 4 and plain == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_functions_that_enclose_different_numbers_are_kept_apart_by_processes(tmp_path):
    """Each process compiles one of them first; a third one reads them from the cache and finds each in its memory."""
    (tmp_path / "variants.py").write_text(VARIANTS)
    paths = os.pathsep.join([str(tmp_path), str(Path(fem.__file__).parents[1])])
    environment = os.environ | {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path)}
    for factors, expected in (("2", ([2.0], 0, 1)), ("3", ([3.0], 0, 1)), ("2, 3", ([2.0, 3.0], 2, 2))):
        script = f"from variants import results; print(results({factors}))"
        process = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert process.stdout.strip() == str(expected), process.stderr


@pytest.mark.parametrize("enclosed", [abs, 2.0, (2, 3)], ids=["function", "float", "tuple"])
def test_functions_that_enclose_more_than_whole_numbers_are_refused(enclosed):
    """They would get a new name in every session and miss the cache, or share it with other code."""

    def product(x):
        return enclosed * x

    with pytest.raises(TypeError, match=r"product may enclose whole numbers only.*got enclosed ="):
        numba_cache.kept(product)


#: Results of `VARIANTS` in a process whose user has no entry among those of the system.
NO_ENTRY = """
import os, pwd

def unknown(number):
    raise KeyError(number)

pwd.getpwuid = unknown
from variants import results
print(results(2))
"""


@pytest.mark.parametrize("cache", ["new", "file", None])
def test_compiled_code_moves_with_the_cache_which_may_be_missing(tmp_path, cache):
    """A new folder; a file where it should be; no home. Nothing is written beside the sources."""
    (tmp_path / "sources").mkdir()
    (tmp_path / "sources" / "variants.py").write_text(VARIANTS)
    (tmp_path / "file").write_text("")
    paths = os.pathsep.join([str(tmp_path / "sources"), str(Path(fem.__file__).parents[1])])
    names = {"HOME", "XDG_CACHE_HOME", "EXUGEAR_CACHE", "NUMBA_CACHE_DIR"}
    environment = {name: value for name, value in os.environ.items() if name not in names}
    environment |= {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {"EXUGEAR_CACHE": str(tmp_path / cache)} if cache else {}
    command = [sys.executable, "-c", NO_ENTRY]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert process.stdout.strip() == "([2.0], 0, 1)", process.stderr
    assert process.stderr.count("UserWarning: cache folder") == (cache != "new")
    assert ("set EXUGEAR_CACHE to a folder that can" in process.stderr) == (cache != "new")
    assert bool(list((tmp_path / "new").glob("compiled/*/*.nbi"))) == (cache == "new")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", *["new"] * (cache == "new"), "sources"]
    assert [path.name for path in (tmp_path / "sources").iterdir()] == ["variants.py"]


def test_numba_without_compilation_is_named():
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(Path(fem.__file__).parents[1])}
    for script in ("import fem; fem.static_transmission_error", "import exugear"):
        process = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert "RuntimeError: NUMBA_DISABLE_JIT is set, but exugear runs compiled code only; unset it" in process.stderr


def test_kernels_compile_where_they_cannot_be_cached():
    """Kernels of functions that are in no file."""
    assert numba_cache.kept(eval("lambda x: 2.0 * x"))(3.0) == 6.0
