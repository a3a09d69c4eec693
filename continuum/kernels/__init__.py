"""The field's time steps in compiled form (numba), the twin of a plain form in NumPy."""
