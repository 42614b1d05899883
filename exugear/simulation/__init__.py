"""From the built model to a run: integrator settings, time integration in segments, data of the run, efficiency."""
