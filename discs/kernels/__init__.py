"""Compiled forms (numba) of chains, loads and the driver of integrators; each has a plain twin in NumPy and SciPy."""
