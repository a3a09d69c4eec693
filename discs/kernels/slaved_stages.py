"""Sweeps of collocation methods for many discs with slaved headings, in lanes; the twin of `refine` in
`discs.integrators.collocation`."""

from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import HALO
from discs.kernels.orders import pick, solve
from discs.kernels.slaved_lanes import LANED, moved
from discs.kernels.slaved_matrix import GHOST, RING
from discs.kernels.slaved_sweeps import frozen, pulled
from discs.kernels.vectors import LANES, larger, largest, load, pair, store, zero


@part
def four(weights, h):
    """h times up to four weights, and zeros."""
    n = weights.size
    return h * weights[0], h * weights[1] if n > 1 else 0.0, h * weights[2] if n > 2 else 0.0, h * weights[3] if n > 3 else 0.0


@part
def rows(parts, row):
    """A row of up to four parts, the last of them repeated."""
    last = parts.shape[0] - 1
    return parts[0, row], parts[min(1, last), row], parts[min(2, last), row], parts[min(3, last), row]


@part
def mixed(w, x, i):
    """The entries from i on of sum_j w_j x_j."""
    return w[0] * load(x[0], i) + w[1] * load(x[1], i) + w[2] * load(x[2], i) + w[3] * load(x[3], i)


@part
def mix(weights, h, parts, row, to, start):
    """h sum_j weights[j] parts[j, row] in `to` from `start` on."""
    w, x = four(weights, h), rows(parts, row)
    for i in range(0, parts.shape[2], LANES):
        store(to, start + i, mixed(w, x, i))


@fill(do.refine, *LANED)
def _refine(chain, work, method, room, before, h, sweep):
    rule, own, p, v, force, fresh = method.tableau, room.stages, room.p, room.v, room.force, room.moves
    a, n, stages, pi = rule.a, chain.radius.size, rule.b.size, before.pi[0]
    for k in range(stages):
        for axis in range(2):
            mix(a[k], h, v, axis, fresh[k, axis], 0)
        moved(chain, work.base, fresh[k], work.links)
        frozen(chain, work, 1.0, p[k, 0], own.c[k], fresh[k], 0)
    for k in range(stages):
        for axis in range(3):
            mix(a[k], h, fresh, axis, work.half[axis], HALO)
        pulled(chain, work, own.c[k], force[k, 0])
        if do.loaded(chain.load):
            for axis in range(3):
                mix(a[k], h, fresh, axis, work.step[axis], 0)
            do.push(chain.load, before, room.times[k], work.step, own.c[k], p[k], -1.0, force[k])
    for k in range(stages):
        w, x, q, to = four(a[k], -h), rows(force, 0), p[k, 0], room.rest[k, 0]
        for i in range(0, n, LANES):
            store(to, i, mixed(w, x, i) + (load(pi, i) - load(q, i)))
    changed(chain, rule, own, room.rest, force)
    return renewed(chain, work, own, h, p, force, v)


@fill(do.finish, *LANED)
def _finish(chain, work, method, room, before, h):
    rule, moves, v = method.tableau, room.moves, room.v
    for k in range(rule.b.size if chain.load.spent.size > 0 else 0):
        for axis in range(3):
            mix(rule.a[k], h, v, axis, moves[k, axis], 0)
        do.spend(chain.load, before, room.times[k], h * rule.b[k], moves[k], v[k], 1.0)


@part
def changed(chain, rule, own, rest, force):
    """force = the change of the momenta of the stages."""
    x, z, n, ring, ghosts = own.x[0], own.z[0], chain.radius.size, chain.ends == RING, chain.ends == GHOST
    force[:] = 0.0
    for e in range(rule.real.size):
        mix(rule.real_in[e], 1.0, rest, 0, x, 0)
        solve(chain.order, ring, ghosts, pick(own.single, e), x)
        for k in range(rule.b.size):
            weight, to = rule.real_out[e, k], force[k, 0]
            for i in range(0, n, LANES):
                store(to, i, load(to, i) + weight * load(x, i))
    for e in range(rule.pairs.size):
        real, imag, parts = four(rule.pairs_in[e].real, 1.0), four(rule.pairs_in[e].imag, 1.0), rows(rest, 0)
        for i in range(0, n, LANES):
            store(z, i, pair(mixed(real, parts, i), mixed(imag, parts, i)))
        solve(chain.order, ring, ghosts, pick(own.double, e), z)
        for k in range(rule.b.size):
            weight, to = rule.pairs_out[e, k], force[k, 0]
            for i in range(0, n, LANES):
                found = load(z, i)
                store(to, i, load(to, i) + (weight.real * found.real - weight.imag * found.imag))


@part
def renewed(chain, work, own, h, p, change, v):
    """p += change, v = C p at each stage; returns the largest move by the change, in units of the scale."""
    half, far_x, far_y, far = 0.5 * h, zero(), zero(), zero()
    x, y, theta = own.common[0], own.common[1], own.common[2]
    for k in range(p.shape[0]):
        q, dq, cx, cy, ct, vx, vy, vt = p[k, 0], change[k, 0], own.c[k, 0], own.c[k, 1], own.c[k, 2], v[k, 0], v[k, 1], v[k, 2]
        for i in range(0, q.size, LANES):
            step = load(dq, i)
            r, step = load(q, i) + step, half * step
            far_x, far_y = larger(abs(load(x, i) * step), far_x), larger(abs(load(y, i) * step), far_y)
            far = larger(abs(load(theta, i) * step), far)
            store(q, i, r)
            store(vx, i, load(cx, i) * r)
            store(vy, i, load(cy, i) * r)
            store(vt, i, load(ct, i) * r)
    return max(largest(larger(far_x, far_y) / load(chain.length, 0), work.spare), largest(far, work.spare))
