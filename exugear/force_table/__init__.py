"""The packed table of a mesh force, and the compiled kernels that read it."""
