"""Limits that compiled and plain forms share; here because what kernels are cached under covers this folder."""

LOST_HEADING = 1e-3  # |r'| below which a disc of the unit law has lost its heading
TURNED = 1.0  # radians that a heading turns by in one step, and the step is compared: whole turns would not show
