"""What the rates of the reduced equations change by with parameters of a chain, for `discs.analysis.adjoint`.

With multipliers M = (mu, nu) and f = (C pi, -C^T g), g = grad V - F, a parameter changes M . f by

    (mu + F_v^T C nu) . dC pi - (dC nu) . g,   and   -(stiffness) s (B C nu)   for a change of a stiffness, relative to it.

C depends on the density rho, spin inertia alpha and radius R of its own disc only: its column is (e, 1)/root with
root² = w (alpha + rho |e|²) and e = R times a vector; with own headings there is 1/sqrt(w J) besides. Initial momenta depend on
them too: pi = root omega. And weight, a part of F, is proportional to rho.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from discs.analysis.linear import Linearised
from discs.arrays import Float
from discs.problem import Problem

INERTIAS = ("density", "spin_inertia", "radius", "heading_inertia")
STIFFNESSES = ("torsion_stiffness", "bending_stiffness", "stretch_stiffness", "shear_stiffness")


def basis_by(lin: Linearised, name: str) -> Float:
    """dC by a parameter of the discs, (rows, n), disc by disc."""
    c, chain, mass = lin.basis, lin.problem.chain, lin.system.weights[0]
    found = np.zeros_like(c)
    if name == "heading_inertia":
        found[3] = -0.5 * c[3] / np.asarray(chain.heading_inertia)  # type: ignore[union-attr]
        return found
    e, shrink = c[:2] / c[2], 0.5 * chain.w * c[2] ** 2
    if name == "spin_inertia":
        found[:3] = -shrink * c[:3]
    elif name == "density":
        found[:3] = -shrink * (e * e).sum(axis=0) * c[:3]
    else:
        arm = replace(lin.problem, chain=replace(chain, radius=1.0), loads=()).system.contact(lin.shape)
        found[:2] = arm * c[2]
        found[:3] -= mass * (e * arm).sum(axis=0) * c[2] ** 2 * c[:3]
    return found


def by_inertia(lin: Linearised, m: Float, name: str) -> Float:
    """M . df by a parameter of the discs, (n,)."""
    c, rows = basis_by(lin, name), len(lin.basis)
    mu, nu = m[: lin.basis.size].reshape(lin.basis.shape), m[lin.basis.size :].reshape(-1, lin.system.n)
    pi, load = np.atleast_2d(lin.z.pi), lin.system.load
    column = np.arange(rows) // 3
    if load is not None:
        drag = load.derivatives(lin.t, lin.z.hi + lin.z.lo, lin.velocity)[1]
        mu = mu + (drag.T @ (lin.basis * nu[column]).ravel()).reshape(mu.shape)
    found: Float = (c * (mu * pi[column] - nu[column] * lin.unbalanced)).sum(axis=0)
    if load is not None and name == "density":  # weight is proportional to it
        chain = lin.problem.chain
        heavier = replace(lin.problem, chain=replace(chain, density=np.asarray(chain.density) + 1.0)).system.load
        assert heavier is not None
        q = lin.z.hi + lin.z.lo
        gained = heavier.applied(lin.t, q, lin.velocity) - load.applied(lin.t, q, lin.velocity)
        found = found + (lin.basis * nu[column] * gained).sum(axis=0)
    return found


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

    def by_stiffness(self, lin: Linearised, m: Float) -> Float:
        """M . df by the stiffness, of its size."""
        strains, n = lin.strains, lin.system.n
        nu = m[lin.basis.size :].reshape(-1, n)
        along = (lin.basis * nu[np.arange(len(lin.basis)) // 3]).ravel()
        each = -(strains.strain * (strains.matrix @ along))[self.where] * self.factor
        found: Float = np.bincount(self.index, each, self.size).astype(float)
        return found
