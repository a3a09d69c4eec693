"""Frames of a run: their times, the steps before each, and the recorded quantities."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.integrators.work import Frame
from discs.loads.motor import Held
from discs.running.time_loop import March

WANTS = ("velocity", "slope", "contact_force", "work_by_load")
ROUNDING = 1e-12  # relative to the duration: a time beyond the end by less counts as the end


def frame_times(frames: int | ArrayLike, duration: float) -> Float:
    """The times of frames, (F,), from their number or their times, see `simulate`; ValueError for others.

    A time beyond the duration by no more than rounding counts as its end: `np.arange(0, 0.35, 0.1)` ends just above 0.3.
    """
    if type(frames) is int and frames == 1:
        return np.array([duration])
    if type(frames) is int or (not isinstance(frames, (list, tuple)) and np.ndim(frames) == 0):
        count = checks.whole("frames", frames, 1, "the last state is always one")
        if count == 1:
            return np.array([duration])
        checks.fits(f"frames = {count}", count)
        return np.linspace(0.0, duration, count)
    need = f"increasing times within [0, {duration:g}], or their number"
    times = checks.array("frames", frames, need)
    if times.ndim == 1 and times.size and times[0] >= 0 and times[-1] <= duration and (times[1:] > times[:-1]).all():
        return times
    near = np.clip(times, 0.0, duration)
    times = np.where(np.abs(times - near) <= ROUNDING * duration, near, times)
    if times.ndim != 1 or not times.size or not np.isfinite(times).all():
        raise ValueError(f"frames must be {need}; got {checks.shown(frames)}")
    if times[0] < 0 or times[-1] > duration or (np.diff(times) <= 0).any():
        raise ValueError(f"frames must be {need}; got {times.min():.17g} to {times.max():.17g}: {checks.shown(frames)}")
    return times


def wanted(want: Iterable[str], offers: tuple[str, ...]) -> tuple[str, ...]:
    """The names in `want`, checked; ValueError for one that is neither in `WANTS` nor in `offers` of the method."""
    given = checks.several("want", want, "names of quantities")
    return tuple(checks.choice("want", name, (*WANTS, *offers)) for name in given)


def observed(march: March, tau: float) -> dict[str, Any]:
    """The quantities recorded at a frame, a time tau after the last step."""
    frame = march.frame(tau)
    t = march.step * march.h + tau
    found = march.observe(t, frame)
    if march.plan.want:
        found |= asked(march, frame, t, march.plan.want, found)
    if march.plan.offered:
        found |= march.integrator.extras(march.system, march.memory, march.h)
    return found


def asked(march: March, frame: Frame, t: float, want: tuple[str, ...], seen: dict[str, Any]) -> dict[str, Any]:
    """The quantities in `want`, at a frame where those in `seen` are known."""
    system, rate = march.system, frame.rate
    shape = system.shape(frame.hi, frame.lo)
    found: dict[str, Any] = {}
    if "velocity" in want:
        found |= {"x_rate": rate[0], "y_rate": rate[1]}
    if "slope" in want:
        found |= dict(zip(("slope_x", "slope_y"), system.slope(shape), strict=True))
    if "contact_force" in want:
        f = 0.0 if system.load is None else system.load.applied(t, frame.hi + frame.lo, rate)
        if isinstance(system.load, Held):
            f = np.array(f)
            f[system.load.where] += seen["reaction"]
        found["contact_force"] = system.contact_force(shape, rate, f)
    return found
