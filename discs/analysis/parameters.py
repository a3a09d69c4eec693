"""What the rates of the reduced equations change by with parameters of a chain, for `discs.analysis.adjoint`.

With multipliers M = (mu, nu) and f = (C pi, -C^T g), g = grad V - F, a parameter changes M . f by

    (mu + F_v^T C nu) . dC pi - (dC nu) . g,   and   -(stiffness) s (B C nu)   for a change of a stiffness, relative to it.

C depends on the density rho, spin inertia alpha and radius R of its own disc only: its column is (e, 1)/root with
root² = w (alpha + rho |e|²) and e = R times a vector; with own headings there is 1/sqrt(w J) besides. Initial momenta depend on
them too: pi = root omega. And weight, a part of F, is proportional to rho. `discs.analysis.forces` has the parameters of loads.
"""

from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from discs.analysis.stages import At, Equations
from discs.arrays import Float
from discs.problem import Problem

INERTIAS = ("density", "spin_inertia", "radius", "heading_inertia")
STIFFNESSES = ("torsion_stiffness", "bending_stiffness", "stretch_stiffness", "shear_stiffness")


class Pull(NamedTuple):
    """Multipliers of the rates at M states: mu and w = C nu, (M, rows, n), and nu, (M, columns, n)."""

    mu: Float
    nu: Float
    w: Float

    @classmethod
    def of(cls, at: At, m: Float) -> "Pull":
        """Of the multipliers (M, size)."""
        (count, rows, n), size = at.q.shape, at.q[0].size
        nu = m[:, size:].reshape(count, -1, n)
        return cls(m[:, :size].reshape(at.q.shape), nu, at.c * nu[:, np.arange(rows) // 3])


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


class Inertias:
    """The sum over states of M . df by the inertias and radii of the discs."""

    def __init__(self, equations: Equations) -> None:
        self._equations, self._problem = equations, equations.problem

    def __call__(self, at: At, pull: Pull, names: list[str]) -> dict[str, Float]:
        """{name: (n,)}."""
        if not names:
            return {}
        problem, column = self._problem, np.arange(at.q.shape[1]) // 3
        mu = pull.mu if problem.system.load is None else pull.mu + self._equations.dragged(at, pull.w)
        force = mu * at.pi[:, column] - pull.nu[:, column] * at.unbalanced
        found = {name: (basis_by(problem, at.c, at.arm, name) * force).sum(axis=(0, 1)) for name in names}
        if "density" in found and problem.system.load is not None:
            found["density"] = found["density"] + (self._weight * pull.w.sum(axis=0)).sum(axis=0)
        return found

    @cached_property
    def _weight(self) -> Float:
        """What a load gains with the density, (rows, n): weight is proportional to it."""
        problem, chain, q = self._problem, self._problem.chain, self._problem.start().hi
        heavier = replace(problem, chain=replace(chain, density=np.asarray(chain.density) + 1.0)).system.load
        lighter, still = problem.system.load, np.zeros_like(q)
        assert heavier is not None
        assert lighter is not None
        return heavier.applied(0.0, q, still) - lighter.applied(0.0, q, still)


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
