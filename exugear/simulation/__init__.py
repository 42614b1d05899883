"""From the gearbox to a run: built model, static equilibrium, drive and load, time integration, data of the run."""
