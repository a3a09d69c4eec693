"""Where rounding stops the convergence of implicit steps."""

import numpy as np

from discs.chains.rolling_discs import RollingDiscs
from discs.warn import warn


def warn_of_lost_digits(system: RollingDiscs, h: float) -> None:
    """Warn where rounding in solves with I + h^2/4 C^T S C stops the convergence of sweeps.

    A sweep multiplies the remaining error by the largest entry, h^2 `stiffest`, times the unit of rounding, 1.1e-16. Sweeps do not
    converge where this factor is near one.
    """
    lost = 1.1e-16 * h * h * system.stiffest
    if lost > 0.1:
        warn(
            f"{system.n} discs at dt = {h:g}: each sweep of a step leaves {lost:.1g} of its error, due to rounding, and the run "
            f"may not be trusted; take dt below {h * np.sqrt(0.1 / lost):.1g}, or fewer discs"
        )
