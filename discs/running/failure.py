"""The error of a run that failed, and its words."""

from typing import Any

import numpy as np

from discs.integrators import Integrator
from discs.integrators.work import Frame


class SimulationError(RuntimeError):
    """A run that failed.

    Attributes
    ----------
    message : what happened, the likely cause and what to do. step, time, disc : where it failed.
    slope : |r'| of a disc that lost its heading, one step before; NaN for other causes.
    """

    def __init__(self, message: str, step: int, time: float, disc: int, slope: float = np.nan) -> None:
        super().__init__(f"{message} (step {step}, time {time:g}, disc {disc})")
        self.message, self.step, self.time, self.disc, self.slope = message, step, time, disc, slope

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.message, self.step, self.time, self.disc, self.slope)


class NotReached(SimulationError):
    """A tolerance that was not reached.

    Parameters
    ----------
    tol, worst, dt : the tolerance, and the error in units of it with steps dt.
    floor : what rounding makes of it, in the same units; None if it is not the limit.
    best : the run with steps dt. runs : how many were made.
    held_until : the time from which on no step holds the tolerance (`discs.running.held`), or, where rounding is the limit, the
        first frame at which it does not; infinite if none is known.

    Attributes
    ----------
    best : the last run with an estimate of its error. held_until : see above.
    """

    def __init__(
        self, tol: float, worst: float, dt: float, floor: float | None, best: Any, runs: int, held_until: float = np.inf
    ) -> None:
        what = f"tol = {tol:g} was not reached: the error is estimated at {tol * worst:.1e} with dt = {dt:g}"
        if floor is not None:
            why = f"and rounding of positions and sweeps changes a run by {tol * floor:.1e}, so rounding is the limit; "
            why += "take a larger tol, or end the run earlier"
            why += f", before t = {held_until:.3g}" if held_until < best.t[-1] else ""
        elif np.isfinite(held_until):
            what = f"tol = {tol:g} can be held until about t = {held_until:.3g} only, not until t = {best.t[-1]:g}, with any step"
            why = "because a change of the last place of the initial state grows to the tolerance in that time; "
            why += "end the run earlier, or take a larger tol, which holds a little longer, or give dt if only energies and "
            why += "averages matter"
        else:
            why = f"and {runs} runs with smaller and smaller steps were made; take a larger tol or another method"
        super().__init__(f"{what}, {why}", best.stats["steps"], best.t[-1], 0)
        self.best, self.held_until, self._given = best, held_until, (tol, worst, dt, floor, best, runs, held_until)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), self._given


def lost_heading(law: str | None, step: int, time: float, disc: int, slope: float) -> SimulationError:
    """The error of a run in which |r'| of a disc vanishes; it was `slope` one step before."""
    said = (
        f"a disc lost its heading: its neighbours met, r' = 0, and rolling={law!r} has no direction there; "
        "end the run earlier, or take a smaller dt if the motion is not resolved"
    )
    return SimulationError(said, step, time, disc, slope)


def blown_up(
    integrator: Integrator, h: float, kinetic: float, frame: Frame, unconverged: int, step: int, time: float
) -> SimulationError:
    """The error of a run whose kinetic energy is too large at a frame, after a number of unconverged steps."""
    speed = np.abs(frame.rate[2])
    disc = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf)))
    if np.isfinite(integrator.stability_limit):
        cause = f"dt = {h:g} is above the stability limit of {integrator.name!r}: take a smaller dt or 'midpoint'"
    elif unconverged:
        cause = f"dt = {h:g} is too large for the iteration to converge: take a smaller dt or 'midpoint'"
    else:
        cause = "rounding dominates the steps: take a smaller dt, fewer discs or softer springs"
    what = "kinetic energy above ten times the total" if np.isfinite(kinetic) else "values are not finite"
    return SimulationError(f"the run blew up, {what}; likely {cause}", step, time, disc)
