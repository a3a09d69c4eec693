"""What a run tells of itself."""

from typing import Any, TypedDict, cast


class Stats(TypedDict, total=False):
    """`Solution.stats`: what was done and what it took, a dictionary; a solver tells what it knows.

    A file may hold more, and other kinds than these where `discs.files.untrusted` does not check them.
    """

    # what was asked for and chosen
    method: str
    order: int | None  # None where it is chosen on the way
    settings: str  # the integrator with all its settings, as Python writes it
    engine: str  # "compiled" or "plain"
    want: list[str]
    dt: float  # time step
    dt_suggested: bool  # whether nobody gave it
    tol: float | dict[str, float]  # the tolerance asked for
    attempts: int  # runs that were made to reach it
    limited_by: str  # what made the run as accurate as it is: "tolerance", "fewest steps" or "sweeps", see `running.tolerance`

    # what it took
    steps: int
    short_steps: int  # those to frames between two steps; only where some did not converge
    gradients: int  # evaluations of grad V
    solves: int  # banded linear systems
    iterations: int  # of Newton's method, by a peer
    seconds: float

    # how far it is to be trusted
    unconverged: int  # steps whose sweeps did not converge
    converging_dt: float  # a step with which they would
    step_error: float  # estimated error of positions and angles by the steps, relative
    frames_missing: int  # of a run that was interrupted
    lean: float  # of a peer's wheels, rad

    # of a field, and of a textbook's disc
    scene: dict[str, Any]  # name, laws, duration and parameters, see `continuum.told`
    functions: int  # of a spectral basis
    elements: int
    nodes: int
    radius: float


def of_search(stats: Stats) -> Stats:
    """What the stats of a run tell of the search for its step."""
    return cast(Stats, {name: value for name, value in stats.items() if name in ("tol", "attempts", "limited_by")})
