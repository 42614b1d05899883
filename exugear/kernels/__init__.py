"""Compiled kinematics of a gear pair: from its bodies' coordinates to deflection, forces, friction and samples."""
