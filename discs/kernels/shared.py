"""What chains and methods share. C acts on a disc's own momenta, roll on rows x, y, theta and turning on row phi.

c, v : (rows, n). p : (1, n), or (2, n) with own headings.
"""

from discs.kernels import chain as do
from discs.kernels.compiled import part


@part
def copy(a, to):
    """to = a, two-dimensional."""
    for row in range(a.shape[0]):
        for i in range(a.shape[1]):
            to[row, i] = a[row, i]


@part
def forward(c, p, v, tau=1.0):
    """v = tau C p."""
    for row in range(c.shape[0]):
        a, q, to = c[row], p[row // 3], v[row]
        for i in range(to.size):
            to[i] = tau * a[i] * q[i]


@part
def back(c, g, p):
    """p = C^T g."""
    cx, cy, ct, gx, gy, gt, roll = c[0], c[1], c[2], g[0], g[1], g[2], p[0]
    for i in range(roll.size):
        roll[i] = cx[i] * gx[i] + cy[i] * gy[i] + ct[i] * gt[i]
    for row in range(3, c.shape[0]):
        a, b, to = c[row], g[row], p[1]
        for i in range(to.size):
            to[i] = a[i] * b[i]


@part(fastmath={"contract", "nnan", "nsz", "reassoc"})
def largest(a):
    """The largest of a (n,), none of which is negative."""
    m = 0.0
    for i in range(a.size):
        m = a[i] if a[i] > m else m
    return m


@part
def renew(c, p, tau, move, scale, change):
    """move = tau C p; returns the largest change, each row in units of its `scale`."""
    furthest = 0.0
    for row in range(c.shape[0]):
        a, q, to = c[row], p[row // 3], move[row]
        for i in range(to.size):
            new = tau * a[i] * q[i]
            change[i] = abs(new - to[i])
            to[i] = new
        furthest = max(furthest, largest(change) / scale[row])
    return furthest


@part
def add(hi, lo, increment, factor):
    """hi + lo += factor * increment, without losing low digits (Knuth's two-sum)."""
    for row in range(hi.shape[0]):
        a, b, d = hi[row], lo[row], increment[row]
        for i in range(a.size):
            term = factor * d[i] + b[i]
            total = a[i] + term
            part = total - a[i]
            b[i] = (a[i] - (total - part)) + (term - part)
            a[i] = total


@part
def kinetic(pi):
    """|pi|^2/2, the kinetic energy."""
    total = 0.0
    for row in range(pi.shape[0]):
        for i in range(pi.shape[1]):
            total += pi[row, i] * pi[row, i]
    return 0.5 * total


@part
def ahead(chain, work, hi, lo, half, slope):
    """A disc that loses its heading if all go on straight from the base hi + lo by twice `half`, or -1; `half` is overwritten."""
    for row in range(hi.shape[0]):
        for i in range(hi.shape[1]):
            half[row, i] = hi[row, i] + 2 * half[row, i]
    do.settle(chain, work, half, lo)
    lost = do.lost(chain, work, slope)
    do.settle(chain, work, hi, lo)
    do.lost(chain, work, slope)
    return lost
