"""Where the power of a run goes: motion of the shafts, stored energy, losses, and the balance over any window."""
