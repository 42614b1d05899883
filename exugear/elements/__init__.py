"""Gear contacts, friction, sensors, shafts and bearings as objects of an Exudyn system."""
