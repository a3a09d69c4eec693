"""Compiled time steps of the field (numba). The plain twin is `continuum.collocation`."""
