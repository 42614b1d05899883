"""Gearboxes as data: bearings, shafts, stages, and the gear train that they form."""
