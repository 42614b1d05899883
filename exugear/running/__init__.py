"""From the built model to a run: parts side by side, labelled data, energy balance, efficiency."""
