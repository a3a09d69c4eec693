"""The linear system of a step of discs with own headings: its entries, factors and solution; on a ring with a border."""

from discs.kernels import blocks
from discs.kernels import steered_joints as joints
from discs.kernels.banded import reciprocal
from discs.kernels.compiled import fill, part
from discs.kernels.steered_joints import Links


@part
def assemble(chain, work, c, one, g, m):
    """Entries of `one` I + g C^T B^T (stiffness) B C for the mean geometry in `work`."""
    joints.entries(chain.joints, chain, work, c, one, g, m)


@fill(joints.entries, Links)
def _entries(joints, chain, work, c, one, g, m):
    n, d, o = c.shape[1], m.d, m.o
    per = 1 / chain.k
    cx, cy, ct, cp = c[0], c[1], c[2], c[3]
    along_x, along_y, across_x, across_y = work.along[0], work.along[1], work.across[0], work.across[1]
    k0, k1, k2, k3 = chain.stiffness[0], chain.stiffness[1], chain.stiffness[2], chain.stiffness[3]
    p, q, r = d[0], d[1], d[2]
    for i in range(n):
        p[i], q[i], r[i] = one, 0.0, one
    o0, o1 = o[0], o[1]
    for side in range(2):  # the links before discs, then those after them
        sign = 1.0 - 2.0 * side
        ax, ay, bx, by = along_x[side:], along_y[side:], across_x[side:], across_y[side:]
        s0, s1, s2, s3 = k0[side:], k1[side:], k2[side:], k3[side:]
        for i in range(n):
            normal, shear = ax[i] * cx[i] + ay[i] * cy[i], ax[i] * cy[i] - ay[i] * cx[i]
            o0[i], o1[i] = normal, shear
        for i in range(n):
            t = ct[i] * per
            p[i] += g * (s0[i] * o0[i] * o0[i] + s1[i] * o1[i] * o1[i] + s2[i] * t * t)
        for i in range(n):
            q[i] += sign * g * 0.5 * cp[i] * (s0[i] * o0[i] * bx[i] + s1[i] * o1[i] * by[i])
        for i in range(n):
            b = cp[i] * per
            r[i] += g * (0.25 * cp[i] * cp[i] * (s0[i] * bx[i] * bx[i] + s1[i] * by[i] * by[i]) + s3[i] * b * b)
    # o0, o1 are stretch and shear of the link after disc i by its roll, as n0, q0 in `couple` but for the sign
    for i in range(n - 1):
        couple(i, i + 1, c, g, per, chain.stiffness, work.along, work.across, o)
    if chain.ring:
        couple(n - 1, 0, c, g, per, chain.stiffness, work.along, work.across, o)
    else:
        for row in range(4):
            o[row, n - 1] = 0.0


@part
def couple(i, j, c, g, per, stiffness, along, across, o):
    """The block of disc i and the next disc j, from the link i + 1 between them. Before, o[:2, i] are stretch and shear of the
    link by the roll of disc i."""
    link = i + 1
    n0, q0 = -o[0, i], -o[1, i]
    n1, q1 = along[0, link] * c[0, j] + along[1, link] * c[1, j], along[0, link] * c[1, j] - along[1, link] * c[0, j]
    h0, h1 = 0.5 * c[3, i], 0.5 * c[3, j]
    n, q = g * stiffness[0, link], g * stiffness[1, link]
    x, y = across[0, link], across[1, link]
    o[0, i] = n * n0 * n1 + q * q0 * q1 - g * stiffness[2, link] * (c[2, i] * per) * (c[2, j] * per)
    o[1, i] = h1 * (n * n0 * x + q * q0 * y)
    o[2, i] = h0 * (n * n1 * x + q * q1 * y)
    o[3, i] = h0 * h1 * (n * x * x + q * y * y) - g * stiffness[3, link] * (c[3, i] * per) * (c[3, j] * per)


@part
def border(d, o, columns, edge):
    """Factor the matrix of a ring: the chain without its last disc, then the border of that disc."""
    last = d.shape[1] - 1
    e, first, second = edge, columns[0], columns[1]
    for i in range(4):
        e[i] = o[i, last]  # last disc (rows) with disc 0
        e[4 + i] = o[i, last - 1]  # disc last - 1 (rows) with the last
    blocks.factor(d, o, last)
    first[:], second[:] = 0, 0
    first[0, 0] += e[0]
    first[1, 0] += e[1]
    second[0, 0] += e[2]
    second[1, 0] += e[3]
    first[0, last - 1] += e[4]
    first[1, last - 1] += e[6]
    second[0, last - 1] += e[5]
    second[1, last - 1] += e[7]
    blocks.substitute(d, o, first, last)
    blocks.substitute(d, o, second, last)
    x = d[0, last] - across_border(e, 0, first, last)
    y = d[1, last] - across_border(e, 0, second, last)
    z = d[2, last] - across_border(e, 1, second, last)
    det = reciprocal(x * z - y * y)
    e[8], e[9], e[10] = z * det, -y * det, x * det


@part
def across_border(e, row, b, n):
    """A row of the coupling of the last disc to the n others, times b (2, n)."""
    return e[2 * row] * b[0, 0] + e[2 * row + 1] * b[1, 0] + e[4 + row] * b[0, n - 1] + e[6 + row] * b[1, n - 1]


@part
def solve_border(d, o, columns, e, b):
    """Solve with the factors of `border`, b (2, n) in place."""
    n = d.shape[1] - 1
    blocks.substitute(d, o, b, n)
    p, q = b[0], b[1]
    x, y = p[n] - across_border(e, 0, b, n), q[n] - across_border(e, 1, b, n)
    x, y = e[8] * x + e[9] * y, e[9] * x + e[10] * y
    for row in range(2):
        first, second, to = columns[0, row], columns[1, row], b[row]
        for i in range(n):
            to[i] -= first[i] * x + second[i] * y
    p[n], q[n] = x, y


@part
def factor(chain, m):
    d, o = joints.condense(chain.joints, m)
    if chain.ring:
        border(d, o, m.columns, m.edge)
    else:
        blocks.factor(d, o, d.shape[1])


@part
def solve(chain, m, b):
    d, o, right = joints.reduce(chain.joints, m, b)
    if chain.ring:
        solve_border(d, o, m.columns, m.edge, right)
    else:
        blocks.substitute(d, o, right, d.shape[1])
    joints.expand(chain.joints, m, b)
