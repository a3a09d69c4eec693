r"""Symmetric block tridiagonal systems with blocks of two, eliminated from both ends at once as in `discs.kernels.banded`.

Blocks D_i = [[p, q], [q, r]] on the diagonal, d (3, n), and O_i between i and i + 1, o (4, n) row by row; the last O_i is not used.
The factors of the first n discs overwrite them: D_i^{-1}, and O_i^T D_i^{-1} above the middle block m = n // 2, O_{i-1} D_i^{-1}
(at i - 1) below it.
"""

from discs.kernels.banded import reciprocal
from discs.kernels.compiled import part


@part
def factor(d, o, n):
    """Factors, in place."""
    m = n // 2
    p, q, r = d[0, 0], d[1, 0], d[2, 0]
    last = n - 1
    x, y, z = d[0, last], d[1, last], d[2, last]
    for i in range(m):
        det = reciprocal(p * r - q * q)
        d[0, i], d[1, i], d[2, i] = r * det, -q * det, p * det
        a, b, e, f = o[0, i], o[1, i], o[2, i], o[3, i]
        # L = O^T D^{-1}
        l0, l1 = (a * r - e * q) * det, (e * p - a * q) * det
        l2, l3 = (b * r - f * q) * det, (f * p - b * q) * det
        o[0, i], o[1, i], o[2, i], o[3, i] = l0, l1, l2, l3
        p = d[0, i + 1] - (l0 * a + l1 * e)
        q = d[1, i + 1] - (l0 * b + l1 * f)
        r = d[2, i + 1] - (l2 * b + l3 * f)
        j = last - i
        if j > m:
            det = reciprocal(x * z - y * y)
            d[0, j], d[1, j], d[2, j] = z * det, -y * det, x * det
            a, b, e, f = o[0, j - 1], o[1, j - 1], o[2, j - 1], o[3, j - 1]
            # L = O D^{-1}
            l0, l1 = (a * z - b * y) * det, (b * x - a * y) * det
            l2, l3 = (e * z - f * y) * det, (f * x - e * y) * det
            o[0, j - 1], o[1, j - 1], o[2, j - 1], o[3, j - 1] = l0, l1, l2, l3
            x = d[0, j - 1] - (l0 * a + l1 * b)
            y = d[1, j - 1] - (l0 * e + l1 * f)
            z = d[2, j - 1] - (l2 * e + l3 * f)
    p += x - d[0, m]
    q += y - d[1, m]
    r += z - d[2, m]
    det = reciprocal(p * r - q * q)
    d[0, m], d[1, m], d[2, m] = r * det, -q * det, p * det


@part
def substitute(d, o, b, n):
    """Solve with the factors of `factor`, b (2, n) in place."""
    m = n // 2
    last = n - 1
    x, y = b[0, 0], b[1, 0]
    z, w = b[0, last], b[1, last]
    for i in range(m):
        b[0, i], b[1, i] = x, y
        x, y = b[0, i + 1] - (o[0, i] * x + o[1, i] * y), b[1, i + 1] - (o[2, i] * x + o[3, i] * y)
        j = last - i
        if j > m:
            b[0, j], b[1, j] = z, w
            z, w = (
                b[0, j - 1] - (o[0, j - 1] * z + o[1, j - 1] * w),
                b[1, j - 1] - (o[2, j - 1] * z + o[3, j - 1] * w),
            )
    if m < last:
        x += z - b[0, m]
        y += w - b[1, m]
    x, y = d[0, m] * x + d[1, m] * y, d[1, m] * x + d[2, m] * y
    b[0, m], b[1, m] = x, y
    z, w = x, y
    for i in range(m - 1, -1, -1):
        r, s = b[0, i], b[1, i]
        # D^{-1} b - L^T x
        x, y = (
            d[0, i] * r + d[1, i] * s - (o[0, i] * x + o[2, i] * y),
            d[1, i] * r + d[2, i] * s - (o[1, i] * x + o[3, i] * y),
        )
        b[0, i], b[1, i] = x, y
        j = 2 * m - i
        if j < n:
            r, s = b[0, j], b[1, j]
            z, w = (
                d[0, j] * r + d[1, j] * s - (o[0, j - 1] * z + o[2, j - 1] * w),
                d[1, j] * r + d[2, j] * s - (o[1, j - 1] * z + o[3, j - 1] * w),
            )
            b[0, j], b[1, j] = z, w
