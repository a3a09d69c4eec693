"""LANES chains side by side (`Bundle`, `TurningBundle`): parameters, a state, the checks of a run.

Steps go on to the next sweep until each chain has converged. The driver stops at the first chain that blows up, loses a heading or
has a step that is too long; each of them is then run by itself.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import driver, shared, slaved_stages, steered_passes, steered_stages  # noqa: F401, the sweeps
from discs.kernels import protocol as do
from discs.kernels.abreast import Abreast
from discs.kernels.compiled import fill
from discs.kernels.lanes import HALO
from discs.kernels.limits import TURNED
from discs.kernels.slaved_lanes import Bundle, apart
from discs.kernels.slaved_matrix import RING
from discs.kernels.steered import Steered
from discs.kernels.steered_lanes import TurningBundle, scaled
from discs.kernels.vectors import LANES, chosen, larger, load, store, zero


def bundles(chains: Sequence[Any], numbers: NDArray, bounds: NDArray) -> list[Any]:
    """Bundles of chains, all `Slaved` or all `Steered`, each of which may be in several; without loads.

    numbers : (M, LANES), the chains of each bundle. bounds : (M, LANES), blow-up thresholds of their kinetic energies.
    """
    flat, known, made = [_flat(chain) for chain in chains], dict[bytes, dict[str, Any]](), list[Any]()
    first, n = chains[0], chains[0].weights.shape[1]
    ring = first.ring if isinstance(first, Steered) else first.ends == RING
    order, places = Abreast(n, n, 0, ring), np.cumsum([part.size for part in flat[0].values()])[:-1]
    table = np.array([np.concatenate([part.ravel() for part in parts.values()]) for parts in flat])
    for which, bound in zip(numbers, bounds, strict=True):
        if (key := which.tobytes()) not in known:
            parts = np.split(np.ascontiguousarray(table[which].T), places)
            known[key] = {k: part.reshape(*flat[0][k].shape[:-1], -1) for k, part in zip(flat[0], parts, strict=True)}
        common: dict[str, Any] = {"order": order, "scale": first.scale, "load": first.load, "bound": np.ascontiguousarray(bound)}
        if isinstance(first, Steered):
            made.append(TurningBundle(**common, **known[key], ring=ring, spare=np.empty(LANES)))
        else:
            made.append(Bundle(**common, **known[key], ends=first.ends, rolling=first.rolling, spare=np.empty(LANES)))
    return made


def _flat(chain: Any) -> dict[str, NDArray]:
    """The arrays of a chain by name, one entry for each row of a lane."""

    def haloed(values: NDArray, ring: bool) -> NDArray:
        return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(HALO // LANES,) * 2], mode="wrap" if ring else "constant")

    common = {"weights": chain.weights, "length": chain.scale[:1], "shift": chain.shift[:, None]}
    if isinstance(chain, Steered):
        stiffness = haloed(scaled(chain)[:, :-1], chain.ring)
        return common | {"paces": chain.paces, "stiffness": stiffness, "per": np.array([1 / chain.k])}
    bend, torsion, springs = apart(chain)
    inner = {"bend": haloed(bend, chain.ends == RING), "torsion": haloed(torsion[:-1], chain.ends == RING), "springs": springs}
    links = {"hessian": chain.links.hessian, "twist": chain.links.twist, "corner": chain.links.corner}
    return common | inner | links | {"radius": chain.radius, "half": np.array([0.5 / chain.k])}


class Phases(NamedTuple):
    """States of LANES chains, disc by disc: hi, lo (rows, n'), pi (columns, n')."""

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
    total, worst = zero(), 0.0
    for row in range(state.pi.shape[0]):
        pi = state.pi[row]
        for i in range(0, pi.size, LANES):
            total = total + load(pi, i) * load(pi, i)
    store(chain.spare, 0, 0.5 * total / load(chain.bound, 0))
    for lane in range(LANES):
        worst = max(worst, chain.spare[lane] if chain.spare[lane] < np.inf else np.inf)
    return worst


@fill(driver.judge, Bundle, TurningBundle)
def _judge(chain, start, end, place, defect):
    """For each chain: defect (2, rows LANES), infinite where a heading turns by more than TURNED."""
    worst = 0.0
    for row in range(end.shape[0]):
        off, size, turned, before, x, to = zero(), zero(), zero(), start[row], end[row], place[row]
        for i in range(0, to.size, LANES):
            off, size = larger(abs(load(to, i)), off), larger(abs(load(x, i)), size)
            turned = larger(abs(load(x, i) - load(before, i)), turned)
            store(to, i, load(x, i))
        if row == 3:
            off = chosen(turned, TURNED + zero(), np.inf + zero(), off)
        store(defect[0], LANES * row, off / 12.0)
        store(defect[1], LANES * row, size)
        for j in range(LANES * row, LANES * (row + 1)):
            worst = max(worst, defect[0, j] / (defect[1, j] if defect[1, j] > 0 else 1.0))
    return worst
