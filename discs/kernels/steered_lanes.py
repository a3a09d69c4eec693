"""Discs with their own headings in lanes: one chain (`discs.kernels.lanes`) or several (`discs.kernels.abreast`).

`discs.kernels.steered_passes` has their sweeps; `discs.kernels.steered` is the same disc by disc, for few discs, elements of degree
2 and other methods.

A link is in the row of the disc after it.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import lanes, steered_blocks
from discs.kernels import protocol as do
from discs.kernels.abreast import Abreast
from discs.kernels.compiled import fill
from discs.kernels.lanes import HALO, Order, order, put
from discs.kernels.orders import first_links, join, previous
from discs.kernels.parts import Part
from discs.kernels.steered import Steered
from discs.kernels.steered_links import turn
from discs.kernels.vectors import LANES, load, store

MANY = 64  # discs from which lanes are used; they need rows of two discs behind `Order.first`
MOST = 100_000  # discs up to which they are


class Turning(NamedTuple):
    """Parameters of `Steered` in lanes, (rows, n'). stiffness : (4, n' + 2 HALO), `scaled`.

    length, per : (LANES,), the scale of x and y, 1/k.
    """

    order: Order | Part
    weights: NDArray
    paces: NDArray
    stiffness: NDArray
    scale: NDArray
    length: NDArray
    shift: NDArray
    per: NDArray
    ring: bool
    load: Any


class TurningBundle(NamedTuple):
    """The same of LANES chains side by side, of the same number of discs.

    shift : (4, LANES). scale : of the first chain; what converges is measured by `length`. bound : (LANES,), blow-up threshold of
    the kinetic energy of each chain. spare : (LANES,), workspace.
    """

    order: Abreast
    weights: NDArray
    paces: NDArray
    stiffness: NDArray
    scale: NDArray
    length: NDArray
    shift: NDArray
    per: NDArray
    ring: bool
    load: Any
    bound: NDArray
    spare: NDArray


TURNING = Turning, TurningBundle


def arranged(chain: Steered, own: Order | Part | None = None) -> Turning:
    """The parameters of one chain in lanes, for links of degree 1; of a part of it if its order is given."""
    n = chain.weights.shape[1]
    own = own or order(n)
    length, per = np.full(LANES, chain.scale[0]), np.full(LANES, 1 / chain.k)
    parts = put(own, chain.weights), put(own, chain.paces), put(own, scaled(chain)[:, :n], 0.0, HALO, chain.ring)
    return Turning(own, *parts, chain.scale, length, chain.shift, per, chain.ring, lanes.loaded(own, chain.load))


def scaled(chain: Steered) -> NDArray:
    """The stiffness of links (4, n + 1) for stretch, shear and differences of theta and phi; 0 at free ends."""
    return chain.stiffness * np.array([1.0, 1.0, chain.k**-2, chain.k**-2])[:, None]


class Workspace(NamedTuple):
    """Workspace, with a halo: base (4, n' + 2 HALO), links of the base position; half, half a step; middle, strain
    (2, n' + 2 HALO), cosine and sine of the mean headings of links, their stretch and shear.

    heading : (2, n'), cosine and sine. section : (4, n' + LANES), `along` and `across` of links, see `discs.kernels.steered`.
    c : (4, n' + HALO). step : (4, n'), for loads. b : (2, n'). spare : (LANES,).
    """

    base: NDArray
    half: NDArray
    middle: NDArray
    strain: NDArray
    heading: NDArray
    section: NDArray
    c: NDArray
    step: NDArray
    b: NDArray
    spare: NDArray
    matrix: Any


@fill(do.workspace, *TURNING, _nrt=True)
def _workspace(chain):
    n = chain.weights.shape[1]
    base, half = np.zeros((4, n + 2 * HALO)), np.zeros((4, n + 2 * HALO))
    middle, strain, heading = np.zeros((2, n + 2 * HALO)), np.zeros((2, n + 2 * HALO)), np.zeros((2, n))
    section, c, b = np.zeros((4, n + LANES)), np.zeros((4, n + HALO)), np.zeros((2, n))
    step = np.zeros((4, n * do.loaded(chain.load)))
    matrix = steered_blocks.matrices(chain.order, chain.ring, 1.0, 1)
    return Workspace(base, half, middle, strain, heading, section, c, step, b, np.empty(LANES), matrix)


@fill(do.factors, *TURNING, _nrt=True)
def _factors(chain, g, count):
    return steered_blocks.matrices(chain.order, chain.ring, g, count)


@fill(do.pick, *TURNING)
def _pick(chain, m, j):
    return steered_blocks.pick(m, j)


fill(do.place, Turning)(lanes.place)
fill(do.enter, Turning, _nrt=True)(lanes.enter)
fill(do.leave, Turning)(lanes.leave)


@fill(do.settle, *TURNING)
def _settle(chain, work, hi, lo):
    base, end, per = work.base, LANES * (chain.order.rows - 1), load(chain.per, 0)
    for row in range(4):
        x, e, to = hi[row], lo[row], base[row]
        last, lost = previous(chain.order, load(x, end), load(e, end))
        for i in range(0, x.size, LANES):
            here, low = load(x, i), load(e, i)
            store(to, HALO + i, (here - last) + (low - lost))
            last, lost = here, low
    first_links(chain.order, chain.ring, chain.shift, hi, lo, base)
    join(chain.order, chain.ring, base)
    for i in range(0, hi.shape[1], LANES):
        j = HALO + i
        phi = load(hi[3], i) + load(lo[3], i)
        cos, sin = turn(phi)
        store(work.heading[0], i, cos)
        store(work.heading[1], i, sin)
        cos, sin = turn(phi - 0.5 * load(base[3], j))
        x, y = load(base[0], j), load(base[1], j)
        store(work.middle[0], j, cos)
        store(work.middle[1], j, sin)
        store(work.strain[0], j, (cos * x + sin * y) * per - 1.0)
        store(work.strain[1], j, (cos * y - sin * x) * per)
    join(chain.order, chain.ring, work.middle)
    join(chain.order, chain.ring, work.strain)


@fill(do.spend, *TURNING)
def _spend(chain, state, t, weight, move, v, scale):
    do.spend(chain.load, state, t, weight, move, v, scale)


@fill(do.vanishing, *TURNING)
def _vanishing(chain):
    return False


fill(do.most, *TURNING)(lanes.most)
fill(do.added, *TURNING)(lanes.added)
fill(do.halted, *TURNING)(lanes.halted)


@fill(do.lost, *TURNING)
def _lost(chain, work, slope):
    return -1
