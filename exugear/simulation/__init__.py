"""From the gearbox to a run: Exudyn model, static equilibrium, drive and load, time integration, its data."""
