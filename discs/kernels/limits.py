"""Limits for both compiled and plain forms. They are in this folder so that a change of them compiles kernels again."""

LOST_HEADING = 1e-3  # |r'| below which a disc of the unit law has no heading
TURNED = 1.0  # rad; a step in which a heading turns by more is compared, as whole turns do not show in its defect
HELD = 1e60  # strength of the damper that stands for a motor: any other entry of its row is below the rounding of this
