"""The motion of the free rod, `free_rod`; the equations and the step are in `continuum.free_system`."""

import warnings

from numpy.typing import ArrayLike
from tqdm import tqdm

from continuum.free_run import compare, nodes, run
from continuum.free_start import Data, Given, check
from continuum.rod import Rod
from discs import Solution, checks
from discs.running.frames import frame_times
from discs.running.whole_steps import check_steps
from discs.stats import Stats

MOST_NODES = 1_000_000


def free_rod(
    rod: Rod,
    r0: Data,
    v0: Data,
    theta0: Data,
    omega0: Data,
    duration: float,
    n: int,
    dt: float,
    closed: bool = False,
    frames: int | ArrayLike = 101,
    progress: bool = True,
    estimate: bool = True,
) -> Solution:
    """The motion of the free inextensible rod, on n nodes.

    Parameters
    ----------
    rod : the rod, uniform, with linear curvature, which is the true one while |r'| = 1. The radius has no effect, as nothing rolls.
    r0, v0 : positions and velocities of the centre line, with |r0'| = 1 and r0' . v0' = 0: functions of s (m,) that return (2, m),
        evaluated between the nodes too, or values at the nodes, (2, n). A frame of an earlier run, (x, y) and (x_rate, y_rate),
        continues that run.
    theta0, omega0 : torsion and its rate: functions of s that return (m,), values (n,), or a number.
    duration : duration, > 0.
    n : number of nodes, at least 3 with both ends counted, at least 5 around a ring; at most a million.
    dt : time step, > 0 and at most the duration. Bending sets no stability limit. For accuracy dt must be a fraction of the
        shortest period that carries energy.
    closed : whether the rod is a ring; otherwise its ends are free.
    frames : number of frames, equally spaced, or their times. A frame between two steps is computed by a shorter step of its own.
    progress : show progress on anything that takes over a second.
    estimate : whether to compute `error_estimate`, by a second run on half the nodes with twice the step. It takes up to half as
        long as the first run.

    Returns
    -------
    Solution with x_rate, y_rate and `tension`, p in the links, (F, n - 1), or (F, n) around a ring. `error_estimate` has the errors
    of x, y, theta, omega, x_rate, y_rate and tension, due to space and time together.

    A warning is given

    * if the energy of the centre line, which the motion conserves, changes by a hundredth; it suggests a dt;
    * if an estimated error is above a twentieth of the largest value of the quantity (of the length, for x and y), or unknown;
    * if the line is bent at a free end at the start, so that velocities or tension have no limit as n grows.

    Raises
    ------
    ValueError : for bad input, or a centre line or velocity that stretches the rod.
    SimulationError : if a step cannot be solved, turns a link by more than a right angle, or raises the energy of the centre line
        above ten times its initial value. The cure is a smaller dt.
    """
    if not isinstance(rod, Rod) or rod.curvature != "linear":
        raise ValueError(f"free_rod needs a Rod with curvature='linear'; got {rod!r}")
    if not rod.uniform("free_rod").spin_inertia:
        raise ValueError("the free rod needs a positive spin_inertia: without rolling, theta has no other inertia; got 0")
    for name, flag in (("closed", closed), ("estimate", estimate)):
        if not isinstance(flag, bool):
            raise ValueError(f"{name} must be True or False; got {flag!r}")
    if checks.whole("n (nodes)", n, 5 if closed else 3) > MOST_NODES:
        raise ValueError(f"n must be at most {MOST_NODES} nodes; got {n}")
    chain = nodes(rod, n, closed)
    duration, h = checks.number("duration", duration, positive=True), checks.number("dt", dt, positive=True)
    times = frame_times(frames, duration)
    if h > duration:
        raise ValueError(f"dt must be at most the duration, {duration:g}; got {h:g}")
    check_steps(times[-1], h)
    r, v = Given("r0", r0, 2, chain), Given("v0", v0, 2, chain)
    start = r, v, Given("theta0", theta0, 1, chain), Given("omega0", omega0, 1, chain)
    words = [check(chain, r, v)]
    with tqdm(desc="free rod", unit="step", delay=1, disable=not progress) as bar:
        done = run(chain, start, h, times, bar)
        errors, doubt = compare(rod, chain, start, h, times, done, bar) if estimate else (None, "")
    for word in (*words, done.off, doubt):
        if word:
            warnings.warn(word, stacklevel=2)
    stats: Stats = {"method": "midpoint and RATTLE", "order": 2, "dt": h, "steps": done.steps}
    return Solution(
        t=times, s=chain.s, energy=done.energy, error_estimate=errors, stats=stats, problem=None, events=(), **done.fields
    )
