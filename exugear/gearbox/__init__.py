"""Gearboxes as data: bearings, shafts, stages, the gear train they form."""
