"""Trains with several outputs, couplings and rotors: published natural frequencies, idle meshes, arguments."""

import numpy as np
import pytest
from modal_boxes import pair_of_shafts
from scenes import INERTIA, K, linear_law
from torsional_trains import R_B, five_discs, geared_train, hidden_low_mode, motor_and_two_rotors

import exugear
from fem.units import rpm

OUTPUTS = {"port": 1000.0, "starboard": 2000.0}
GEARED_TRAIN = (0.0, 10.304, 20.479, 24.423)


def test_geared_train_with_two_outputs_has_the_published_frequencies():
    model = exugear.build(geared_train())
    data = exugear.modes(model, loads=OUTPUTS, drive="free")
    assert data["frequency"].values[:4] == pytest.approx(GEARED_TRAIN, rel=1e-4, abs=1e-9)
    assert data.attrs["idle_stages"] == []
    diagram = exugear.campbell(model, speed=(0.0, 100 * rpm), loads=OUTPUTS, drive="free")
    assert diagram["frequency"].values[:4, 0] == pytest.approx(GEARED_TRAIN, rel=1e-4, abs=1e-9)
    held = exugear.eigenfrequencies(model, loads=OUTPUTS)
    assert held == pytest.approx(exugear.modes(model, loads=OUTPUTS, phase=0.0)["frequency"].values, rel=1e-9)


def test_a_branch_without_load_is_named_and_its_teeth_are_open(tmp_path):
    """The mesh of a single output leaves the other branch as a system of its own, which turns freely."""
    model = exugear.build(geared_train())
    for function in (exugear.modes, lambda model, **given: exugear.campbell(model, speed=(0.0, 10.0), **given)):
        data = function(model, load=1000.0, drive="free")
        assert data.attrs["idle_stages"] == ["turbine-port"]
        assert (data["frequency"].values.reshape(7, -1)[:, 0] == 0).sum() == 2
    data.to_netcdf(tmp_path / "modes.nc")
    with pytest.warns(UserWarning, match=r"meshes \['turbine-port'\] carry no load"):
        open_teeth = exugear.eigenfrequencies(model, load=1000.0)
    assert (open_teeth == 0).sum() == 1
    assert "turbine-port: map over phase, force; idle under 3 N m" in str(exugear.plan(model.gearbox, load=3.0))
    assert "idle under" not in str(exugear.plan(model.gearbox, loads=OUTPUTS))


@pytest.mark.parametrize(
    ("box", "published"),
    [(five_discs, (81.21, 141.21, 378.95, 536.36)), (motor_and_two_rotors, (425.4, 634.1, 3247.2))],
)
def test_chains_and_trees_of_rotors_have_the_published_frequencies(box, published):
    model = exugear.build(box())
    data = exugear.modes(model, load=1.0, drive="free")
    assert data["frequency"].values[1 : 1 + len(published)] == pytest.approx(published, rel=1.5e-4)
    assert data["frequency"].values[0] == 0.0
    shafts = {shaft.name: [rotor.name for rotor in shaft.rotors] for shaft in model.gearbox.shafts}
    assert {name: [*data["shaft"].values[data["rotor_of"].values == name]] for name in shafts} == shafts


@pytest.mark.parametrize("box", [five_discs, motor_and_two_rotors])
@pytest.mark.parametrize("drive", [30.0, exugear.Torque(2.0)])
def test_energy_of_all_rotors_and_couplings_is_booked(box, drive):
    model = exugear.build(box())
    drives, loads = {"fast": drive}, {"slow": (1.0, 2.0)}
    run = exugear.run(model, drives=drives, loads=loads, duration=2e-3, power=True, progress=False)
    assert run.energy_balance().relative < 1e-6
    assert {*run.data["rotor"].values} == {*model.rotor_spins}


def test_a_drive_bears_the_loads_of_all_rotors():
    """A second rotor on the driving shaft is loaded by its name; the mesh transmits the other load alone."""
    model = exugear.build(motor_and_two_rotors())
    loads = {"slow": 3.0, "fast rotor 2": 2.0}
    data = exugear.run(model, drives={"fast": 20.0}, loads=loads, duration=2e-3, progress=False).data
    assert data["drive_torque"].mean().item() == pytest.approx(5.0, rel=1e-6)
    assert data["mesh_force"].mean().item() * R_B == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize("gear", [1e-1, 1e-3, 1e-5, 1e-7])
def test_a_small_inertia_hides_no_low_mode(gear):
    """Down to 1e-6 of the highest frequency and below; only motions that strain nothing are 0."""
    box, expected = hidden_low_mode(gear)
    data = exugear.modes(exugear.build(box), load=0.1, drive="free")
    assert data["frequency"].values == pytest.approx(expected, rel=max(2 * gear, 1e-7), abs=1e-9)
    assert (data["frequency"].values == 0).tolist() == [True, False, False]


@pytest.mark.parametrize("load", [100.0, 1e-3, 1e-5])
def test_light_loads_have_the_whole_stiffness(load):
    """Differences across the loss of contact would give down to half of it."""
    model, expected = pair_of_shafts(), np.sqrt(K * R_B**2 / INERTIA) / (2 * np.pi)
    assert exugear.eigenfrequencies(model, load=load) == pytest.approx([expected], rel=1e-6)
    assert exugear.modes(model, load=load)["mesh_stiffness"].item() == pytest.approx(K, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"load": 1.0, "loads": OUTPUTS}, "load and loads are both given"),
        ({"loads": {"bow": 1.0}}, r"loads: no shafts \['bow'\]; the shafts are"),
        ({"loads": {"turbine": 1.0}}, "shaft 'turbine' drives"),
        ({"loads": {"port": 0.0}}, "loads must be finite and not all 0"),
        ({}, "load must be the torque on the driven shaft"),
    ],
)
def test_loads_that_make_no_sense_are_refused(given, message):
    model = exugear.build(geared_train())
    calls = (
        exugear.modes,
        exugear.eigenfrequencies,
        lambda model, **given: exugear.campbell(model, speed=(0.0, 1.0), **given),
        lambda model, **given: exugear.steady_states(model, speed=(1.0, 2.0), **given),
        *([lambda model, **given: exugear.plan(model.gearbox, **given)] if given else []),
    )
    for call in calls:
        with pytest.raises(ValueError, match=message):
            call(model, **given)


def test_arguments_after_the_model_are_keywords():
    """Calls by position of version 0.1.0 still work, with a warning."""
    model = pair_of_shafts(law=linear_law())
    with pytest.warns(DeprecationWarning, match=r"campbell takes all .* by their names: write load=..., speed=..."):
        by_position = exugear.campbell(model, 150.0, (0.0, 100.0))
    assert by_position.identical(exugear.campbell(model, speed=(0.0, 100.0), load=150.0))
    for call in (exugear.modes, exugear.eigenfrequencies):
        with pytest.raises(TypeError, match="takes all arguments after the first one by their names"):
            call(model, 150.0)
    with pytest.raises(TypeError, match=r"\['load'\] twice"):
        exugear.campbell(model, 150.0, load=150.0)
