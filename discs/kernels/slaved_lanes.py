"""Many discs with slaved headings, in lanes (`discs.kernels.lanes`): parameters, workspace, links.

`discs.kernels.slaved_sweeps` has their sweeps; `discs.kernels.slaved` is the same disc by disc, for few discs and other methods.

A link is in the row of the disc after it.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import lanes
from discs.kernels import protocol as do
from discs.kernels.abreast import Abreast
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import HALO, Order, order
from discs.kernels.limits import LOST_HEADING
from discs.kernels.orders import close_links, first_links, join, matrices, pick, previous, rejoin
from discs.kernels.slaved import Slaved
from discs.kernels.slaved_matrix import GHOST, RING
from discs.kernels.vectors import LANES, after, load, store

MANY = 64  # discs from which lanes are used; they need rows of two discs behind `Order.first`
MOST = 100_000  # discs up to which they are: they take half as much memory again, 0.3 GiB for a million discs


class Laned(NamedTuple):
    """Parameters of `Slaved` in lanes, (n',). bend, torsion : (n' + 2 HALO,). springs : (2,), bending of consistent ends.

    length : (LANES,), the scale of x and y. half : (LANES,), 1/2k.
    """

    order: Order
    radius: NDArray
    weights: NDArray
    bend: NDArray
    torsion: NDArray
    hessian: NDArray
    twist: NDArray
    corner: NDArray
    springs: NDArray
    scale: NDArray
    length: NDArray
    shift: NDArray
    half: NDArray
    ends: int
    rolling: Any
    load: Any


class Bundle(NamedTuple):
    """The same of LANES chains side by side (`discs.kernels.abreast`), of the same kind, number of discs and law.

    springs, corner : (2 LANES,). shift : (3, LANES). scale : of the first chain; what converges is measured by `length`.
    bound : (LANES,), blow-up threshold of the kinetic energy of each chain. spare : (LANES,), workspace.
    """

    order: Abreast
    radius: NDArray
    weights: NDArray
    bend: NDArray
    torsion: NDArray
    hessian: NDArray
    twist: NDArray
    corner: NDArray
    springs: NDArray
    scale: NDArray
    length: NDArray
    shift: NDArray
    half: NDArray
    ends: int
    rolling: Any
    load: Any
    bound: NDArray
    spare: NDArray


LANED = Laned, Bundle


def apart(chain: Slaved) -> tuple[NDArray, NDArray, NDArray]:
    """Bending inside, (n,), torsion (n + 1,), and the bending of consistent ends, (2,)."""
    bend, torsion, springs = chain.links.bend.copy(), chain.links.torsion.copy(), np.zeros(2)
    if chain.ends == GHOST:
        springs[:], bend[[0, -1]] = bend[[0, -1]], 0.0
    if chain.ends != RING:
        torsion[[0, -1]] = 0.0
    return bend, torsion, springs


def arranged(chain: Slaved) -> Laned:
    """The parameters in lanes, for linear curvature."""
    n, ring = chain.radius.size, chain.ends == RING
    own, links = order(n), chain.links

    def put(values: NDArray, rest: float = 0.0, halo: int = 0) -> NDArray:
        to = np.full((*values.shape[:-1], LANES * own.rows + 2 * halo), rest)
        to[..., halo + own.places] = values[..., :n]
        if halo:
            join(own, ring, to)
        return to

    weights = put(chain.weights)
    weights[2, weights[2] == 0.0] = 1.0  # what belongs to no disc
    bend, torsion, springs = apart(chain)
    return Laned(
        own,
        put(chain.radius),
        weights,
        put(bend, halo=HALO),
        put(torsion, halo=HALO),
        put(links.hessian),
        put(links.twist),
        links.corner,
        springs,
        chain.scale,
        np.full(LANES, chain.scale[0]),
        chain.shift,
        np.full(LANES, 0.5 / chain.k),
        chain.ends,
        chain.rolling,
        lanes.loaded(own, chain.load),
    )


class Workspace(NamedTuple):
    """Workspace, (3, n' + 2 HALO): base, links of the base position; links, of a moved one; half, half a step. c : (3, n' + HALO).

    step : (3, n'), for loads. b : (1, n'). spare : (LANES,). matrix : one of `orders.matrices`.
    """

    base: NDArray
    links: NDArray
    half: NDArray
    c: NDArray
    step: NDArray
    b: NDArray
    spare: NDArray
    matrix: Any


@fill(do.workspace, *LANED, _nrt=True)
def _workspace(chain):
    n = chain.radius.size
    base, links, half = np.zeros((3, n + 2 * HALO)), np.zeros((3, n + 2 * HALO)), np.zeros((3, n + 2 * HALO))
    c, step, b = np.zeros((3, n + HALO)), np.zeros((3, n * do.loaded(chain.load))), np.zeros((1, n))
    return Workspace(base, links, half, c, step, b, np.empty(LANES), matrices(chain.order, 1.0, 1))


@fill(do.factors, *LANED, _nrt=True)
def _factors(chain, g, count):
    return matrices(chain.order, g, count)


@fill(do.pick, *LANED)
def _pick(chain, m, j):
    return pick(m, j)


fill(do.place, Laned)(lanes.place)
fill(do.enter, Laned, _nrt=True)(lanes.enter)
fill(do.leave, Laned)(lanes.leave)


@fill(do.settle, *LANED)
def _settle(chain, work, hi, lo):
    end, ring = LANES * (chain.order.rows - 1), chain.ends == RING
    for axis in range(3):
        x, e, to = hi[axis], lo[axis], work.base[axis]
        last, lost = previous(chain.order, load(x, end)), previous(chain.order, load(e, end))
        for i in range(0, x.size, LANES):
            here, low = load(x, i), load(e, i)
            store(to, HALO + i, (here - last) + (low - lost))
            last, lost = here, low
        first_links(chain.order, ring, chain.shift[axis], x, e, to)
        join(chain.order, ring, to)


@fill(close_links, Order)
def _close_links(order, ends, x):
    first, last, end = HALO + LANES * order.first, HALO + LANES * order.rows - 1, HALO + LANES * order.rows
    store(x, end, after(load(x, HALO)))
    second, third = x[HALO + order.places[1]], x[HALO + order.places[2]]
    if ends == RING:
        x[end + LANES - 1] = x[first]
    elif ends == GHOST:
        x[first] = 3 * (second - third) + x[HALO + order.places[3]]
        x[end + LANES - 1] = 3 * (x[last] - x[last - LANES]) + x[last - 2 * LANES]
    else:
        x[first] = 2 * second - third
        x[end + LANES - 1] = 2 * x[last] - x[last - LANES]
    for i in range(first - LANES, HALO - 1, -LANES):
        x[i] = x[first] + second - x[i + LANES]


@part
def moved(chain, base, move, d):
    """d = the links (2, n' + 2 HALO) after a move."""
    for axis in range(2):
        x, from_, to = move[axis], base[axis], d[axis]
        last = previous(chain.order, load(x, x.size - LANES))
        for i in range(0, x.size, LANES):
            here = load(x, i)
            store(to, HALO + i, load(from_, HALO + i) + (here - last))
            last = here
        if chain.ends == RING:
            rejoin(chain.order, from_, x, to)
        close_links(chain.order, chain.ends, to)


@fill(do.spend, *LANED)
def _spend(chain, state, t, weight, move, v, scale):
    do.spend(chain.load, state, t, weight, move, v, scale)


@fill(do.vanishing, *LANED)
def _vanishing(chain):
    return do.vanishing(chain.rolling)


@fill(do.lost, *LANED)
def _lost(chain, work, slope):
    disc = -1
    if not do.vanishing(chain.rolling):
        return disc
    d, worst, rows = work.base, LOST_HEADING**2, chain.order.rows
    for lane in range(LANES):
        half = chain.half[lane]
        for row in range(chain.order.first if lane == 0 else 0, rows):
            i = LANES * row + lane
            j = HALO + i
            ax, ay = slope[0, i], slope[1, i]
            bx, by = (d[0, j] + d[0, j + LANES]) * half, (d[1, j] + d[1, j + LANES]) * half
            mx, my = bx - ax, by - ay
            part = min(max(-(ax * mx + ay * my) / max(mx * mx + my * my, 1e-300), 0.0), 1.0)
            nearest = (ax + part * mx) ** 2 + (ay + part * my) ** 2
            if nearest < worst:
                worst, disc = nearest, rows * lane + row - chain.order.first
            slope[0, i], slope[1, i] = bx, by
    return disc
