r"""Symmetric banded systems, eliminated from both ends at once: two independent recurrences, which a processor runs in parallel.

There is no pivoting: the matrices are I + g A with A positive semidefinite, and g positive or complex with a positive real
part or imaginary part, whose pivots stay away from zero.

Pentadiagonal: a[i] on the diagonal, u[i] couples i and i + 1, w[i] couples i and i + 2; corner[0] couples 0 and 3 and corner[1]
n - 4 and n - 1 (the bend of a ghost disc). The factors, reciprocal pivots and multipliers, overwrite them. The first half of the
rows is eliminated downwards, the second half upwards; two rows in the middle, p and p + 1, remain. Fewer than eight rows are
eliminated downwards only.
"""

from discs.kernels.compiled import PART, later, part

FEW = 8


def reciprocal(z):
    """1/z; for a complex z without protection against overflow, which is not needed here."""
    return 1 / z


@part
def factor_few(a, u, w, corner):
    """`factor` by elimination downwards only."""
    n = a.size
    for i in range(n):
        third = corner[0] if i == 0 else (corner[1] if i == n - 4 else 0 * corner[1])
        first, second = u[i], w[i]
        a[i] = reciprocal(a[i])
        if i + 1 < n:
            u[i] = first * a[i]
            a[i + 1] -= u[i] * first
            if i + 2 < n:
                w[i] = second * a[i]
                u[i + 1] -= u[i] * second
                a[i + 2] -= w[i] * second
            if i + 3 < n and (i == 0 or i == n - 4):
                corner[0 if i == 0 else 1] = third * a[i]
                w[i + 1] -= u[i] * third
                u[i + 2] -= w[i] * third
                a[i + 3] -= third * a[i] * third


def at(b, i):
    """b[i]; for two right sides (2, n) both entries."""
    return b[..., i]


def put(b, i, x):
    """b[i] = x, for one right side or two."""
    b[..., i] = x


def less(x, k, y):
    """x - k y, for one right side or two."""
    return x - k * y


def times(x, k):
    """x k, for one right side or two."""
    return x * k


def _forms_by_type():
    from numba.core import types
    from numba.extending import overload

    @overload(reciprocal, jit_options=PART)
    def _reciprocal(z):
        if isinstance(z, types.Complex):
            return lambda z: z.conjugate() * (1.0 / (z.real * z.real + z.imag * z.imag))
        return lambda z: 1.0 / z

    @overload(at, jit_options=PART)
    def _at(b, i):
        return (lambda b, i: b[i]) if b.ndim == 1 else (lambda b, i: (b[0, i], b[1, i]))

    @overload(put, jit_options=PART)
    def _put(b, i, x):
        def one(b, i, x):
            b[i] = x

        def two(b, i, x):
            b[0, i], b[1, i] = x

        return one if b.ndim == 1 else two

    @overload(less, jit_options=PART)
    def _less(x, k, y):
        if isinstance(x, types.BaseTuple):
            return lambda x, k, y: (x[0] - k * y[0], x[1] - k * y[1])
        return lambda x, k, y: x - k * y

    @overload(times, jit_options=PART)
    def _times(x, k):
        return (lambda x, k: (x[0] * k, x[1] * k)) if isinstance(x, types.BaseTuple) else (lambda x, k: x * k)


later(_forms_by_type)


@part
def substitute_few(a, u, w, corner, b):
    """`substitute` for the factors of `factor_few`."""
    n = a.size
    for i in range(n):
        if i + 1 < n:
            put(b, i + 1, less(at(b, i + 1), u[i], at(b, i)))
        if i + 2 < n:
            put(b, i + 2, less(at(b, i + 2), w[i], at(b, i)))
        if i + 3 < n and (i == 0 or i == n - 4):
            put(b, i + 3, less(at(b, i + 3), corner[0 if i == 0 else 1], at(b, i)))
    for i in range(n - 1, -1, -1):
        x = times(at(b, i), a[i])
        if i + 1 < n:
            x = less(x, u[i], at(b, i + 1))
        if i + 2 < n:
            x = less(x, w[i], at(b, i + 2))
        if i + 3 < n and (i == 0 or i == n - 4):
            x = less(x, corner[0 if i == 0 else 1], at(b, i + 3))
        put(b, i, x)


@part
def factor(a, u, w, corner):
    """Factors of a pentadiagonal matrix, in place: a (n,), u, w (n,) of which the last and the last two are not used, corner
    (2,)."""
    n = a.size
    if n < FEW:
        factor_few(a, u, w, corner)
        return
    p = (n - 1) // 2
    last = n - 1
    # the ends, with their corners
    top, low = reciprocal(a[0]), reciprocal(a[last])
    third, second, first = corner[0], w[0], u[0]
    corner[0], w[0], u[0], a[0] = third * top, second * top, first * top, top
    a[3] -= corner[0] * third
    u[2] -= w[0] * third
    a[2] -= w[0] * second
    w[1] -= u[0] * third
    u[1] -= u[0] * second
    a[1] -= u[0] * first
    third, second, first = corner[1], w[last - 2], u[last - 1]
    corner[1], w[last - 2], u[last - 1], a[last] = third * low, second * low, first * low, low
    a[last - 3] -= corner[1] * third
    u[last - 3] -= w[last - 2] * third
    a[last - 2] -= w[last - 2] * second
    w[last - 3] -= u[last - 1] * third
    u[last - 2] -= u[last - 1] * second
    a[last - 1] -= u[last - 1] * first
    # rows i downwards and j upwards; values for the next rows stay in registers
    a0, a1, u0 = a[1], a[2], u[1]
    z0, z1, v0 = a[last - 1], a[last - 2], u[last - 2]
    for i in range(1, n // 2 - 1):
        j = last - i
        top, low = reciprocal(a0), reciprocal(z0)
        second, below = w[i], w[j - 2]
        l1, l2 = u0 * top, second * top
        m1, m2 = v0 * low, below * low
        a[i], u[i], w[i] = top, l1, l2
        a[j], u[j - 1], w[j - 2] = low, m1, m2
        a0 = a1 - l1 * u0
        a1 = a[i + 2] - l2 * second
        u0 = u[i + 1] - l1 * second
        z0 = z1 - m1 * v0
        z1 = a[j - 2] - m2 * below
        v0 = u[j - 2] - m1 * below
    i = n // 2 - 1
    if n % 2:  # one more row downwards
        top = reciprocal(a0)
        second = w[i]
        l1, l2 = u0 * top, second * top
        a[i], u[i], w[i] = top, l1, l2
        a0 = a1 - l1 * u0
        a1 = a[i + 2] - l2 * second
        u0 = u[i + 1] - l1 * second
    # a0, a1 are the rows p, p + 1 from above; z1, z0 the same rows from below
    a0 += z1 - a[p]
    a1 += z0 - a[p + 1]
    u0 += v0 - u[p]
    a[p] = reciprocal(a0)
    u[p] = u0 * a[p]
    a[p + 1] = reciprocal(a1 - u[p] * u0)


@part
def substitute(a, u, w, corner, b):
    """Solve with the factors of `factor`, in place; b (n,), or two right sides (2, n), which a processor solves in parallel."""
    n = a.size
    if n < FEW:
        substitute_few(a, u, w, corner, b)
        return
    p = (n - 1) // 2
    last = n - 1
    b0, c0 = at(b, 0), at(b, last)
    put(b, 1, less(at(b, 1), u[0], b0))
    put(b, 2, less(at(b, 2), w[0], b0))
    put(b, 3, less(at(b, 3), corner[0], b0))
    put(b, last - 1, less(at(b, last - 1), u[last - 1], c0))
    put(b, last - 2, less(at(b, last - 2), w[last - 2], c0))
    put(b, last - 3, less(at(b, last - 3), corner[1], c0))
    b0, b1 = at(b, 1), at(b, 2)
    c0, c1 = at(b, last - 1), at(b, last - 2)
    for i in range(1, n // 2 - 1):
        j = last - i
        put(b, i, b0)
        put(b, j, c0)
        b0, b1 = less(b1, u[i], b0), less(at(b, i + 2), w[i], b0)
        c0, c1 = less(c1, u[j - 1], c0), less(at(b, j - 2), w[j - 2], c0)
    i = n // 2 - 1
    if n % 2:
        put(b, i, b0)
        b0, b1 = less(b1, u[i], b0), less(at(b, i + 2), w[i], b0)
    # c1, c0 are the entries p, p + 1 from below
    b0 = less(less(b0, -1.0, c1), 1.0, at(b, p))
    b1 = less(less(b1, -1.0, c0), 1.0, at(b, p + 1))
    b1 = times(less(b1, u[p], b0), a[p + 1])
    b0 = less(times(b0, a[p]), u[p], b1)
    put(b, p, b0)
    put(b, p + 1, b1)
    c0, c1 = b1, b0  # the two solved entries next to row j; b0, b1 those next to row i
    if n % 2:
        i = p - 1
        b0, b1 = less(less(times(at(b, i), a[i]), w[i], b1), u[i], b0), b0
        put(b, i, b0)
    for i in range(n // 2 - 2, 0, -1):
        j = last - i
        b0, b1 = less(less(times(at(b, i), a[i]), w[i], b1), u[i], b0), b0
        c0, c1 = less(less(times(at(b, j), a[j]), w[j - 2], c1), u[j - 1], c0), c0
        put(b, i, b0)
        put(b, j, c0)
    end = less(less(times(at(b, 0), a[0]), corner[0], at(b, 3)), w[0], at(b, 2))
    put(b, 0, less(end, u[0], at(b, 1)))
    end = less(less(times(at(b, last), a[last]), corner[1], at(b, last - 3)), w[last - 2], at(b, last - 2))
    put(b, last, less(end, u[last - 1], at(b, last - 1)))
