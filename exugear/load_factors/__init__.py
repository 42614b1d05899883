"""Dynamic factors and dynamic stresses of runs."""
