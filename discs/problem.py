"""A problem: a chain of discs, its initial state, its loads and the time to simulate."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Bool, Float
from discs.chains.chain import Chain, SteeredChain
from discs.chains.rolling import stretching
from discs.chains.rolling_discs import RollingDiscs
from discs.chains.slaved import SlavedSystem
from discs.chains.steered import SteeredSystem
from discs.loads import Linear, OnRod, signals, total
from discs.loads.motor import Held, Motor
from discs.skew import Load, Phase

BLOW_UP = 10.0  # a run has blown up if its kinetic energy is so many times the most that the balance of energy allows


@dataclass(frozen=True, eq=False)
class State:
    """Positions, angles and rates of the discs. The velocities of the contact points follow from rolling.

    Attributes
    ----------
    x, y : contact points, (n,), length.
    theta : roll angles, (n,), rad.
    omega : rates of roll, (n,), rad per time; a number holds for all discs.
    phi : own headings, (n,), rad, for a `SteeredChain`; None for a `Chain`.
    phi_rate : rates of turning, (n,), rad per time; a number holds for all discs.

    Raises
    ------
    ValueError : for arrays of different lengths, and for what is not a finite number.
    """

    x: ArrayLike
    y: ArrayLike
    theta: ArrayLike
    omega: ArrayLike = 0.0
    phi: ArrayLike | None = None
    phi_rate: ArrayLike = 0.0

    def __post_init__(self) -> None:
        given = {f.name: checks.array(f"initial {f.name}", v) for f in fields(self) if (v := getattr(self, f.name)) is not None}
        n = max(value.size for value in given.values())
        for name, value in given.items():
            object.__setattr__(self, name, checks.field(f"initial {name}", value, n))


@dataclass(frozen=True, eq=False)
class Problem:
    """A chain, its initial state and the time to run.

    Attributes
    ----------
    chain : the discs and their springs.
    initial : state at t = 0.
    duration : time to simulate, > 0.
    loads : forces besides those of springs and ground, see `discs.loads`; they are added. Their potentials are part of the energy.
        If a load has none, as a damper, energy is balanced by `Solution.work` and `Solution.dissipated`.

    Raises
    ------
    ValueError : if the state has another number of discs than the chain, or headings where the chain has none (or none where it
        needs them); if the duration is not positive; or if a disc has neither inertia nor a heading to roll along, so that its
        equation would divide by zero.
    """

    chain: Chain | SteeredChain
    initial: State
    duration: float
    loads: tuple[Load | OnRod, ...] = ()

    def __post_init__(self) -> None:
        checks.instance("chain", self.chain, Chain | SteeredChain, "a Chain or a SteeredChain")  # type: ignore[arg-type]
        checks.instance("initial", self.initial, State, "a State, as State(x, y, theta, omega)")
        object.__setattr__(self, "duration", checks.number("duration", self.duration, positive=True))
        if np.size(self.initial.x) != self.chain.n:
            raise ValueError(f"initial state must have the chain's {self.chain.n} discs; got {np.size(self.initial.x)}")
        steered = isinstance(self.chain, SteeredChain)
        if steered != (self.initial.phi is not None):
            need = "needs initial headings phi" if steered else "takes its headings from the line: leave phi out"
            raise ValueError(f"{type(self.chain).__name__} {need}")
        with np.errstate(all="ignore"):  # what overflows is refused
            self._check_loads()
            if isinstance(self.chain, Chain):
                self._check_slopes(self.chain)
            else:
                self._check_inertia(np.asarray(self.chain.radius) > 0, "radius = 0")
            if self.loads:
                self._check_forces()
            self._check_energy()

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the arguments only: other processes build the system again."""
        return Problem, (self.chain, self.initial, self.duration, self.loads)

    def _check_loads(self) -> None:
        if not isinstance(self.loads, tuple) or not all(isinstance(load, Load | OnRod) for load in self.loads):
            raise ValueError(f"loads must be a tuple of loads, as (Torque(...),); got {checks.shown(self.loads)}")
        system = SlavedSystem if isinstance(self.chain, Chain) else SteeredSystem
        shape = len(system.rows), self.chain.n
        for load in self.bound:
            if np.shape(load.damping) != shape or np.shape(load.stiffness) != shape:
                raise ValueError(
                    f"{type(load).__name__}: damping and stiffness must have shape {shape}, a row for each coordinate and a column "
                    f"for each disc; got {np.shape(load.damping)} and {np.shape(load.stiffness)}"
                )
            if isinstance(load, Linear):
                for drive in load.drives:
                    signals.check(drive.signal, self.duration, drive.name)
            if isinstance(load, Held):
                self._check_motor(load)

    def _check_energy(self) -> None:
        """Refuse what is too large for doubles."""
        if np.isfinite(self.energy()):
            return
        fields = [(name, value) for part in (self.chain, self.initial) for name, value in vars(part).items() if name != "n"]
        sizes = {name: np.abs(value).max() for name, value in fields if isinstance(value, np.ndarray | float) and np.size(value)}
        name = max(sizes, key=lambda name: sizes[name])
        raise ValueError(
            f"the initial energy is too large for a double, or infinite; the largest of what is given is {name}, up to "
            f"{sizes[name]:.3g}: change units, or the loads"
        )

    def _check_forces(self) -> None:
        """Refuse forces of the initial state that are no finite numbers for each coordinate and disc, or not always the same."""
        z, system = self.start(), self.system
        v = system.forward(system.basis(system.shape(z.hi)), z.pi)
        for name, load in zip((type(given).__name__ for given in self.loads), self.bound, strict=True):
            force, again = (np.asarray(load.force(0.0, z.hi.copy(), v.copy()), dtype=float) for _ in range(2))
            if force.shape != v.shape or not np.isfinite(force).all():
                got = f"shape {force.shape}" if force.shape != v.shape else "values that are not finite"
                raise ValueError(f"{name}: the force must be finite numbers of shape {v.shape}; got {got} at t = 0")
            if (force != again).any():
                raise ValueError(f"{name}: the force must be a function of t, q and v; it has other values when asked again")

    def _check_motor(self, load: Held) -> None:
        """Refuse a rate that differs from that of the initial state, or is not finite at the end."""
        (axle,), (rate,) = load.axles, load.rates(0.0)
        signals.check(axle.rate, self.duration, "Motor")
        name = "omega" if axle.row == 2 else "phi_rate"
        initial = np.broadcast_to(getattr(self.initial, name), self.chain.n)[axle.disc]
        if not abs(initial - rate) <= 1e-9 * max(1.0, abs(rate)):
            raise ValueError(
                f"Motor: its rate at t = 0 must be the initial {name} of its disc {axle.disc}, {initial:g}; got {rate:g}: "
                "change one, or start the motor smoothly"
            )
        if sum(other.axles[0][:2] == axle[:2] for other in self.bound if other.axles) > 1:
            raise ValueError(f"Motor: disc {axle.disc} has two motors about the same axis; leave one out")

    def _check_slopes(self, chain: Chain) -> None:
        shape = self.system.shape(self._positions())
        slope = np.hypot(*self.system.slope(shape))
        if chain.rolling_law.vanishing and not slope.all():
            i = int(np.argmin(slope))
            raise ValueError(f"rolling={chain.rolling!r} needs a heading: r' = 0 at disc {i}; move its neighbours apart")
        if chain.link_law.directed and not np.hypot(shape[0], shape[1]).all():
            i = int(np.argmin(np.hypot(shape[0], shape[1])))
            raise ValueError(f"curvature={chain.curvature!r} needs links with a direction: discs {i} and {i + 1} are in one place")
        self._check_inertia((slope > 0) & (np.asarray(chain.radius) > 0), "r' = 0 or radius = 0")

    def _check_inertia(self, moves: Bool, where: str) -> None:
        """Refuse discs that neither move when they roll nor have a moment of inertia."""
        inertia = np.asarray(self.chain.spin_inertia) + moves
        if not inertia.all():
            i = int(np.argmin(inertia))
            raise ValueError(f"spin_inertia must be positive where {where}, as at disc {i}; got 0")

    @cached_property
    def bound(self) -> tuple[Load, ...]:
        """The loads for the discs of the chain."""
        return tuple(load.on(self.chain) if isinstance(load, OnRod) else load for load in self.loads)

    @cached_property
    def system(self) -> RollingDiscs:
        """The equations of motion."""
        load = total(self.bound)
        return SteeredSystem(self.chain, load) if isinstance(self.chain, SteeredChain) else SlavedSystem(self.chain, load)

    @cached_property
    def kept(self) -> dict[str, Any]:
        """What runs of this problem keep for later ones, see `discs.running.plan`."""
        return {}

    def _positions(self) -> Float:
        return np.array([getattr(self.initial, name) for name in self.system.rows])

    def start(self) -> Phase:
        """The initial state in the variables (q, pi) of the skew-gradient form."""
        return self._start

    @cached_property
    def _start(self) -> Phase:
        q = self._positions()
        rates = np.array([self.initial.omega, self.initial.phi_rate])
        return Phase(q, np.zeros_like(q), self.system.momentum(self.system.shape(q), rates))

    @cached_property
    def blown_up(self) -> float:
        """Blow-up threshold of the kinetic energy: BLOW_UP times the most that the balance of energy allows; infinite without one.

        V >= 0, so that is the energy, less the least potential of loads.
        """
        load, chain = self.system.load, self.chain
        if load is not None and not (load.conservative or load.passive):
            return np.inf
        most = self.energy() if load is None else self.energy() - load.least
        return float(BLOW_UP * most + rounding_energy(chain))

    @property
    def conserves(self) -> bool:
        """Whether energy is conserved: by springs and ground always, by loads where all are conservative."""
        return self.system.load is None or self.system.load.conservative

    @cached_property
    def ill_posed(self) -> str:
        """The warning for a chain without bending stiffness, along all or a part of it, under a law of rolling that depends on
        stretch; empty for others.

        With K = 0 the straight rod rolling at the rate omega amplifies waves of length 2 pi/q at the rate sigma = u q, where
        M u^4 + (beta - gamma alpha R^2 omega^2) u^2 = gamma beta R^2 omega^2 with gamma = `stretching(law)`, 1 under the field law
        (docs/model.md, `continuum.dispersion`): a Hadamard instability. Discs of spacing k cut it
        off at sigma <= R omega/k, so runs with more and more discs do not converge.
        """
        chain = self.chain
        if not isinstance(chain, Chain) or not stretching(chain.rolling_law):
            return ""
        limp = np.asarray(chain.bending_stiffness) == 0
        inside = np.flatnonzero(limp[:-2] & limp[1:-1] & limp[2:])  # three bends in a row
        if not limp.all() and not inside.size:
            return ""
        where = "" if limp.all() else f", from s = {chain.bends[inside[0]]:.4g} on,"
        if not np.any(chain.radius) or (self.energy() <= 0 and not self.loads):  # without energy nothing moves
            return ""
        rate = np.max(np.asarray(chain.radius) * np.abs(self.initial.omega)) / chain.k
        now = f", at the start up to {rate:.3g} per unit of time" if rate > 0 else ""
        return (
            f"bending_stiffness is 0{where} under rolling={chain.rolling!r}: the equations of a rolling rod are ill posed, short "
            f"waves grow at rates proportional to the number of discs{now}, and there is no limit of many discs; take "
            "bending_stiffness > 0 or rolling='unit'"
        )

    def energy(self, state: State | None = None) -> float:
        """Kinetic and potential energy of a `state` of this chain, by default the initial one; potentials of loads are part of it.

        Raises
        ------
        ValueError : for a state that does not fit the chain, as for a `Problem`.
        """
        if state is None:
            return self._energy
        loads = tuple(load for load in self.loads if not isinstance(load, Motor))  # they have no energy, but a rate at t = 0
        return Problem(self.chain, state, self.duration, loads)._energy

    @cached_property
    def _energy(self) -> float:
        z, system = self.start(), self.system
        energy = 0.5 * float(np.vdot(z.pi, z.pi)) + system.potential(system.shape(z.hi, z.lo))
        return energy if system.load is None else energy + system.load.potential(0.0, z.hi + z.lo)


def rounding_energy(chain: Chain | SteeredChain) -> float:
    """An energy that rounding may give discs at rest, far below that of any motion; part of the blow-up threshold."""
    return float(1e-16 * (np.max(chain.torsion_stiffness) + np.max(chain.bending_stiffness)) / chain.length)
