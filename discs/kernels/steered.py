"""The compiled chain of discs with their own headings; `discs.chains.steered` has the derivation and the plain twin.

Arrays of links have one more at each end: link j is before disc j. On a ring links 0 and n are the same; at free ends they have no
stiffness.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.chains.chain import SteeredChain
from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.load import UNLOADED
from discs.kernels.shared import forward, renew, torques
from discs.kernels.steered_joints import JOINTS, Matrix, sizes, to_points
from discs.kernels.steered_links import pull, pulled, secant, spread, strains, turn
from discs.kernels.steered_matrix import assemble, factor, solve


class Steered(NamedTuple):
    """Parameters. weights : (4, n), inertia for each row. paces : (3, n), rates of contact point, roll and heading per unit of
    momentum.

    stiffness : (4, n + 1), k times the stiffness of stretch, shear, torsion and bending. shift : (4,), advance along a ring.
    joints : links or elements, `discs.kernels.steered_joints`.
    """

    weights: NDArray
    paces: NDArray
    stiffness: NDArray
    scale: NDArray
    shift: NDArray
    k: float
    ring: bool
    joints: Any
    load: Any


def parameters(
    given: SteeredChain,
    weights: NDArray,
    roots: NDArray,
    scale: NDArray,
    shift: NDArray,
    stiffness: NDArray,
    load: Any = UNLOADED,
) -> Steered:
    """The parameters of a chain and its load; `stiffness`, (4, n_links), is that of the links."""
    ring = given.ends == "ring"
    padded = np.zeros((4, given.n + 1))
    padded[:, 1 : 1 + stiffness.shape[1]] = stiffness
    padded[:, 0] = padded[:, -1]
    paces = np.stack([given.radius / roots[0], 1 / roots[0], 1 / roots[1]])
    return Steered(weights, paces, padded, scale, shift, given.k, ring, JOINTS[given.degree], load)


class Workspace(NamedTuple):
    """Workspace.

    Of the base position: base (4, n + 1), differences of neighbours; angles (4, n + 1), cosine and sine of headings and of the mean
    headings of links; strain (4, n + 1). Of a moved position or a step, see `discs.chains.steered`: links, along, tension
    (4, n + 1), across (2, n + 1), couple (n + 1,). joined (3, 6), see `discs.kernels.steered_joints`.
    """

    base: NDArray
    angles: NDArray
    strain: NDArray
    links: NDArray
    turned: NDArray
    along: NDArray
    tension: NDArray
    across: NDArray
    couple: NDArray
    c: NDArray
    step: NDArray
    rhs: NDArray
    matrix: Matrix
    joined: NDArray


@fill(do.workspace, Steered, _nrt=True)
def _workspace(chain):
    n = chain.weights.shape[1]
    base, angles, strain = np.zeros((4, n + 1)), np.zeros((4, n + 1)), np.zeros((4, n + 1))
    links, turned, along, tension = np.zeros((4, n + 1)), np.zeros((2, n + 1)), np.zeros((2, n + 1)), np.zeros((4, n + 1))
    m = do.factors(chain, 1.0, 1)  # not `pick`: parts count no references
    matrix = Matrix(m.d[0], m.o[0], m.ends[0], m.far[0], m.right[0], m.columns[0], m.edge[0])
    across, couple = np.zeros((2, n + 1)), np.zeros(n + 1)
    c, step, rhs = np.empty((4, n)), np.empty((4, n)), np.empty((2, n))
    return Workspace(base, angles, strain, links, turned, along, tension, across, couple, c, step, rhs, matrix, np.empty((3, 6)))


@fill(do.factors, Steered, _nrt=True)
def _factors(chain, g, count):
    n, kind = chain.weights.shape[1], np.array([g]).dtype
    ends, elements = sizes(chain.joints, n)
    d, o = np.empty((count, 3, n), kind), np.empty((count, 4, n), kind)
    near, far, right = np.empty((count, 3, ends), kind), np.empty((count, 4, elements), kind), np.empty((count, 2, ends), kind)
    return Matrix(d, o, near, far, right, np.empty((count, 2, 2, n), kind), np.empty((count, 11), kind))


@fill(do.pick, Steered)
def _pick(chain, m, j):
    return Matrix(m.d[j], m.o[j], m.ends[j], m.far[j], m.right[j], m.columns[j], m.edge[j])


@fill(do.settle, Steered)
def _settle(chain, work, hi, lo):
    n = hi.shape[1]
    for row in range(4):
        x, e, to = hi[row], lo[row], work.base[row]
        for j in range(1, n):
            to[j] = (x[j] - x[j - 1]) + (e[j] - e[j - 1])
        if chain.ring:
            to[n] = (x[0] - x[n - 1]) + (e[0] - e[n - 1]) + chain.shift[row]
            to[0] = to[n]
    x, e = hi[3], lo[3]
    cos, sin, mid_cos, mid_sin = work.angles[0], work.angles[1], work.angles[2], work.angles[3]
    phi, middle = work.step[0], work.couple
    for i in range(n):
        phi[i] = x[i] + e[i]
    for i in range(n):
        cos[i], sin[i] = turn(phi[i])
    for j in range(1, n):
        middle[j] = 0.5 * (phi[j] + phi[j - 1])
    middle[0] = middle[n] = 0.0
    if chain.ring:
        middle[n] = 0.5 * (phi[0] + chain.shift[3] + phi[n - 1])
        middle[0] = middle[n]
    to_points(chain.joints, work.base, middle, 1, n + 1)
    for j in range(n + 1):
        mid_cos[j], mid_sin[j] = turn(middle[j])
    strains(chain, work.base, mid_cos, mid_sin, work.strain)


@part
def basis_of(chain, work, dphi, c):
    """c = C after headings turned by dphi."""
    cos, sin = work.angles[0], work.angles[1]
    cx, cy, ct, cp = c[0], c[1], c[2], c[3]
    point, roll, heading = chain.paces[0], chain.paces[1], chain.paces[2]
    for i in range(dphi.size):
        a, b = turn(dphi[i])
        cx[i] = -point[i] * (sin[i] * a + cos[i] * b)
        cy[i] = point[i] * (cos[i] * a - sin[i] * b)
        ct[i], cp[i] = roll[i], heading[i]


@fill(do.basis, Steered)
def _basis(chain, work, move, c):
    basis_of(chain, work, move[3], c)


@fill(do.gradient, Steered)
def _gradient(chain, work, move, g):
    pull(chain, work, move, False)
    for row in range(4):
        x, to = work.tension[row], g[row]
        for i in range(to.size):
            to[i] = x[i] - x[i + 1]
    couple, to = work.couple, g[3]
    for i in range(to.size):
        to[i] += couple[i] + couple[i + 1]


@fill(do.pullback, Steered)
def _pullback(chain, work, state, t, move, c, p, g):
    pull(chain, work, move, False)
    pulled(work, c, g)
    do.push(chain.load, state, t, move, c, p, -1.0, g)


@fill(do.book_motors, Steered)
def _book_motors(chain, work, state, t, h, p, move):
    if do.driven(chain.load):
        pull(chain, work, move, True)
        pulled(work, work.c, work.rhs)
        do.push(chain.load, state, t, move, work.c, p, -1.0, work.rhs)
        torques(chain.load, state.pi, h, p, work.rhs)


@fill(do.sweep, Steered)
def _sweep(chain, work, state, t, h, p, move, first):
    n = p.shape[1]
    half = 0.5 * h
    c, b, m, pi = work.c, work.rhs, work.matrix, state.pi
    basis_of(chain, work, move[3], c)
    forward(c, p, work.step, half)
    pull(chain, work, work.step, True)
    pulled(work, c, b)
    for row in range(2):
        for i in range(n):
            b[row, i] = pi[row, i] - p[row, i] - half * b[row, i]
    do.push(chain.load, state, t + half, work.step, c, p, half, b)
    do.hold(chain.load, t + half, c, p, half, b)
    if first:  # later sweeps of a step use the same matrix, see `discs.integrators.midpoint`
        assemble(chain, work, c, 1.0, half * half, m)
        do.guide(chain.load, c, half, half * half, m.d[0], m.o[0], m.d[2], m.o[3])
        factor(chain, m)
    solve(chain, m, b)
    for row in range(2):
        for i in range(n):
            p[row, i] += b[row, i]
    return renew(c, p, half, move, chain.scale, b[0])


@fill(do.stiffness, Steered)
def _stiffness(chain, work, move, c, matrix):
    spread(chain, work, move, 0, work.couple.size)
    secant(work, 0, work.couple.size, chain.k, False)
    assemble(chain, work, c, 0.0, 1.0, matrix)


@fill(do.precondition, Steered)
def _precondition(chain, stiff, state, t, move, c, d, g, matrix):
    n = stiff.d.shape[1]
    for i in range(n):
        matrix.d[0, i], matrix.d[1, i], matrix.d[2, i] = 1 + g * stiff.d[0, i], g * stiff.d[1, i], 1 + g * stiff.d[2, i]
    for row in range(4):
        for i in range(n):
            matrix.o[row, i] = g * stiff.o[row, i]
        for i in range(stiff.far.shape[1]):
            matrix.far[row, i] = g * stiff.far[row, i]
    do.guide(chain.load, c, d, g, matrix.d[0], matrix.o[0], matrix.d[2], matrix.o[3])
    factor(chain, matrix)


@fill(do.correct, Steered)
def _correct(chain, matrix, r):
    solve(chain, matrix, r)


@fill(do.potential, Steered)
def _potential(chain, work):
    total = 0.0
    for row in range(4):
        for j in range(1, work.strain.shape[1]):
            total += chain.stiffness[row, j] * work.strain[row, j] ** 2
    return 0.5 * total


@fill(do.spend, Steered)
def _spend(chain, state, t, weight, move, v, scale):
    do.spend(chain.load, state, t, weight, move, v, scale)


@fill(do.vanishing, Steered)
def _vanishing(chain):
    return False


@fill(do.lost, Steered)
def _lost(chain, work, slope):
    return -1
