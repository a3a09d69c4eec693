"""The whole steps before a time, and the rest of the time. A time within NEAR steps of a step counts as the step."""

import numpy as np

from discs.arrays import Float, Int

MOST_STEPS = 2.0**53
NEAR = 1e-9
UP = 1 + 4e-16  # a quotient of two doubles may be rounded down


def check_steps(end: float, h: float) -> None:
    """ValueError if there are more steps of length h to a time than can be counted."""
    if end / h > MOST_STEPS:
        raise ValueError(f"dt = {h:g} makes {end / h:.1g} steps to t = {end:g}, more than can be counted: take a larger dt")


def steps_before(time: float, h: float) -> tuple[int, float]:
    """The number of whole steps before a time, and the remaining time."""
    steps = int(time / h * UP + NEAR)
    rest = time - steps * h
    return steps, rest if rest > NEAR * h else 0.0


def all_steps_before(times: Float, h: float) -> tuple[Int, Float]:
    """The same of times (F,): (F,) each."""
    steps = (times / h * UP + NEAR).astype(np.int64)
    rests: Float = times - steps * h
    rests[rests <= NEAR * h] = 0.0
    return steps, rests
