"""The gearbox as an Exudyn system: bodies, contacts, bearings, drives, equilibrium and time integration."""
