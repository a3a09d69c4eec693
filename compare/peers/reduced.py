"""Peers that take a right-hand side, the reduced equations: SciPy and SUNDIALS.

All get the same compiled function, y. = f(t, y) with y = (x, y, theta, pi, ...) disc by disc, bound to its chain and its loads so
that a call has little overhead. Chains without a compiled form (a law in NumPy) get the plain one, as our own methods do.
"""

import time as clock
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from compare.peers import loads, rates
from compare.peers.peer import THIRDS, TOLERANCES, Cutoff, Outcome, Peer
from discs import Problem
from discs.arrays import Float
from discs.integrators.ivp import Reduced


def bound(problem: Problem, y: Float, keep: bool = False) -> Callable[[float, Float, Float], None]:
    """f(t, y, out), compiled for one chain, whose parameters become constants of the code; without a compiled form, in NumPy.

    Compiled once, for arrays like y that must not change, as SUNDIALS hands them over; SciPy's are taken as such. keep : on disc,
    see `compare.peers.held`; without loads.
    """
    if problem.system.parameters is None:
        plain = Reduced(problem.system)

        def in_numpy(t: float, y: Float, out: Float) -> None:
            out[:] = plain(t, y)

        return in_numpy
    from discs.kernels import driver
    from discs.kernels.compiled import jit
    from discs.kernels.lean import lean

    chain, inner = problem.system.parameters, jit(driver.reduced.__wrapped__)  # type: ignore[attr-defined]
    if chain.load.patterns.size:
        at = loads.timed(problem, jit)

        @jit
        def f(t, y, out):  # type: ignore[no-untyped-def]
            inner(at(t), t, y, out)

    elif keep:
        from compare.peers.held import held

        f = held(chain)
    else:

        @jit
        def f(t, y, out):  # type: ignore[no-untyped-def]
            inner(chain, t, y, out)

    with lean():
        f(0.0, read_only(y), np.empty_like(y))
    f.disable_compile()  # type: ignore[attr-defined]
    return f


def read_only(y: Float) -> Float:
    """A read-only copy, like the arrays that SUNDIALS passes to callbacks."""
    y = y.copy()
    y.flags.writeable = False
    return y


class Bound:
    """The right-hand side; it counts its calls and stops a run whose time is up.

    Parameters
    ----------
    f : (t, y, out), None compiles one for the chain, which takes seconds and makes calls a third faster.
    by_rate : the unknowns are omega instead of pi, see `compare.peers.rates`.
    keep : keep the compiled right-hand side on disc.
    """

    def __init__(
        self,
        problem: Problem,
        f: Callable[[float, Float, Float], None] | None = None,
        by_rate: bool = False,
        keep: bool = False,
    ) -> None:
        self.calls, self.until, self.by_rate = 0, np.inf, by_rate
        self.reduced = Reduced(problem.system)
        z = problem.start()
        mass, _, spin = problem.system.weights[:3]
        self.y0 = self.reduced.join(z.hi, np.array(problem.initial.omega) if by_rate else z.pi)
        # pi of a disc scales like the root of its share of the length, and so do the allowed errors
        share = np.ones_like(mass) if by_rate else np.sqrt(np.where(spin > 0, spin, mass))
        self.unit = self.reduced.join(np.ones_like(z.hi), np.ones_like(z.pi) * share)
        self.f = f or (rates.bound(problem, read_only(self.y0)) if by_rate else bound(problem, self.y0, keep))
        self(0.0, self.y0)  # compiled before anything is timed

    def start(self, seconds: float) -> None:
        """Start counting."""
        self.calls, self.until = 0, clock.process_time() + seconds

    def fill(self, t: float, y: Float, out: Float) -> None:
        """SUNDIALS' form. A failed callback is reported by the solver, not raised: NaN makes it stop."""
        self.calls += 1
        if not self.calls & 63:
            self.watch(t)
        self.f(t, y, out)

    def watch(self, t: float) -> None:
        """Stop a run whose time is up; t is the time it has reached."""
        if clock.process_time() > self.until:
            raise Cutoff

    def __call__(self, t: float, y: Float) -> Float:
        """SciPy's form."""
        out = np.empty_like(y)
        self.fill(t, np.ascontiguousarray(y), out)
        return out


def scipy_peers(problem: Problem, f: Bound) -> list[Peer]:
    """The methods of solve_ivp, with the band or the sparsity of the Jacobian."""
    from scipy.integrate import solve_ivp

    known: dict[str, dict[str, Any]] = {name: {} for name in ("RK45", "DOP853")}
    known |= {name: {"jac_sparsity": f.reduced.sparsity()} for name in ("Radau", "BDF")}
    known["LSODA"] = {} if problem.system.closed else {"lband": f.reduced.width, "uband": f.reduced.width}

    def runner(name: str, options: dict[str, Any]) -> Callable[[float, float], Outcome]:
        def run(rtol: float, seconds: float) -> Outcome:
            f.start(seconds)
            begun = clock.process_time()
            span = (0.0, problem.duration)
            with np.errstate(invalid="ignore", over="ignore"):  # BDF also computes with rows of a table that it has not filled yet
                found = solve_ivp(f, span, f.y0, name, t_eval=span[1:], rtol=rtol, atol=0.01 * rtol * f.unit, **options)
            spent = clock.process_time() - begun
            if not found.success:
                raise ArithmeticError(found.message)
            steps = max(1, round(found.nfev / {"RK45": 6, "DOP853": 12}.get(name, 1))) if name in ("RK45", "DOP853") else 0
            end = f.reduced.split(found.y[:, -1])
            return Outcome(end.hi, steps, f.calls, found.nlu or None, spent, end.pi)

        return run

    return [Peer(f"SciPy {name}", TOLERANCES, runner(name, options)) for name, options in known.items()]


def banded(problem: Problem, width: int) -> dict[str, Any]:
    """SUNDIALS' options for the Jacobian: its half-bandwidth, or dense for a ring."""
    return {"linsolver": "dense"} if problem.system.closed else {"linsolver": "band", "lband": width, "uband": width}


def band(problem: Problem, f: Bound) -> dict[str, Any]:
    """As `banded`, with both half-bandwidths of the Jacobian found by changing unknowns at both ends and in the middle."""
    options = banded(problem, f.reduced.width)
    if problem.system.closed:
        return options
    f.start(np.inf)  # the time of the method that ran before is no limit here
    width, size = f.reduced.width, f.y0.size
    y = f.y0 + 1e-3 * np.random.default_rng(1).standard_normal(size)
    lower = upper = 0
    for first in {0, max(0, size // 2 - width), max(0, size - 2 * width)}:
        for j in range(first, min(size, first + 2 * width)):
            changed = y.copy()
            changed[j] += 1e-3
            (found,) = np.nonzero(f(0.0, changed) - f(0.0, y))
            lower, upper = max(lower, int(found.max(initial=j)) - j), max(upper, j - int(found.min(initial=j)))
    return options | {"lband": lower, "uband": upper}


def sundials_peers(problem: Problem, f: Bound) -> list[Peer]:
    """CVODE with a banded Jacobian by differences: BDF to order 2 and 5, Adams.

    BDF to order 2, the fastest of them for these chains, also with larger absolute tolerances and, where that differs, with the
    rates as unknowns. Its error is not a smooth function of the tolerance: three tolerances in a decade.
    """
    from sksundae.cvode import CVODE

    options_of: dict[int, dict[str, Any]] = {}

    def runner(of: Callable[[], Bound], atol: float = 0.01, **options: Any) -> Callable[[float, float], Outcome]:
        def run(rtol: float, seconds: float) -> Outcome:
            f = of()
            if id(f) not in options_of:
                options_of[id(f)] = band(problem, f)
            f.start(seconds)
            begun = clock.process_time()
            solver = CVODE(f.fill, rtol=rtol, atol=atol * rtol * f.unit, max_num_steps=10**8, **options, **options_of[id(f)])
            found = solver.solve(np.array([0.0, problem.duration]), f.y0)
            spent = clock.process_time() - begun
            if spent > seconds:
                raise Cutoff
            if not found.success:
                raise ArithmeticError(str(found.message))
            end = f.reduced.split(found.y[-1])
            return Outcome(end.hi, 0, f.calls, int(found.njev or 0), spent, None if f.by_rate else end.pi)

        return run

    @cache
    def by_rate() -> Bound:
        return Bound(problem, by_rate=True)

    second: dict[str, Any] = {"method": "BDF", "max_order": 2}
    found = [Peer("CVODE BDF-2", THIRDS, runner(lambda: f, **second))]
    for share in (0.1, 1.0):
        found.append(Peer(f"CVODE BDF-2, atol {share:g} rtol", THIRDS, runner(lambda: f, share, **second)))
        if rates.takes(problem):
            found.append(Peer(f"CVODE BDF-2 for rates, atol {share:g} rtol", THIRDS, runner(by_rate, share, **second)))
    return [
        *found,
        Peer("CVODE BDF-5", TOLERANCES, runner(lambda: f, method="BDF", max_order=5)),
        Peer("CVODE Adams", TOLERANCES, runner(lambda: f, method="Adams")),
    ]
