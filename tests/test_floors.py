"""The plan of the house: every module has a floor and imports only from lower ones."""

import ast
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FLOORS = {
    "fem.units": 0,
    "fem.version": 0,
    "fem.representation": 0,
    "fem.data_sheet": 0.1,
    "fem.inspection": 0.5,
    "fem.cache": 0.1,
    "fem.compiled": 0.1,
    "fem.threads": 0,
    "fem.progress": 0,
    "fem.groups": 0.1,
    "fem.fronts": 0.2,
    "fem.solver": 0.4,
    "fem.modification": 0.1,
    "fem.deviation": 0.2,
    "fem.flank": 0.4,
    "fem.checks": 0,
    "fem.arguments": 0.05,
    "fem.grading": 0,
    "fem.root": 0,
    "fem.material": 0.4,
    "fem.cylindrical": 0.6,
    "fem.interference": 0.7,
    "fem.pair": 0.8,
    "fem.gear": 1,
    "fem.profile": 2,
    "fem.ste": 2,
    "fem.iso6336": 2,
    "fem.meeting": 2,
    "fem.mesh": 3,
    "fem.hertz": 2,
    "fem.hats": 0,
    "fem.loaded_width": 3.2,
    "fem.half_space": 3.5,
    "fem.gap": 3,
    "fem.strips": 4,
    "fem.prism": 3,
    "fem.solid": 3.2,
    "fem.touch": 3,
    "fem.body": 4,
    "fem.compliance": 4,
    "fem.offsets": 2,
    "fem.contact": 5,
    "fem.slices": 3,
    "fem.state": 5.5,
    "fem.sweep": 5.6,
    "fem.load_interpolation": 0,
    "fem.error_estimation": 5.65,
    "fem.accuracy": 5.7,
    "fem.transmission": 6,
    "fem.cost": 6.1,
    "fem.nonlinear": 6.1,
    "fem.dynamic": 6.2,
    "fem.penalty": 4.5,
    "fem.explicit": 6.3,
    "fem.loads": 5.8,
    "fem.elastic": 5.9,
    "fem.recovery": 6,
    "fem.stress": 6.2,
    "fem.root_stress": 6.3,
    "fem": 6.5,
    "exugear.law": 6.6,
    "exugear.loaded": 6.6,
    "exugear.monotone": 6.7,
    "exugear.map_range": 6.7,
    "exugear.table": 6.8,
    "exugear.force": 7,
    "exugear.divergence": 7.05,
    "exugear.friction": 7.05,
    "exugear.items": 7,
    "exugear.ring": 7,
    "exugear.bearing": 7,
    "exugear.walk": 7,
    "exugear.shaft": 7.1,
    "exugear.damping": 7.15,
    "exugear.stage": 7.2,
    "exugear.layout": 7.3,
    "exugear.alignment": 7.3,
    "exugear.clocking": 7.4,
    "exugear.gearbox": 7.5,
    "exugear.course": 7,
    "exugear.spectrum": 7,
    "exugear.recorded": 7.1,
    "exugear.plots": 7.5,
    "exugear.pictures": 7.5,
    "exugear.graphics": 7.5,
    "exugear.derivatives": 8,
    "exugear.kinematics": 8,
    "exugear.attitude": 8,
    "exugear.contact_frame": 8.2,
    "exugear.recorder": 8,
    "exugear.kernels": 8.5,
    "exugear.sliding": 8.6,
    "exugear.trampoline": 8.6,
    "exugear.trial": 8.7,
    "exugear.native": 8.7,
    "exugear.connector": 9,
    "exugear.sensor": 9.1,
    "exugear.axes": 9.2,
    "exugear.seats": 9.2,
    "exugear.bodies": 9.4,
    "exugear.friction_connector": 9.1,
    "exugear.reach": 9.5,
    "exugear.integrator": 9.6,
    "exugear.steps": 7,
    "exugear.jumps": 6.9,
    "exugear.plan": 10,
    "exugear.model": 11,
    "exugear.equilibrium": 11.5,
    "exugear.imposed": 11.6,
    "exugear.eigenfrequencies": 11.7,
    "exugear.pieces": 11.7,
    "exugear.valid_samples": 11.8,
    "exugear.viewer": 12,
    "exugear.run": 12,
    "exugear": 13,
}
#: `fem.profile` is the outline that `exugear.graphics` draws.
DOORS_TO_FEM = {
    *("fem.arguments", "fem.units", "fem.cache", "fem.compiled", "fem.gear", "fem.ste", "fem.offsets", "fem.profile"),
    *("fem.progress", "fem.representation", "fem.version", "fem.load_interpolation"),
}
EXUDYN = (
    *("bodies", "connector", "eigenfrequencies", "equilibrium", "friction_connector", "graphics"),
    *("imposed", "integrator", "model", "native", "pieces", "plan", "run", "seats", "sensor", "trampoline", "trial"),
)
FENCES = {
    "skfem": {
        *("fem.mesh", "fem.prism", "fem.compliance", "fem.loads", "fem.elastic", "fem.recovery", "fem.stress"),
        *("fem.root_stress", "fem.solid", "fem.body", "fem.nonlinear", "fem.dynamic", "fem.explicit"),
    },
    "exudyn": {f"exugear.{name}" for name in EXUDYN},
    "matplotlib": {"exugear.plots", "exugear.pictures"},
}
TOP_LEVEL = {"pyproject.toml", "exugear", "fem", "tests", "examples", "README.md", "LICENSE"}


def module_name(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported(path: Path) -> set[str]:
    """Absolute names of all that a module imports; ``from a import b`` counts as ``a.b`` where that is a module."""
    package = path.parent.name
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(filter(None, [package if node.level else "", node.module or ""]))
            modules = {f"{base}.{alias.name}" for alias in node.names} & FLOORS.keys()
            names |= modules or {base}
    return names


MODULES = {module_name(path): path for package in ("fem", "exugear") for path in (ROOT / package).glob("*.py")}


def test_every_module_has_a_floor():
    assert MODULES.keys() <= FLOORS.keys()


@pytest.mark.parametrize("module", sorted(MODULES))
def test_imports_point_down(module):
    ours = {name for name in imported(MODULES[module]) if name in FLOORS}
    assert {name for name in ours if FLOORS[name] >= FLOORS[module]} == set()


@pytest.mark.parametrize("module", sorted(name for name in MODULES if name.startswith("exugear")))
def test_exugear_enters_fem_by_its_doors(module):
    assert {name for name in imported(MODULES[module]) if name.split(".")[0] == "fem"} <= DOORS_TO_FEM


@pytest.mark.parametrize("module", sorted(MODULES))
def test_big_libraries_stay_behind_their_fences(module):
    for library, allowed in FENCES.items():
        if any(name.split(".")[0] == library for name in imported(MODULES[module])):
            assert module in allowed


def test_top_level_holds_nothing_else():
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listing = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    entries = {name.split("/")[0] for name in listing.splitlines()}
    assert {name for name in entries if not name.startswith(".")} <= TOP_LEVEL
