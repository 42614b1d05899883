"""The plan of the house: folders import from earlier folders only; inside a folder imports make no circle."""

import ast
import subprocess
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Folders in the order of the pipeline: each imports from those before it.
FOLDERS = (
    "fem/support",
    "fem/linalg",
    "fem/microgeometry",
    "fem/gear",
    "fem/pair",
    "fem/elasticity",
    "fem/contact",
    "fem/ste",
    "fem/stress",
    "fem/reference",
    "fem/housing",
    "exugear/mesh_force",
    "exugear/rolling_bearings",
    "exugear/gearbox",
    "exugear/contact",
    "exugear/operation",
    "exugear/exchange",
    "exugear/planning",
    "exugear/multibody",
    "exugear/running",
    "exugear/modal",
    "exugear/steady_state",
    "exugear/signals",
    "exugear/load_factors",
    "exugear/study",
    "exugear/plots",
    "exugear/reporting",
)
#: Modules on the packages themselves, and the packages' own lists of names: before and after all folders.
FIRST, LAST = {"fem.units"}, {"fem", "exugear", "exugear.plots"}
APART = {("fem/reference", "fem/stress"), ("fem/microgeometry", "fem/linalg"), ("fem/gear", "fem/linalg")}
#: What exugear may import from fem; `exugear.reporting.graphics` draws the outline of `fem.gear.tooth_profile`.
DOORS_TO_FEM = {
    *("fem.microgeometry.flank", "fem.microgeometry.modification"),
    *("fem.ste.transmission", "fem.pair.iso6336", "fem.gear.pinion_cutter"),
    *("fem.units", "fem.support", "fem.gear.gear", "fem.gear.involute", "fem.gear.material", "fem.gear.tooth_profile"),
    "fem.gear.rim_support",
    *(
        "fem.pair.pair",
        "fem.pair.offsets",
        "fem.pair.placement",
        "fem.ste.ste_map",
        "fem.ste.map_without_ring_modes",
        "fem.ste.load_interpolation",
    ),
    "fem.housing.reduced_housing",
    *("fem.contact.resolution", "fem.microgeometry.deviation", "fem.pair.mirror_image", "fem.stress.load_distribution"),
    "fem.stress.flank_measures",
    *("fem.ste.map_sides", "fem.ste.te_measures", "fem.stress.fields", "fem.stress.cycle_fields"),
}
FENCES = {
    # A housing is no gear: its mesh, elements and modes share nothing with those of teeth.
    "skfem": {"fem/elasticity", "fem/stress", "fem/reference", "fem/housing"},
    "exudyn": {"exugear/multibody", "exugear/reporting"},
    "matplotlib": {"exugear/plots", "exugear/reporting"},
}
#: Modules of the reports and pictures that use these libraries.
MODULES_OF_REPORTING = {
    "exudyn": {"graphics", "viewer"},
    "matplotlib": {"animation", "document"},
}
TOP_LEVEL = {"pyproject.toml", "exugear", "fem", "tests", "examples", "README.md", "LICENSE"}


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_name(path): path for package in ("fem", "exugear") for path in (ROOT / package).rglob("*.py")}


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported(path: Path) -> frozenset[str]:
    """Absolute names of all that a module imports; ``from a import b`` counts as ``a.b`` where that is a module."""
    names = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports by dots: write the whole name"
            names |= {f"{node.module}.{alias.name}" for alias in node.names} & MODULES.keys() or {node.module}
    return frozenset(names)


def folder_of(module: str) -> str:
    path = MODULES[module]
    return path.parent.relative_to(ROOT).as_posix()


ORDINARY = sorted(MODULES.keys() - FIRST - LAST)


def test_all_folders_are_seen():
    """A glob that misses folders would let all other tests here pass."""
    assert {folder_of(name) for name in MODULES} == {*FOLDERS, "fem", "exugear"}


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_folder_says_what_it_holds(folder):
    docstring = ast.get_docstring(tree(ROOT / folder / "__init__.py"))
    assert docstring.endswith(".")
    assert "\n" not in docstring


def test_imports_point_to_earlier_folders():
    later, apart = {}, {}
    for module in ORDINARY:
        home = folder_of(module)
        folders = {folder_of(name) for name in imported(MODULES[module]) if name in MODULES and name not in FIRST}
        later[module] = {folder for folder in folders - {home} if FOLDERS.index(folder) > FOLDERS.index(home)}
        apart[module] = {(home, folder) for folder in folders} & APART
    assert {module: folders for module, folders in later.items() if folders} == {}
    assert {module: pairs for module, pairs in apart.items() if pairs} == {}


@pytest.mark.parametrize("folder", FOLDERS)
def test_imports_inside_a_folder_make_no_circle(folder):
    inside = {name for name in MODULES if folder_of(name) == folder}
    TopologicalSorter({name: imported(MODULES[name]) & inside for name in inside}).prepare()


def test_exugear_enters_fem_by_its_doors():
    beside = {}
    for module in (name for name in ORDINARY if name.startswith("exugear")):
        ours = {name for name in imported(MODULES[module]) if name.split(".")[0] == "fem"}
        beside[module] = {name for name in ours if name not in DOORS_TO_FEM and not name.startswith("fem.support.")}
    assert {module: names for module, names in beside.items() if names} == {}


def test_fem_does_not_import_exugear():
    names = {name for module, path in MODULES.items() if module.startswith("fem") for name in imported(path)}
    assert "exugear" not in {name.split(".")[0] for name in names}


def test_big_libraries_stay_behind_their_fences():
    for module in ORDINARY:
        libraries = {name.split(".")[0] for name in imported(MODULES[module])}
        for library in FENCES.keys() & libraries:
            assert folder_of(module) in FENCES[library], (module, library)
            if folder_of(module) == "exugear/reporting":
                assert module.split(".")[-1] in MODULES_OF_REPORTING[library], (module, library)


def test_no_module_asks_for_the_system_with_drive_and_load():
    """Asking adds them to the system, whose steps they slow down: exugear itself takes `bare_mbs`."""
    doors = {"exugear.multibody.model", "exugear.multibody.drive_items"}
    asking = {
        f"{module_name(path)}:{node.lineno}"
        for path in (ROOT / "exugear").rglob("*.py")
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Attribute) and node.attr == "mbs" and module_name(path) not in doors
    }
    assert not asking


def test_no_draws_are_shared_between_tests():
    """Else what a test draws depends on the tests before it, which are others in half of the tests."""
    shared = {
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in (ROOT / "tests").rglob("*.py")
        for node in tree(path).body
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call)
        and ast.unparse(node.value.func).startswith("np.random.")
    }
    assert not shared


def test_top_level_holds_nothing_else():
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listing = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    entries = {name.split("/")[0] for name in listing.splitlines()}
    assert {name for name in entries if not name.startswith(".")} <= TOP_LEVEL
