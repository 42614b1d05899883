"""Two gears on two bodies: their relative position, the compiled force of their mesh with friction."""
