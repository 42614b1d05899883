"""Compiled mesh forces of one pair: kinematics, forces on the bodies, what is recorded. No Exudyn."""
