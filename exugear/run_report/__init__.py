"""Report of a run: inputs, assumptions, errors, figures and tables as one HTML page, and as PDF."""
