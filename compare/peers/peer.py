"""Peers: their settings from loose to tight, and the result and cost of a run."""

from collections.abc import Callable
from typing import NamedTuple

from discs.arrays import Float


class Cutoff(Exception):
    """A run exceeded its time."""


class Outcome(NamedTuple):
    """Where a peer ended: positions (rows, n), its steps, right-hand sides, linear solves or factorisations (None: unknown),
    seconds, momenta where it has them."""

    q: Float
    steps: int
    gradients: int
    solves: int | None
    seconds: float
    pi: Float | None = None


class Peer(NamedTuple):
    """A peer with its settings, from loose to tight.

    name : as in the table. settings : its tolerances or steps. run : (setting, seconds that it may take) -> Outcome.
    tells : how its problem differs.
    """

    name: str
    settings: tuple[float, ...]
    run: Callable[[float, float], Outcome]
    tells: str = ""


TOLERANCES = tuple(10.0**-k for k in range(2, 12))
THIRDS = tuple(10.0 ** (-k / 3) for k in range(5, 31))  # three in a decade: a method may miss an error narrowly at one of them
