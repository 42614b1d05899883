"""Time integration of a run: solver settings, segments side by side, error by the step, samples as labelled data."""
