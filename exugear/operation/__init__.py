"""Operating conditions as data: speeds and torques of the shafts, conditions that end a run, torques as tables."""
