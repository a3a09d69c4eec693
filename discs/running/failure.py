"""The error of a run that failed."""

import numpy as np


class SimulationError(RuntimeError):
    """A run that failed.

    Attributes
    ----------
    step, time, disc : where it failed.
    slope : |r'| of a disc that lost its heading, one step before; NaN for other causes.
    """

    def __init__(self, message: str, step: int, time: float, disc: int, slope: float = np.nan) -> None:
        super().__init__(f"{message} (step {step}, time {time:g}, disc {disc})")
        self.message, self.step, self.time, self.disc, self.slope = message, step, time, disc, slope

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.message, self.step, self.time, self.disc, self.slope)
