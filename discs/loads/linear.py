"""Loads that are linear in positions and velocities, and patterns over the discs times signals of time."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs import checks
from discs.arrays import Float, Matrix
from discs.chains.elements import mixed
from discs.loads import signals
from discs.loads.bends import Bends
from discs.loads.signals import Signal
from discs.skew import Load

NEAR = 1e-6  # of a step: two times of forces that are nearer count as one


class Drive(NamedTuple):
    """The part signal(t) pattern of a load.

    pattern : (rows, n). name : of the load, for messages. strain : None, or a rest strain, see `Linear.strain`; the force then
    comes from the energy of springs. closing : pattern q of a ring lacks this, due to the whole turns of its heading.
    curvature : None, or (B,), the part signal(t) curvature of the rest curvature of `Linear.bends`.
    """

    pattern: Float
    signal: Signal
    name: str
    strain: Float | None = None
    closing: float = 0.0
    curvature: Float | None = None


@dataclass(frozen=True, eq=False)
class Linear(Load):
    """f = constant - damping v - stiffness q - B^T (viscosity) B v + sum of drives, with rows x, y, theta (and phi).

    Its potential is offset + |strain|^2/2 + the sum of stiffness q^2/2 - constant q. Drives with a strain add to `strain` and to
    `constant` in it. (Springs with a rest strain e: S (a - e)^2/2 = S a^2/2 - S e a + |strain|^2/2, with strain = e sqrt(S).)

    Attributes
    ----------
    constant : (rows, n), force in rows x and y, torque in the others; any shape that broadcasts with the other two.
    damping, stiffness : the same, >= 0, force per velocity and per length, torque per rate and per angle.
    viscosity : see `Load`, >= 0, torque per rate; None for none.
    offset : energy.
    strain : rest strains of springs, times the root of their stiffness; any shape.
    drives : the parts that depend on time.
    section : see `Load`; rest stretch and shear have no compiled form.
    bends : rest curvature and viscosity of bending of slaved headings, whose force and potential are added; None for none.
    about : places (rows, n) of springs: the potential is summed from there, so stiff springs far from the origin lose no digits.
    degree : of the chain's elements, where there is viscosity: for 2, B v and its transpose are those of `discs.chains.elements`.
    floor : a lower bound of the potential, or of its sum with that of the springs; None for the one where stiffness q = constant.

    Raises
    ------
    ValueError : for a negative damping, stiffness or viscosity, values that are not finite, or shapes that do not fit each other.
    """

    constant: Any = 0.0
    damping: Any = 0.0
    stiffness: Any = 0.0
    viscosity: Any = None
    offset: float = 0.0
    strain: Any = 0.0
    drives: tuple[Drive, ...] = ()
    section: Any = None
    bends: Bends | None = None
    floor: float | None = None
    degree: int = 1
    about: Any = 0.0

    def __post_init__(self) -> None:
        names = ("constant", "damping", "stiffness")
        given = [checks.array(f"{name} of Linear", getattr(self, name)) for name in names]
        try:
            values = np.broadcast_arrays(*given, *(np.empty(drive.pattern.shape) for drive in self.drives))[:3]
        except ValueError:
            shapes = ", ".join(str(value.shape) for value in given)
            raise ValueError(f"constant, damping and stiffness must have one shape, (rows, discs); got {shapes}") from None
        for name, value in zip(names, values, strict=True):
            if not np.isfinite(value).all() or (name != "constant" and (value < 0).any()):
                raise ValueError(f"{name} must be finite{'' if name == 'constant' else ' and at least 0'}; got {value}")
            object.__setattr__(self, name, np.array(value))
        if self.viscosity is not None and self.constant.ndim != 2:
            raise ValueError(f"constant, damping or stiffness must be (rows, discs) if viscosity is given; got {self.constant}")
        if self.viscosity is not None:
            links, need = checks.array("viscosity of Linear", self.viscosity), (len(self.constant) - 2, self.constant.shape[-1] + 1)
            if links.shape != need or not np.isfinite(links).all() or (links < 0).any():
                raise ValueError(
                    f"viscosity must be finite, at least 0 and of shape {need}; got {checks.shown(links)}: {links.min(initial=0):g}"
                )
            object.__setattr__(self, "viscosity", links)
        object.__setattr__(self, "offset", checks.number("offset of Linear", self.offset))
        if not (self.floor is None or (isinstance(self.floor, float) and self.floor == -np.inf)):
            object.__setattr__(self, "floor", checks.number("floor of Linear", self.floor))
        damped = self.damping.any() or self.viscosity is not None or (self.bends is not None and self.bends.viscosity.any())
        object.__setattr__(self, "conservative", not damped and not self.drives)
        object.__setattr__(self, "passive", not self.drives)
        pushed = self.constant != 0
        push, spring = self.constant[pushed], self.stiffness[pushed]
        least = self.offset - 0.5 * float((push**2 / spring).sum()) if spring.all() else -np.inf
        object.__setattr__(self, "least", least if self.floor is None else self.floor)

    def potential(self, t: float, q: Float) -> float:
        (there, slope), away = self._potential_about, q - self.about
        own = there + 0.5 * float(np.sum(self.strain**2)) + float(np.vdot(0.5 * self.stiffness * away + slope, away))
        if self.bends is not None:
            own += self.bends.potential(self.bends.rest, q)
        return own + self.driven(t, q) if self.drives else own

    @cached_property
    def _potential_about(self) -> tuple[float, Float]:
        """The potential at `about`, without strains, and its gradient there."""
        about = np.broadcast_to(self.about, self.constant.shape)
        slope = self.stiffness * about - self.constant
        return self.offset + 0.5 * float(np.vdot(slope - self.constant, about)), slope

    def driven(self, t: float, q: Float) -> float:
        total, strain = 0.0, self.strain
        for drive in self.drives:
            if drive.strain is not None:
                signal = _at(drive, t)
                strain = strain + signal * drive.strain
                total -= signal * (float(np.vdot(drive.pattern, q)) + drive.closing)
        if self.bends is not None:
            total += self.bends.potential(self._curvature(t), q) - self.bends.potential(self.bends.rest, q)
        return total + 0.5 * float(np.sum(strain**2) - np.sum(self.strain**2))

    def _curvature(self, t: float) -> Any:
        """The rest curvature at a time, (B,)."""
        assert self.bends is not None
        driven = (_at(drive, t) * drive.curvature for drive in self.drives if drive.curvature is not None)
        return self.bends.rest + sum(driven)

    def force(self, t: float, q: Float, v: Float) -> Float:
        found: Float = self.constant - self.damping * v - self.stiffness * q
        if self.viscosity is not None:
            found[2:] += np.diff(self._mixed(self.viscosity * self._apart(v)))
        if self.bends is not None:
            found[:2] += self.bends.force(self._curvature(t), q) + self.bends.drag(q, v)
        for drive in self.drives:
            found += _at(drive, t) * drive.pattern
        return found

    def derivatives(self, t: float, q: Float, v: Float) -> tuple[Matrix, Matrix]:
        of_q, of_v = (scipy.sparse.diags_array(-part.ravel(), format="csr") for part in (self.stiffness, self.damping))
        if self.viscosity is not None:
            of_v = of_v - self._viscous
        if self.bends is not None:
            bent, dragged = self.bends.derivatives(self._curvature(t), q, v)
            of_q, of_v = of_q + bent, of_v + dragged
        return of_q, of_v

    @cached_property
    def _viscous(self) -> Matrix:
        """B^T (viscosity) B, sparse (rows n, rows n)."""
        assert self.viscosity is not None
        rows, n = self.constant.shape
        links = np.arange(n + 1)
        apart = scipy.sparse.csr_array((np.ones(n + 1), (links, links % n)), shape=(n + 1, n))
        apart = apart - scipy.sparse.csr_array((np.ones(n + 1), (links, (links - 1) % n)), shape=(n + 1, n))
        pulled = scipy.sparse.diags_array([-np.ones(n), np.ones(n)], offsets=[0, 1], shape=(n, n + 1))
        if self.degree == 2:
            mix = scipy.sparse.csr_array(self._mixed(np.eye(n + 1)).T)
            apart, pulled = mix @ apart, pulled @ mix
        none = scipy.sparse.csr_array((n, n))
        blocks = [-(pulled @ scipy.sparse.diags_array(own) @ apart) for own in self.viscosity]
        return scipy.sparse.block_diag([none] * (rows - len(blocks)) + blocks, format="csr")

    def power(self, t: float, q: Float, v: Float) -> tuple[float, float]:
        work = sum(_at(drive, t) * float(np.vdot(drive.pattern, v)) for drive in self.drives)
        dissipated = float(np.vdot(self.damping * v, v))
        if self.viscosity is not None:
            dissipated += float((self.viscosity * self._apart(v) ** 2)[:, 1:].sum())
        if self.bends is not None:
            driven = self.bends.force(self._curvature(t), q) - self.bends.force(self.bends.rest, q)
            work, dissipated = work + float(np.vdot(driven, v[:2])), dissipated + self.bends.dissipated(q, v)
        return work, dissipated

    def powers(self, t: float, q: Float, v: Float) -> Float:
        """The part of each drive in the work of `power`, (K,)."""
        found = np.zeros(len(self.drives))
        for k, drive in enumerate(self.drives):
            signal = _at(drive, t)
            found[k] = signal * np.vdot(drive.pattern, v)
            if self.bends is not None and drive.curvature is not None:
                both = self.bends.rest + self._curvature(t)
                found[k] += np.vdot(self.bends.force(signal * drive.curvature, q, both), v[:2])
        return found

    def energies(self, t: float, q: Float) -> Float:
        """The part of each drive in `driven`, (K,). What two drives have in common counts half for each."""
        strains = 2 * self.strain + sum(_at(drive, t) * drive.strain for drive in self.drives if drive.strain is not None)
        found = np.zeros(len(self.drives))
        for k, drive in enumerate(self.drives):
            signal = _at(drive, t)
            if drive.strain is not None:
                found[k] = signal * (0.5 * np.sum(drive.strain * strains) - np.vdot(drive.pattern, q) - drive.closing)
            if self.bends is not None and drive.curvature is not None:
                found[k] += self.bends.mutual(signal * drive.curvature, q, self.bends.rest + self._curvature(t))
        return found

    def bands(self, t: float, q: Float, c: Float, d: complex, g: complex) -> Any:
        return None if self.bends is None else self.bends.bands(self._curvature(t), q, c, d, g)

    def _apart(self, v: Float) -> Float:
        """Differences of neighbours in the rows from theta on, (columns, n + 1), around a ring; of degree 2 at strain points."""
        return self._mixed(np.diff(v[2:], prepend=v[2:, -1:], append=v[2:, :1]))

    def _mixed(self, links: Float) -> Float:
        """From links to strain points and back, (columns, n + 1), link j before disc j; n is odd at free ends, even on a ring."""
        if self.degree == 1:
            return links
        found, ring = np.zeros_like(links), links.shape[1] % 2
        end = links.shape[1] - (not ring)
        found[:, 1:end] = mixed(links[:, 1:end])
        if ring:
            found[:, 0] = found[:, -1]
        return found

    @cached_property
    def parameters(self) -> Any:
        """For the compiled form; None for rest stretch and shear, and for viscosity that has none."""
        if (self.degree == 2 and self.viscosity is not None) or (self.section is not None and self.section.ndim == 2):
            return None
        if self.bends is not None and self.bends.viscosity.any() and not self.bends.chain.link_law.quadratic:
            return None
        from discs.kernels import load
        from discs.kernels.bends import NO_BENDS

        bends = NO_BENDS
        if self.bends is not None:
            none = 0 * self.bends.rest
            driven = [none if drive.curvature is None else drive.curvature for drive in self.drives]
            bends = self.bends.parameters(np.array(driven).reshape(-1, none.size))
        links = np.empty((0, 0)) if self.viscosity is None else self.viscosity
        patterns = np.array([drive.pattern for drive in self.drives]).reshape(-1, *self.constant.shape)
        none, few = np.empty((0, len(self.drives))), np.empty(0)
        parts = self.constant, self.damping, self.stiffness
        level = np.max([number * part.any(axis=1) for number, part in enumerate(parts, start=1)], axis=0)
        pushed: Any = patterns.any(axis=2)
        return load.Linear(*parts, level, links, patterns, pushed, few, none, np.empty(1), bends, few, load.NO_AXLES)

    @property
    def signals(self) -> tuple[tuple[Signal, str], ...]:  # type: ignore[override]
        """The signal of each drive, with the name of its load."""
        return tuple((drive.signal, drive.name) for drive in self.drives)

    def timed(self, times: Float, h: float) -> Any:
        return tabled(self, times, h)


def tabled(load: Load, times: Float, h: float) -> Any:
    """Parameters of a load for steps h, with a table of its signals at these times and sums of their own for its work."""
    if load.conservative:
        return load.parameters
    given: dict[str, Float] = {"spent": np.zeros(4)}
    if load.signals:
        times = np.sort(times)
        times = times[np.diff(times, prepend=-np.inf) > 0]
        values = np.stack([signals.values(signal, times, name) for signal, name in load.signals], axis=1)
        given |= {"times": times, "values": values, "near": np.array([NEAR * h + 1e-14 * abs(times[-1])])}
    return with_arrays(load.parameters, **given)


def with_arrays(parameters: Any, **given: Float) -> Any:
    """Parameters of a compiled load with some arrays of its linear part replaced."""
    if not hasattr(parameters, "linear"):
        return parameters._replace(**given)
    linear = parameters.linear._replace(**given)
    return parameters._replace(linear=linear, spent=linear.spent)


def _at(drive: Drive, t: float) -> float:
    """The signal of a drive at a time."""
    return float(signals.values(drive.signal, np.array([t]), drive.name)[0])
