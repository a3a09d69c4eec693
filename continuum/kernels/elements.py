"""The rates of a steered rod on elements, compiled; the plain twin, with the formulas, is `continuum.elements.Elements.rate`."""

import numpy as np

from discs.kernels.compiled import kernel


@kernel
def rates(y, half, w, d, stiffness, radius, inertia, closing, out):
    """The time derivative of the unknowns (6, n) of elements without loads.

    Parameters
    ----------
    y : (6 n,), flat. half : (P,), half the widths of the elements. w : (P, m), weights of their nodes. d : (m, m), the transposed
    derivative matrix. stiffness : (4, P, m). radius : (n,). inertia : (2, n). closing : (4,), what the last node of a ring adds to
    the first node's x, y, theta and phi. out : (6 n,), filled in.
    """
    n, count, m = radius.size, half.size, d.shape[0]
    q, rate = y.reshape((6, n)), out.reshape((6, n))
    local, flux, cos, sin = np.empty((4, m)), np.empty((4, m)), np.empty(n), np.empty(n)
    for k in range(n):
        cos[k], sin[k] = np.cos(q[3, k]), np.sin(q[3, k])
        rate[4, k] = rate[5, k] = 0.0
    for p in range(count):
        for j in range(m):
            k = (p * (m - 1) + j) % n
            for row in range(4):
                local[row, j] = q[row, k]
        if n == count * (m - 1) and p == count - 1:
            for row in range(4):
                local[row, m - 1] += closing[row]
        for i in range(m):
            dx = dy = twist = bend = 0.0
            for j in range(m):
                dx += local[0, j] * d[j, i]
                dy += local[1, j] * d[j, i]
                twist += local[2, j] * d[j, i]
                bend += local[3, j] * d[j, i]
            k, h = (p * (m - 1) + i) % n, half[p]
            c, s = cos[k], sin[k]
            u0, u1 = (c * dx + s * dy) / h, (c * dy - s * dx) / h
            n1, n2 = stiffness[0, p, i] * (u0 - 1), stiffness[1, p, i] * u1
            flux[0, i] = w[p, i] / h * (c * n1 - s * n2)
            flux[1, i] = w[p, i] / h * (s * n1 + c * n2)
            flux[2, i] = w[p, i] / h * stiffness[2, p, i] * twist / h
            flux[3, i] = w[p, i] / h * stiffness[3, p, i] * bend / h
            rate[5, k] += w[p, i] * (u0 * n2 - u1 * n1)
        for j in range(m):
            fx = fy = torque = moment = 0.0
            for i in range(m):
                fx -= flux[0, i] * d[j, i]
                fy -= flux[1, i] * d[j, i]
                torque -= flux[2, i] * d[j, i]
                moment -= flux[3, i] * d[j, i]
            k = (p * (m - 1) + j) % n
            rate[4, k] += radius[k] * (cos[k] * fy - sin[k] * fx) + torque
            rate[5, k] += moment
    for k in range(n):
        rate[0, k], rate[1, k] = -radius[k] * sin[k] * q[4, k], radius[k] * cos[k] * q[4, k]
        rate[2, k], rate[3, k] = q[4, k], q[5, k]
        rate[4, k] /= inertia[0, k]
        rate[5, k] /= inertia[1, k]
