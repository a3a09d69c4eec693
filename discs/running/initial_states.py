"""The initial states of many chains of one kind as arrays, by the formulas of `discs.chains.slaved` and `discs.chains.steered`."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from discs.arrays import Float
from discs.chains import stencils
from discs.chains.chain import Chain, SteeredChain
from discs.problem import BLOW_UP, Problem, rounding_energy

Each = Callable[[Sequence[Any]], Float]  # values of the distinct chains -> those of all problems, (B, ...)


class InitialStates:
    """The initial states of B problems whose chains are of one kind.

    Attributes
    ----------
    parameters : of the distinct chains. chains : (B,), the number of each problem's chain among these.
    rows, rates : the names of positions, and of the rates from theta on.
    q : (B, rows, n), initial positions. momenta : (B, columns, n). energy : (B,), at the start. bounds : (B,), as
        `Problem.blown_up`. stiffest : (B,), as in the systems.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        number: dict[int, int] = {}
        first: list[Problem] = []
        for problem in problems:
            if id(problem.chain) not in number:
                number[id(problem.chain)] = len(first)
                first.append(problem)
        self.chains = np.array([number[id(problem.chain)] for problem in problems])
        systems, chains = [problem.system for problem in first], [problem.chain for problem in first]
        self.parameters = [system.parameters for system in systems]
        self.rows, self.rates = systems[0].rows, systems[0].rates[2:]

        def each(values: Sequence[Any]) -> Float:
            found: Float = np.array(values, float)[self.chains]
            return found

        starts = [problem.initial for problem in problems]
        self.q = np.array([[getattr(start, name) for name in self.rows] for start in starts])
        links = stencils.links(self.q, chains[0].ends)
        if chains[0].ends == "ring":
            links[..., -1] += each([given.shift for given in self.parameters])
        rates = np.array([[getattr(start, name) for name in self.rates] for start in starts])
        if isinstance(chains[0], SteeredChain):
            roots, twice = _steered(self.parameters, self.q, links, each)
        else:
            roots, twice = _slaved(self.parameters, chains[0], links, each)
        self.momenta = roots * rates
        self.energy = 0.5 * ((self.momenta**2).sum(axis=(1, 2)) + twice)
        self.bounds = BLOW_UP * self.energy + each([rounding_energy(chain) for chain in chains])
        self.stiffest = each([system.stiffest for system in systems])


def _slaved(parameters: Sequence[Any], chain: Chain, links: Float, each: Each) -> tuple[Float, Float]:
    """Roots of the inertias (B, 1, n), and twice the elastic energies (B,)."""
    slope = stencils.slopes(links[:, :2], each([given.k for given in parameters])[:, None, None], chain.ends).swapaxes(0, 1)
    arm = chain.rolling_law.arm(each([given.radius for given in parameters]), slope)
    weights = each([given.weights for given in parameters])
    inertia = weights[:, 2] + weights[:, 0] * ((slope[1] * arm) ** 2 + (slope[0] * arm) ** 2)
    bends = (stencils.bends(links[:, :2], chain.ends) ** 2).sum(axis=1)
    torsion = each([given.links.torsion for given in parameters])[:, 1 : 1 + links.shape[2]]
    bend = each([given.links.bend for given in parameters])
    return np.sqrt(inertia)[:, None], (bend * bends).sum(axis=1) + (torsion * links[:, 2] ** 2).sum(axis=1)


def _steered(parameters: Sequence[Any], q: Float, links: Float, each: Each) -> tuple[Float, Float]:
    """Roots of the inertias (B, 2, n), and twice the elastic energies (B,)."""
    count, k = links.shape[2], each([given.k for given in parameters])[:, None]
    middle = q[:, 3, :count] + 0.5 * links[:, 3]
    cos, sin = np.cos(middle), np.sin(middle)
    strain = links / k[:, None]
    strain[:, 0], strain[:, 1] = cos * strain[:, 0] + sin * strain[:, 1] - 1, cos * strain[:, 1] - sin * strain[:, 0]
    stiffness = each([given.stiffness for given in parameters])[:, :, 1 : 1 + count]
    roots = 1 / each([given.paces for given in parameters])[:, 1:]
    return roots, (stiffness * strain**2).sum(axis=(1, 2))
