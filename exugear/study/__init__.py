"""Many designs: sweeps over cases, tolerances and optimal flanks."""
