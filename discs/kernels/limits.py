"""Limits that compiled and plain forms share; here because what kernels are cached under covers this folder."""

LOST_HEADING = 1e-3  # |r'| below which a disc of the unit law has lost its heading
