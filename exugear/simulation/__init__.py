"""From the built model to a run; steady powers and efficiency from short runs."""
