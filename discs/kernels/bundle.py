"""LANES chains side by side (`discs.kernels.slaved_lanes.Bundle`): parameters, a state, what is seen of it, the checks of a run.

Steps go on to the next sweep until each chain has converged. The driver stops at the first chain that blows up, loses a heading or
has a step that is too long; each of them is then run by itself.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import driver, shared, slaved_stages  # noqa: F401, the sweeps
from discs.kernels import protocol as do
from discs.kernels.abreast import Abreast
from discs.kernels.compiled import fill
from discs.kernels.lanes import HALO
from discs.kernels.slaved import Slaved
from discs.kernels.slaved_lanes import Bundle, apart
from discs.kernels.slaved_matrix import RING
from discs.kernels.vectors import LANES, larger, load, store, zero


def bundles(chains: Sequence[Slaved], numbers: NDArray, bounds: NDArray) -> list[Bundle]:
    """Bundles of chains, each of which may be in several; of linear curvature and without loads.

    numbers : (M, LANES), the chains of each bundle. bounds : (M, LANES), blow-up thresholds of their kinetic energies.
    """
    flat, known, made = [_flat(chain) for chain in chains], dict[bytes, NDArray](), []
    first, n = chains[0], chains[0].radius.size
    order, sizes = Abreast(n, n, 0, first.ends == RING), [part.size for part in flat[0]]
    table = np.array([np.concatenate([part.ravel() for part in parts]) for parts in flat])
    for which, bound in zip(numbers, bounds, strict=True):
        if (key := which.tobytes()) not in known:
            known[key] = np.ascontiguousarray(table[which].T)
        radius, weights, bend, torsion, hessian, twist, corner, springs, length, shift, half = (
            part.reshape(*given.shape[:-1], -1)
            for part, given in zip(np.split(known[key], np.cumsum(sizes)[:-1]), flat[0], strict=True)
        )
        made.append(
            Bundle(
                order, radius, weights, bend, torsion, hessian, twist, corner, springs, first.scale, length, shift, half,
                first.ends, first.rolling, first.load, np.ascontiguousarray(bound), np.empty(LANES),
            )
        )  # fmt: skip
    return made


def _flat(chain: Slaved) -> list[NDArray]:
    """The arrays of a chain, one entry for each row of a lane."""
    bend, torsion, springs = apart(chain)
    halo = HALO // LANES
    inner = [np.pad(values, halo, mode="wrap" if chain.ends == RING else "constant") for values in (bend, torsion[:-1])]
    rows = chain.radius, chain.weights, *inner, chain.links.hessian, chain.links.twist, chain.links.corner, springs
    return [*rows, chain.scale[:1], chain.shift[:, None], np.array([0.5 / chain.k])]


class Phases(NamedTuple):
    """States of LANES chains, disc by disc: hi, lo (3, n'), pi (1, n')."""

    hi: NDArray
    lo: NDArray
    pi: NDArray


fill(do.take, Phases)(shared._take)
fill(do.rate, Phases)(shared._rate)
fill(do.kick, Phases)(shared._kick)


@fill(do.like, Phases, _nrt=True)
def _like(state):
    return Phases(np.empty_like(state.hi), np.empty_like(state.lo), np.empty_like(state.pi))


@fill(do.kinetic, Phases)
def _kinetic(state, chain, h):
    """The largest kinetic energy in units of each chain's bound; infinite if one is not finite."""
    total, pi, worst = zero(), state.pi[0], 0.0
    for i in range(0, pi.size, LANES):
        total = total + load(pi, i) * load(pi, i)
    store(chain.spare, 0, 0.5 * total / load(chain.bound, 0))
    for lane in range(LANES):
        worst = max(worst, chain.spare[lane] if chain.spare[lane] < np.inf else np.inf)
    return worst


@fill(driver.judge, Bundle)
def _judge(chain, start, end, place, defect):
    """For each chain: defect (2, 3 LANES)."""
    worst = 0.0
    for row in range(3):
        off, size, x, to = zero(), zero(), end[row], place[row]
        for i in range(0, to.size, LANES):
            off, size = larger(abs(load(to, i)), off), larger(abs(load(x, i)), size)
            store(to, i, load(x, i))
        store(defect[0], LANES * row, off / 12.0)
        store(defect[1], LANES * row, size)
        for j in range(LANES * row, LANES * (row + 1)):
            worst = max(worst, defect[0, j] / (defect[1, j] if defect[1, j] > 0 else 1.0))
    return worst
