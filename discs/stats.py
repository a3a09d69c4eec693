"""`Solution.stats`: settings, cost and error estimates of a run."""

from collections.abc import Sequence
from typing import Any, TypedDict, cast

from discs.integrators import Integrator

STEP_ERROR_WARNING = 0.05  # relative `step_error` above which a run may not be trusted


class Stats(TypedDict, total=False):
    """`Solution.stats`, a dictionary: settings, cost and error estimates. A solver fills in the entries that it knows.

    A file may hold further entries, and values of other types where `discs.files.untrusted` does not check them.
    """

    # settings
    method: str
    order: int | None  # None where the solver varies it
    settings: str  # the integrator with all its settings, as Python writes it
    engine: str  # "compiled" or "plain"
    plain_because: str  # why it is "plain"
    threads: int  # of its steps, if there is more than one
    want: list[str]
    dt: float  # time step; of adaptive methods the longest
    dt_suggested: bool  # whether dt was chosen by `suggest_dt`
    tol: float | dict[str, float]  # the tolerance asked for
    attempts: int  # runs made to reach the tolerance
    events: list[tuple[str, float]]  # name and time of each event
    limited_by: str  # what determined the accuracy: "tolerance", "fewest steps" or "sweeps", see `discs.running.tolerance`

    # cost
    steps: int  # of adaptive methods those taken, not those tried
    short_steps: int  # steps to frames between two steps; given only if some steps did not converge
    gradients: int  # evaluations of grad V
    solves: int  # banded linear systems
    iterations: int  # of Newton's method, by a peer
    seconds: float

    # trust
    unconverged: int  # steps whose sweeps did not converge
    converging_dt: float  # a time step with which they converge
    step_error: float  # estimated relative error of positions and angles due to the time step
    frames_missing: int  # frames not written, of an interrupted run
    lean: float  # largest lean angle of the wheels, of a peer, rad

    # of a field and of a single disc
    scene: dict[str, Any]  # name, laws, duration and parameters: `Scene.description` of `continuum.rod`
    functions: int  # of a spectral basis
    elements: int
    nodes: int
    radius: float
    linkage: bool  # whether it is the run of a linkage


def begun(integrator: Integrator, because: str, want: Sequence[str], dt: float, suggested: bool, threads: int = 1) -> Stats:
    """The entries of stats that are known at the start of a run. because : why it is plain; empty if it is compiled.

    threads : of its steps, if it is compiled.
    """
    found: Stats = {
        "method": integrator.name,
        "order": integrator.order,
        "settings": integrator.settings,
        "engine": "plain" if because else "compiled",
        "want": list(want),
        "dt": dt,
        "dt_suggested": suggested,
    }
    if because:
        found["plain_because"] = because
    elif threads > 1:
        found["threads"] = threads
    return found


def doubts(stats: Stats) -> list[str]:
    """Reasons not to trust a run, in words, from its stats."""
    found = []
    if stats.get("unconverged") and (stuck := _number(stats["unconverged"])):
        steps = _number(stats.get("steps")) + _number(stats.get("short_steps"))
        found.append(f"{stuck} of {steps} steps did not converge")
    error = stats.get("step_error")
    if isinstance(error, float) and error > STEP_ERROR_WARNING:
        off = f"by about {100 * error:.0f} %" if error < 1 else "by 100 % or more"
        found.append(f"dt = {_number(stats.get('dt')):.3g} is too long for this motion, positions or angles may be off {off}")
    return found


def _number(value: object) -> float:
    """A value of stats if it is a number, otherwise 0: a file may hold anything."""
    return value if isinstance(value, int | float) else 0


def of_search(stats: Stats) -> Stats:
    """The entries of stats about the search for a step."""
    return cast(Stats, {name: value for name, value in stats.items() if name in ("tol", "attempts", "limited_by")})
