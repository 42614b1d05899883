"""What designers and machines take off the involute: modifications, deviations, the flank they add up to."""
