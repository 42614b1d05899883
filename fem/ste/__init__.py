"""Static transmission error maps over phase, torque and offsets, with estimated errors."""
