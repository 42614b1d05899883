"""The gearbox as an assembled Exudyn system: its matrices, equilibrium, eigenfrequencies, imposed speed and torques."""
