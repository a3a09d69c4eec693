"""The linearised equations at many states at once, the stages of steps and frames; `discs.analysis.linear` has them one by one.

`Equations` are those of any problem. `SweptEquations`, those with linear loads, have a compiled form, `discs.kernels.linearised`:
`SteeredEquations` for own headings, and `ConstantEquations` for slaved headings and the linear curvature, whose second derivatives
are constant. These are computed by array operations for all states together.
"""

from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.analysis.linear import Linearised
from discs.analysis.secants import Secant
from discs.arrays import Float, Matrix
from discs.chains import stencils
from discs.chains.chain import SteeredChain
from discs.loads import signals
from discs.loads.linear import Linear
from discs.problem import Problem
from discs.skew import Phase


class At(NamedTuple):
    """What a chain does at M states.

    t : (M,). q, c, velocity, unbalanced : positions, C, C pi and g = grad V - f, (M, rows, n). pi : (M, columns, n).
    arm : contact directions of discs of radius 1, (M, 2, n). turned : (M, headings, rows, n), dC/dh pi for each heading h that C
    depends on. pull : (M, headings, columns, n), dC/dh . g; only of `ConstantEquations`. each : of `Equations`, one by one.
    """

    t: Float
    q: Float
    pi: Float
    c: Float
    arm: Float
    velocity: Float
    unbalanced: Float
    turned: Float
    pull: Float
    each: tuple[Linearised, ...] = ()


class Passed(NamedTuple):
    """What the parameters of springs and loads need of M states: t (M,); q, velocity and w = C nu, (M, rows, n); `At.each`."""

    t: Float
    q: Float
    velocity: Float
    w: Float
    each: tuple[Linearised, ...] = ()


class Equations:
    """The linearised equations of a problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.system, self.chain = problem, problem.system, problem.chain

    def at(self, q: Float, pi: Float, t: Float) -> At:
        """At positions q (M, rows, n), momenta pi (M, columns, n) and times t (M,)."""
        each = self.each(q, pi, t)
        unit = replace(self.problem, chain=replace(self.chain, radius=1.0), loads=()).system
        arm = [unit.contact(lin.shape) for lin in each]
        column = np.arange(q.shape[1]) // 3
        turned = [[turn.basis * p[column] for turn in self.system.turns(lin.shape)] for lin, p in zip(each, pi, strict=True)]
        parts = ([getattr(lin, name) for lin in each] for name in ("basis", "velocity", "unbalanced"))
        c, velocity, unbalanced = (np.array(part) for part in parts)
        return At(t, q, pi, c, np.array(arm), velocity, unbalanced, np.array(turned), np.empty(0), each)

    def each(self, q: Float, pi: Float, t: Float) -> tuple[Linearised, ...]:
        """One by one."""
        start = self.problem.start().pi.shape
        states = (Phase(place, np.zeros_like(place), p.reshape(start)) for place, p in zip(q, pi, strict=True))
        return tuple(self.linearised(z, time) for z, time in zip(states, t.tolist(), strict=True))

    def linearised(self, z: Phase, t: float) -> Linearised:
        """At one state and time."""
        return Linearised(self.problem, z, t)

    def over(self, h: float) -> "Equations":
        """Those at stages of steps of size h: other ones only where steps take secants."""
        return self

    @cached_property
    def headings(self) -> list[tuple[int, Matrix]]:
        """The row of q and the stencil of each heading."""
        return [(turn.row, turn.heading) for turn in self.system.turns(Linearised(self.problem, self.problem.start()).shape)]

    def dragged(self, at: At, w: Float) -> Float:
        """f_v^T w for w (M, rows, n)."""
        return np.array([(lin.forces[1].T @ part.ravel()).reshape(part.shape) for lin, part in zip(at.each, w, strict=True)])

    def stretched(self, passed: Passed) -> Float:
        """The sum over states of s (B w), (springs,), for the strains s."""
        strains = (lin.strains for lin in passed.each)
        found: Float = sum(each.strain * (each.matrix @ part.ravel()) for each, part in zip(strains, passed.w, strict=True))
        return found


class SecantEquations(Equations):
    """Those of midpoint steps of size h that take a secant, `discs.analysis.secants`."""

    def __init__(self, problem: Problem, h: float = 0.0) -> None:
        super().__init__(problem)
        self._h = h

    def linearised(self, z: Phase, t: float) -> Linearised:
        return Secant(self.problem, z, t, self._h)

    def over(self, h: float) -> Equations:
        return SecantEquations(self.problem, h)


class SweptEquations(Equations):
    """Those whose loads have constant f_q and D = -f_v, with a compiled form; see `equations`."""

    def dragged(self, at: At, w: Float) -> Float:
        return -_times(self.drag.T, w)

    @cached_property
    def drag(self) -> Matrix:
        """D, sparse (3 n, 3 n)."""
        return self._of_load[1]

    @cached_property
    def held(self) -> Matrix:
        """-f_q, sparse (3 n, 3 n)."""
        return self._of_load[0]

    @cached_property
    def _of_load(self) -> tuple[Matrix, Matrix]:
        q, load = self.problem.start().hi, self.system.load
        if load is None:
            return scipy.sparse.csr_array((q.size, q.size)), scipy.sparse.csr_array((q.size, q.size))
        of_q, of_v = ((-part).tocsr() for part in load.derivatives(0.0, q, np.zeros_like(q)))
        for part in (of_q, of_v):
            part.eliminate_zeros()
        return of_q, of_v

    def forces(self, t: Float) -> Float:
        """f at q = v = 0 and the times t (M,), (M, 3, n); (1, 3, n) if it is constant, (0, 3, n) for none."""
        load, still = self.system.load, np.zeros_like(self.problem.start().hi)
        if load is None:
            return still[None][:0]
        assert isinstance(load, Linear)
        constant = replace(load, drives=()).force(0.0, still, still)[None]
        driven = [np.multiply.outer(signals.values(drive.signal, t, drive.name), drive.pattern) for drive in load.drives]
        found: Float = constant + sum(driven) if driven else constant
        return found


class ConstantEquations(SweptEquations):
    """Those whose S = grad^2 V - f_q and D = -f_v do not depend on the state; see `equations`."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._springs: Any = problem.chain.link_law(problem.chain)  # type: ignore[union-attr, arg-type]

    def at(self, q: Float, pi: Float, t: Float) -> At:
        chain, law = self.chain, self.chain.rolling_law  # type: ignore[union-attr]
        mass, spin, radius = self.system.weights[0], self.system.weights[2], np.asarray(chain.radius)
        links = self._links(q)
        z = np.moveaxis(stencils.slopes(links[:, :2], chain.k, chain.ends), 1, 0)
        arm = np.array([-z[1], z[0]]) * law.arm(1.0, z)
        e = radius * arm
        c2 = 1 / np.sqrt(spin + mass * (e * e).sum(axis=0))
        c = np.stack([e[0] * c2, e[1] * c2, c2], axis=1)
        velocity, g = c * pi, self._gradient(links)
        if self.system.load is not None:
            g += _times(self.drag, velocity) + _times(self.held, q) - self.forces(t)
        turned, pull = np.empty((len(q), 2, 3, chain.n)), np.empty((len(q), 2, 1, chain.n))
        for row in (0, 1):
            along = np.zeros_like(z)
            along[row] = 1.0
            turn = radius * law.rate(z, along)
            de = np.array([-turn[1], turn[0]])
            shrink = -mass * (e * de).sum(axis=0) * c2**3
            basis = np.stack([de[0] * c2 + e[0] * shrink, de[1] * c2 + e[1] * shrink, shrink], axis=1)
            turned[:, row], pull[:, row, 0] = basis * pi, (basis * g).sum(axis=1)
        return At(t, q, pi, c, np.moveaxis(arm, 0, 1), velocity, g, turned, pull)

    def _links(self, q: Float) -> Float:
        """Links, (M, 3, n_links)."""
        links = stencils.links(q, self.chain.ends)
        if self.chain.ends == "ring":
            links[:, :2, -1] += self.chain.shift
        return links

    def _gradient(self, links: Float) -> Float:
        """grad V, (M, 3, n)."""
        ends, tension = self.chain.ends, np.empty_like(links)
        moments = self._springs.bend * stencils.bends(links[:, :2], ends)
        tension[:, :2] = stencils.gathered(stencils.pull(moments, "springs"), ends)
        tension[:, 2] = self._springs.twist * links[:, 2]
        return stencils.pull(tension, ends)

    def stretched(self, passed: Passed) -> Float:
        w, links = passed.w, self._links(passed.q)
        bends = stencils.bends(links[:, :2], self.chain.ends)
        strain = np.concatenate([bends[:, 0], bends[:, 1], links[:, 2]], axis=1)
        change = self._strains.matrix @ w.reshape(len(w), -1).T
        return (strain * change.T).sum(axis=0)  # type: ignore[no-any-return]

    @cached_property
    def _strains(self) -> Any:
        return self.system.strains(self.system.shape(self.problem.start().hi))


class SteeredEquations(SweptEquations):
    """Those of discs with their own headings."""

    def stretched(self, passed: Passed) -> Float:
        k = self.chain.k
        shapes = [self.system.shape(place) for place in passed.q]
        d, middle = (np.array([getattr(shape, name) for shape in shapes]) for name in ("d", "middle"))
        still = type(shapes[0])(*(0 * part for part in shapes[0]))
        changes = [self.system.moved(still, part) for part in passed.w]
        by_d, by_m = (np.array([getattr(change, name) for change in changes]) for name in ("d", "middle"))
        cos, sin = np.cos(middle), np.sin(middle)
        turned, along = (cos * d[:, 0] + sin * d[:, 1]) / k, (cos * d[:, 1] - sin * d[:, 0]) / k
        stretch = (turned - 1) * ((cos * by_d[:, 0] + sin * by_d[:, 1]) / k + along * by_m)
        shear = along * ((cos * by_d[:, 1] - sin * by_d[:, 0]) / k - turned * by_m)
        parts = stretch, shear, d[:, 2] * by_d[:, 2] / k**2, d[:, 3] * by_d[:, 3] / k**2
        return np.concatenate([part.sum(axis=0) for part in parts])


def equations(problem: Problem, secant: bool = False) -> Equations:
    """The linearised equations of a problem at many states. secant : whether steps take one."""
    if secant:
        return SecantEquations(problem)
    load, chain = problem.system.load, problem.chain
    linear = load is None or (isinstance(load, Linear) and load.section is None)
    if isinstance(chain, SteeredChain):
        return SteeredEquations(problem) if linear else Equations(problem)
    constant = linear and problem.system.quadratic
    if constant and isinstance(load, Linear) and load.bends is not None:
        constant = not (load.bends.viscosity.any() or any(drive.curvature is not None for drive in load.drives))
    return ConstantEquations(problem) if constant else Equations(problem)


def _times(matrix: Matrix, q: Float) -> Float:
    """A sparse matrix times each of q (M, rows, n)."""
    found: Float = (matrix @ q.reshape(len(q), -1).T).T.reshape(q.shape)
    return found
