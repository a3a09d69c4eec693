"""The chains and integrators in compiled form (numba), each the twin of a plain one in NumPy and SciPy."""
