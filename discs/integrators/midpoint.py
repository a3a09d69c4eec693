"""The implicit midpoint rule in (q, pi), solved by sweeps with frozen geometry."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.integrators.base import OneStep
from discs.integrators.work import Work
from discs.kernels import protocol as do
from discs.kernels.compiled import CUT, Cost, fill
from discs.kernels.shared import copy, forward, reach, stuck, unsettled
from discs.skew import Phase, SkewGradient, add

WHOLE = np.ones(1)  # the fractions of h of a single midpoint step


@dataclass(frozen=True)
class Midpoint(OneStep):
    r"""Implicit midpoint rule on q' = C pi, pi' = -C^T S q.

    q_{n+1} - q_n = h C p,   pi_{n+1} - pi_n = -h C^T S (q_n + h/2 C p),   p = (pi_n + pi_{n+1})/2,

    with C taken at (q_n + q_{n+1})/2. For a frozen C the step is linear; eliminating q leaves one symmetric positive
    definite banded system in p,

        (I + h^2/4 C^T S C) p = pi_n - h/2 C^T S q_n.

    A sweep solves it and evaluates C again at the new midpoint. The energy is exact after any number of sweeps, since H is
    quadratic and both equations have the same C (with viscosity of bending, which is taken where the last sweep began, once the
    sweeps have converged). The step is the midpoint rule, and reversible, once the sweeps have converged.

    If V is not quadratic, the secant of the step replaces S, and the energy is exact only once the sweeps have converged. The
    matrix then affects only their convergence, and the one of the first sweep is used for all sweeps of a step. (Measured on rods
    with own headings, slack and stiff, h = k ... 16k: as many sweeps as with a new matrix for each; factoring is nearly half of the
    cost of a sweep.)

    The matrix has entries up to h^2 K/(M k^4), and a solve loses as many digits. So a sweep solves for the change of p, with the
    right side pi_n - p - h/2 C^T grad V(q_n + h/2 C p) computed from links. Only digits of a small change are lost: the energy
    keeps 13 to 15 digits, instead of 8 to 10 if p itself is the unknown.

    Parameters
    ----------
    sweeps : largest number of sweeps in a step.
    tolerance : a step has converged if a sweep changes its moves by no more than this, relative to the length of the chain or in
        rad; with 0 every step takes all `sweeps`.
    """

    sweeps: int = 50
    tolerance: float = 1e-12

    name: ClassVar[str] = "midpoint"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "energy exactly; the rolling constraint; reversible when converged"
    reference: ClassVar[str] = "Hairer, Lubich, Wanner, Geometric Numerical Integration, IV.2"
    stability_limit: ClassVar[float] = np.inf
    takes_motors: ClassVar[bool] = True
    in_lanes: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checks.iteration(self.sweeps, self.tolerance)

    @property
    def sweep_tolerance(self) -> float:
        return self.tolerance

    def with_sweeps(self, tolerance: float) -> "Midpoint":
        return replace(self, tolerance=tolerance) if self.tolerance else self

    def step(self, system: SkewGradient, z: Phase, t: float, h: float, work: Work) -> Phase:
        shape = system.shape(z.hi, z.lo)
        p, move = z.pi, 0.5 * h * system.forward(system.basis(shape), z.pi)
        guide: tuple[Any, Any] | None = None
        for sweep in range(1, self.sweeps + 1):  # noqa: B007, counted below
            c = system.basis(system.moved(shape, move))
            velocity = system.forward(c, p)
            secant = system.secant(shape, h * velocity)
            if guide is None or system.renewed:
                guide = secant, c
            pull = system.pull(c, system.mean_force(secant), t + 0.5 * h, z, 0.5 * h * velocity, p)
            middle = z.hi + 0.5 * h * velocity
            change = system.solve(*guide, 0.25 * h * h, z.pi - p - 0.5 * h * pull, 0.5 * h, t + 0.5 * h, middle)
            p = p + change
            last, move = move, 0.5 * h * system.forward(c, p)
            if (np.abs(move - last).max(axis=1) <= self.tolerance * system.scale).all():
                break
        work.spend(system.load, t + 0.5 * h, h, z, move, 2 / h * move)
        if system.load is not None and system.load.axles:
            f = system.load.applied(t + 0.5 * h, z.hi + (z.lo + move), 2 / h * move)
            pull = system.back(c, system.mean_force(system.secant(shape, 2 * move)) - f)
            work.react(system.load, 2 * (p - z.pi) + h * pull, p)
        work.gradients += sweep
        work.solves += sweep
        work.unconverged += sweep == self.sweeps and self.tolerance > 0
        return Phase(*add(z.hi, z.lo, 2 * move), 2 * p - z.pi)

    @cached_property
    def parameters(self) -> "Composed":
        return Composed(WHOLE, self.sweeps, float(self.tolerance))


class Composed(NamedTuple):
    """Parameters of the compiled form: midpoint steps of fractions (stages,) of h, and the limits of sweeps."""

    fractions: Float
    sweeps: int
    tolerance: float

    @property
    def nodes(self) -> Float:
        """Times of the forces in a step, in units of h."""
        middles: Float = np.cumsum(self.fractions) - 0.5 * self.fractions
        return middles


class Room(NamedTuple):
    """Workspace: p like momenta; move, still (zero) like positions."""

    p: Float
    move: Float
    still: Float


@fill(do.room, Composed, _nrt=True)
def _room(method: Composed, chain: Any, state: Phase) -> Room:
    return Room(np.empty_like(state.pi), np.empty_like(state.hi), np.zeros_like(state.hi))


@fill(do.step, Composed, forceinline=True)
def _step(method: Composed, chain: Any, work: Any, room: Room, before: Phase, after: Phase, t: float, h: float) -> Cost:
    p, move, now, time = room.p, room.move, before, t
    solves, unconverged = 0, 0
    for part in range(method.fractions.size):
        tau = method.fractions[part] * h
        do.basis(chain, work, room.still, work.c)
        copy(now.pi, p)
        forward(work.c, p, move, 0.5 * tau)
        sweep, change = 0, np.inf
        while unsettled(method, sweep, change):
            if do.halted(chain, move.size):
                return CUT
            change = do.sweep(chain, work, now, time, tau, p, move, sweep == 0)
            sweep += 1
        do.spend(chain, now, time + 0.5 * tau, tau, move, move, 2 / tau)
        do.book_motors(chain, work, now, time + 0.5 * tau, tau, p, move)
        time += tau
        solves += sweep
        unconverged = max(unconverged, int(stuck(method, sweep)))
        reach(chain, now, p, move, after)
        now = after
        do.settle(chain, work, now.hi, now.lo)
    return solves, solves, unconverged


@fill(do.jumps, Composed)
def _jumps(method: Composed) -> bool:
    return False
