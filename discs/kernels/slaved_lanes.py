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
from discs.kernels.lanes import HALO, Order, order, put
from discs.kernels.limits import LOST_HEADING
from discs.kernels.meeting import meet
from discs.kernels.orders import close_links, first_links, join, matrices, most, pick, previous, rejoin
from discs.kernels.parts import Part, beside, side
from discs.kernels.slaved import Slaved
from discs.kernels.slaved_matrix import GHOST, RING
from discs.kernels.vectors import LANES, after, load, store

MANY = 64  # discs from which lanes are used; they need rows of two discs behind `Order.first`
MOST = 100_000  # discs up to which they are: they take half as much memory again, 0.3 GiB for a million discs


class Laned(NamedTuple):
    """Parameters of `Slaved` in lanes, (n',). bend, torsion : (n' + 2 HALO,). springs : (2,), bending of consistent ends.

    length : (LANES,), the scale of x and y. half : (LANES,), 1/2k.
    """

    order: Order | Part
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


def arranged(chain: Slaved, own: Order | Part | None = None) -> Laned:
    """The parameters in lanes, for linear curvature; of a part of the chain if its order is given."""
    n, ring, links = chain.radius.size, chain.ends == RING, chain.links
    own = own or order(n)
    weights = put(own, chain.weights)
    weights[2, weights[2] == 0.0] = 1.0  # what belongs to no disc
    bend, torsion, springs = apart(chain)
    return Laned(
        own,
        put(own, chain.radius),
        weights,
        put(own, bend, 0.0, HALO, ring),
        put(own, torsion[:n], 0.0, HALO, ring),
        put(own, links.hessian),
        put(own, links.twist),
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
        last, lost = previous(chain.order, load(x, end), load(e, end))
        for i in range(0, x.size, LANES):
            here, low = load(x, i), load(e, i)
            store(to, HALO + i, (here - last) + (low - lost))
            last, lost = here, low
    first_links(chain.order, ring, chain.shift, hi, lo, work.base)
    join(chain.order, ring, work.base)


@fill(close_links, Order)
def _close_links(order, ends, x):
    first, end = HALO + LANES * order.first, HALO + LANES * order.rows
    for axis in range(2):
        to = x[axis]
        store(to, end, after(load(to, HALO)))
        if ends == RING:
            to[end + LANES - 1] = to[first]
        else:
            close_left(order, ends, to)
            close_right(order, ends, to)
        before_first(order, to)


@fill(close_links, Part)
def _close_links_of_part(order, ends, x):
    first, end, notes = HALO + LANES * order.first, HALO + LANES * order.rows, order.real[side(order)]
    for axis in range(2):
        notes[order.number, axis] = x[axis, first]
    meet(order.arrived, order.number)
    _, on = beside(order)
    for axis in range(2):
        to = x[axis]
        store(to, end, after(load(to, HALO)))
        to[end + LANES - 1] = notes[on, axis]
        if ends != RING and order.left == 0:
            close_left(order, ends, to)
        if ends != RING and order.right == 2:
            close_right(order, ends, to)
        before_first(order, to)


@part
def close_left(order, ends, x):
    """Set the link before the first disc."""
    first, second, third = HALO + order.places[0], x[HALO + order.places[1]], x[HALO + order.places[2]]
    x[first] = 3 * (second - third) + x[HALO + order.places[3]] if ends == GHOST else 2 * second - third


@part
def close_right(order, ends, x):
    """Set the link after the last disc."""
    end, last = HALO + LANES * (order.rows + 1) - 1, HALO + LANES * order.rows - 1
    x[end] = 3 * (x[last] - x[last - LANES]) + x[last - 2 * LANES] if ends == GHOST else 2 * x[last] - x[last - LANES]


@part
def before_first(order, x):
    """Set the links of what belongs to no disc, so that its headings are those of disc 0."""
    first, second = HALO + LANES * order.first, x[HALO + order.places[1]]
    for i in range(first - LANES, HALO - 1, -LANES):
        x[i] = x[first] + second - x[i + LANES]


@part
def moved(chain, base, move, d):
    """d = the links (2, n' + 2 HALO) after a move."""
    end = move.shape[1] - LANES
    ends = previous(chain.order, load(move[0], end), load(move[1], end))
    for axis in range(2):
        x, from_, to, last = move[axis], base[axis], d[axis], ends[axis]
        for i in range(0, x.size, LANES):
            here = load(x, i)
            store(to, HALO + i, load(from_, HALO + i) + (here - last))
            last = here
    if chain.ends == RING:
        rejoin(chain.order, base, move, d)
    close_links(chain.order, chain.ends, d)


@fill(do.spend, *LANED)
def _spend(chain, state, t, weight, move, v, scale):
    do.spend(chain.load, state, t, weight, move, v, scale)


@fill(do.vanishing, *LANED)
def _vanishing(chain):
    return do.vanishing(chain.rolling)


fill(do.most, *LANED)(lanes.most)
fill(do.added, *LANED)(lanes.added)
fill(do.halted, *LANED)(lanes.halted)


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
                worst, disc = nearest, chain.order.disc + rows * lane + row - chain.order.first
            slope[0, i], slope[1, i] = bx, by
    nearest = -most(chain.order, -worst)
    return int(most(chain.order, disc if worst == nearest else -1.0))
