"""Rest curvature and viscosity of bending in compiled code; `discs.loads.bends` has the formulas and the plain twin."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels.compiled import part


class Bends(NamedTuple):
    """Parameters, without entries for none: the stencil discs, wrap, slope, bend (B, 4), stiffness, viscosity, rest (B,).

    driven : (K, B), rest curvatures that signals multiply. shift : (2,).
    """

    discs: NDArray
    wrap: NDArray
    slope: NDArray
    bend: NDArray
    stiffness: NDArray
    viscosity: NDArray
    rest: NDArray
    driven: NDArray
    shift: NDArray


_FOUR, _FEW, _WHOLE = np.empty((0, 4)), np.empty(0), np.empty((0, 4), int)
NO_BENDS = Bends(_WHOLE, _WHOLE, _FOUR, _FOUR, _FEW, _FEW, _FEW, np.empty((0, 0)), np.empty(2))


@part
def joined(bends, i):
    """The number of discs of bend i."""
    return 4 if bends.bend[i, 3] != 0.0 else 3


@part
def line(bends, i, state, move):
    """r' and r'' at bend i, after a move from the positions of a state: z_x, z_y, b_x, b_y."""
    hi, lo, o = state.hi, state.lo, bends.discs[i, 1]
    zx, zy, bx, by = 0.0, 0.0, 0.0, 0.0
    for j in range(joined(bends, i)):
        disc, wrap, slope, bend = bends.discs[i, j], bends.wrap[i, j], bends.slope[i, j], bends.bend[i, j]
        x = (hi[0, disc] - hi[0, o]) + ((lo[0, disc] - lo[0, o]) + (move[0, disc] - move[0, o])) + wrap * bends.shift[0]
        y = (hi[1, disc] - hi[1, o]) + ((lo[1, disc] - lo[1, o]) + (move[1, disc] - move[1, o])) + wrap * bends.shift[1]
        zx, zy, bx, by = zx + slope * x, zy + slope * y, bx + bend * x, by + bend * y
    return zx, zy, bx, by


@part
def curvature(bends, i, values, place):
    """The rest curvature of bend i, for the row `place` of the values of signals; NaN if there is none."""
    kappa = bends.rest[i]
    for j in range(bends.driven.shape[0]):
        kappa += bends.driven[j, i] * (values[place, j] if place >= 0 else np.nan)
    return kappa


@part
def bend(bends, values, place, state, move, c, p, factor, g):
    """g += factor C^T f at the velocities C p."""
    roll, to = p[0], g[0]
    for i in range(bends.rest.size):
        zx, zy, bx, by = line(bends, i, state, move)
        rate = 0.0
        for j in range(joined(bends, i)):
            disc = bends.discs[i, j]
            x, y = c[0, disc] * roll[disc], c[1, disc] * roll[disc]
            rate += bends.slope[i, j] * (x * by - y * bx) + bends.bend[i, j] * (zx * y - zy * x)
        kappa = curvature(bends, i, values, place)
        stretch, moment = bends.stiffness[i] * kappa * kappa, bends.stiffness[i] * kappa - bends.viscosity[i] * rate
        x, y = stretch * zx - moment * by, stretch * zy + moment * bx
        for j in range(joined(bends, i)):
            disc, slope, along = bends.discs[i, j], bends.slope[i, j], bends.bend[i, j] * moment
            to[disc] -= factor * (c[0, disc] * (slope * x + along * zy) + c[1, disc] * (slope * y - along * zx))


@part
def stiffen_bends(bends, values, place, state, move, c, d, g, m):
    """Add d C^T D C + g C^T (grad^2 U) C to a matrix of `discs.kernels.slaved_matrix`."""
    n = m.a.size
    for i in range(bends.rest.size):
        zx, zy, bx, by = line(bends, i, state, move)
        kappa, viscous = curvature(bends, i, values, place), bends.viscosity[i]
        stretch, moment = bends.stiffness[i] * kappa * kappa, bends.stiffness[i] * kappa
        for j in range(joined(bends, i)):
            one, slope1, bend1 = bends.discs[i, j], bends.slope[i, j], bends.bend[i, j]
            x1, y1 = c[0, one], c[1, one]
            rate1 = slope1 * (x1 * by - y1 * bx) + bend1 * (zx * y1 - zy * x1)
            for other in range(j, joined(bends, i)):
                two, slope2, bend2 = bends.discs[i, other], bends.slope[i, other], bends.bend[i, other]
                x2, y2 = c[0, two], c[1, two]
                rate2 = slope2 * (x2 * by - y2 * bx) + bend2 * (zx * y2 - zy * x2)
                elastic = stretch * slope1 * slope2 * (x1 * x2 + y1 * y2)
                elastic -= moment * (slope1 * bend2 - slope2 * bend1) * (x1 * y2 - y1 * x2)
                entry, apart = g * elastic + d * viscous * rate1 * rate2, two - one if two >= one else two - one + n
                if apart == 0:
                    m.a[one] += entry
                elif apart == 1:
                    m.u[one] += entry
                elif apart == 2:
                    m.w[one] += entry
                else:
                    m.corner[0 if one == 0 else 1] += entry


@part
def spent_by_bends(bends, values, place, state, move, v):
    """The rates of work of the driven rest curvatures and of dissipation, after a move from a state, at velocities v."""
    work, dissipated = 0.0, 0.0
    for i in range(bends.rest.size):
        zx, zy, bx, by = line(bends, i, state, move)
        rate, along = 0.0, 0.0
        for j in range(joined(bends, i)):
            x, y = v[0, bends.discs[i, j]], v[1, bends.discs[i, j]]
            rate += bends.slope[i, j] * (x * by - y * bx) + bends.bend[i, j] * (zx * y - zy * x)
            along += bends.slope[i, j] * (zx * x + zy * y)
        rest, kappa = bends.rest[i], curvature(bends, i, values, place)
        work += bends.stiffness[i] * ((kappa - rest) * rate - (kappa * kappa - rest * rest) * along)
        dissipated += bends.viscosity[i] * rate * rate
    return work, dissipated
