"""What the rates of the reduced equations change by with parameters of a chain, for `discs.analysis.adjoint`.

With multipliers M = (mu, nu) and f = (C pi, -C^T g), g = grad V - F, a parameter changes M . f by

    (mu + F_v^T C nu) . dC pi - (dC nu) . g,   and   -(stiffness) s (B C nu)   for a change of a stiffness, relative to it.

C depends on the density rho, spin inertia alpha and radius R of its own disc only: its column is (e, 1)/root with
root² = w (alpha + rho |e|²) and e = R times a vector; with own headings there is 1/sqrt(w J) besides. Initial momenta depend on
them too: pi = root omega. And weight, a part of F, is proportional to rho. `discs.analysis.forces` has the parameters of loads.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from discs.analysis.forces import load_parameter
from discs.analysis.stages import At, Equations, Passed
from discs.arrays import Float
from discs.problem import Problem

INERTIAS = ("density", "spin_inertia", "radius", "heading_inertia")
STIFFNESSES = ("torsion_stiffness", "bending_stiffness", "stretch_stiffness", "shear_stiffness")


def basis_by(problem: Problem, c: Float, arm: Float, name: str) -> Float:
    """dC by a parameter of the discs, disc by disc, (M, rows, n), for C and `arm` as in `At`."""
    chain, mass = problem.chain, problem.system.weights[0]
    found = np.zeros_like(c)
    if name == "heading_inertia":
        found[:, 3] = -0.5 * c[:, 3] / np.asarray(chain.heading_inertia)  # type: ignore[union-attr]
        return found
    c2 = c[:, 2:3]
    e = c[:, :2] / c2
    if name == "radius":
        found[:, :2] = arm * c2
        found[:, :3] -= mass * (e * arm).sum(axis=1, keepdims=True) * c2**2 * c[:, :3]
    else:
        size = (e * e).sum(axis=1, keepdims=True) if name == "density" else 1.0
        found[:, :3] = -0.5 * chain.w * c2**2 * size * c[:, :3]
    return found


class Parameters:
    """The derivatives by the parameters of a chain and its loads, which steps back add up.

    Attributes
    ----------
    by_disc : {name: (n,)}, by inertias and radii. rates : whether `add` needs what is `Passed`.
    """

    def __init__(self, equations: Equations, names: Iterable[str]) -> None:
        self._equations, problem = equations, equations.problem
        self.by_disc = {name: np.zeros(problem.chain.n) for name in names if name in INERTIAS}
        self._springs = {name: Springs(problem, name) for name in names if name in STIFFNESSES}
        self._loads = [load_parameter(problem, name) for name in names if name.startswith("loads")]
        self._stretched: Any = 0.0
        self._weight = weight(problem) if "density" in self.by_disc else None
        self.rates = bool(self._springs or self._loads) or self._weight is not None

    def add(self, sums: Float, passed: Passed | None) -> None:
        """Add what some steps contribute: `sums` as in `linearised.weigh`, (4, n)."""
        for name, found in self.by_disc.items():
            found += sums[INERTIAS.index(name)] * (1.0 if name == "radius" else self._equations.chain.w)
        if passed is None:
            return
        if self._weight is not None:
            self.by_disc["density"] += (self._weight * passed.w.sum(axis=0)).sum(axis=0)
        if self._springs:
            self._stretched = self._stretched + self._equations.stretched(passed)
        for load in self._loads:
            load.add(passed)

    def add_stages(self, at: At, m: Float) -> None:
        """Add what states with multipliers m (M, size) contribute: the plain twin of `linearised.weigh`."""
        (count, rows, n), size, sums = at.q.shape, at.q[0].size, np.zeros((len(INERTIAS), at.q.shape[2]))
        nu, column = m[:, size:].reshape(count, -1, n), np.arange(rows) // 3
        w = at.c * nu[:, column]
        mu = m[:, :size].reshape(at.q.shape) + self._equations.dragged(at, w)
        force = mu * at.pi[:, column] - nu[:, column] * at.unbalanced
        for name in self.by_disc:
            share = 1.0 if name == "radius" else self._equations.chain.w
            sums[INERTIAS.index(name)] = (self.basis_by(at, name) * force).sum(axis=(0, 1)) / share
        self.add(sums, Passed(at.t, at.q, at.velocity, w, at.each))

    def basis_by(self, at: At, name: str) -> Float:
        """dC by a parameter of `by_disc`, (M, rows, n)."""
        return basis_by(self._equations.problem, at.c, at.arm, name)

    def found(self) -> dict[str, Float]:
        """All derivatives by their names, in the shapes of the parameters."""
        springs = {name: springs.by_stiffness(self._stretched) for name, springs in self._springs.items()}
        return self.by_disc | springs | {load.name: load.total() for load in self._loads}


def weight(problem: Problem) -> Float | None:
    """What a load gains with the density, (rows, n): weight is proportional to it. None without loads."""
    lighter, chain, q = problem.system.load, problem.chain, problem.start().hi
    heavier = replace(problem, chain=replace(chain, density=np.asarray(chain.density) + 1.0)).system.load
    if lighter is None or heavier is None:
        return None
    still = np.zeros_like(q)
    gained: Float = heavier.applied(0.0, q, still) - lighter.applied(0.0, q, still)
    return gained


class Springs:
    """Which springs a stiffness of the chain belongs to: (stiffness) = factor times the value at `index`, for `where`."""

    def __init__(self, problem: Problem, name: str) -> None:
        chain = problem.chain
        shape = np.shape(getattr(chain, name))
        size = int(np.prod(shape))

        def with_values(values: Float) -> Float:
            given: dict[str, Any] = {name: values.reshape(shape)}
            other = replace(problem, chain=replace(chain, **given), loads=())
            return other.system.strains(self.shape).stiffness

        self.shape, self.size = problem.system.shape(problem.start().hi), size
        one, two = with_values(np.ones(size)), with_values(2 * np.ones(size))
        self.where = np.flatnonzero(two != one)
        self.factor = one[self.where]
        self.index = np.rint(with_values(np.arange(1.0, size + 1))[self.where] / self.factor).astype(int) - 1

    def by_stiffness(self, stretched: Float) -> Float:
        """M . df by the stiffness, of its size, from the sum of s (B C nu) for each spring, (springs,)."""
        found: Float = np.bincount(self.index, -stretched[self.where] * self.factor, self.size).astype(float)
        return found
