"""Sweeps of collocation methods for many discs with slaved headings, in lanes; the twin of `refine` in
`discs.integrators.collocation`."""

from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import HALO
from discs.kernels.orders import most, pick, solve
from discs.kernels.slaved_lanes import LANED, moved
from discs.kernels.slaved_matrix import GHOST, RING
from discs.kernels.slaved_sweeps import frozen, pulled
from discs.kernels.stage_sums import mix, residual, residuals, workspace
from discs.kernels.vectors import LANES, larger, largest, load, store, zero


@fill(do.stages, *LANED, _nrt=True)
def _stages(chain, method, rows, columns):
    return workspace(chain, method.tableau, rows, columns)


@fill(do.refine, *LANED)
def _refine(chain, work, method, room, before, h, sweep):
    rule, own, p, v, force, fresh = method.tableau, room.stages, room.p, room.v, room.force, room.moves
    a, stages, ring, ghosts = rule.a, rule.b.size, chain.ends == RING, chain.ends == GHOST
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
    for e in range(rule.real.size):
        residual(a, rule.real_in[e], h, before.pi[0], p, force, 0, own.x[e, 0])
        solve(chain.order, ring, ghosts, pick(own.single, e), own.x[e, 0])
    for e in range(rule.pairs.size):
        residuals(a, rule.pairs_in[e], h, before.pi[0], p, force, 0, own.z[e, 0])
        solve(chain.order, ring, ghosts, pick(own.double, e), own.z[e, 0])
    return renewed(chain, work, rule, own, h, p, v)


@fill(do.finish, *LANED)
def _finish(chain, work, method, room, before, h):
    rule, moves, v, p, c = method.tableau, room.moves, room.v, room.p, room.stages.c
    for k in range(rule.b.size):
        for i in range(0, p.shape[2], LANES):
            store(v[k, 2], i, load(c[k, 2], i) * load(p[k, 0], i))
    for k in range(rule.b.size if chain.load.spent.size > 0 else 0):
        for axis in range(3):
            mix(rule.a[k], h, v, axis, moves[k, axis], 0)
        do.spend(chain.load, before, room.times[k], h * rule.b[k], moves[k], v[k], 1.0)


@part
def renewed(chain, work, rule, own, h, p, v):
    """p += its change at each stage, and the rates of x and y; returns the largest move by that, in units of the scale."""
    half, far_x, far_y, far = 0.5 * h, zero(), zero(), zero()
    x, y, theta, reals, pairs = own.common[0], own.common[1], own.common[2], rule.real.size, rule.pairs.size
    first, second, other = own.x[0, 0], own.z[0, 0], own.z[max(pairs - 1, 0), 0]
    for k in range(p.shape[0]):
        q, cx, cy, vx, vy = p[k, 0], own.c[k, 0], own.c[k, 1], v[k, 0], v[k, 1]
        w = rule.real_out[0, k] if reals > 0 else 0.0
        u = rule.pairs_out[0, k] if pairs > 0 else 0.0j
        s = rule.pairs_out[1, k] if pairs > 1 else 0.0j
        for i in range(0, q.size, LANES):
            one = load(second, i)
            step = w * load(first, i) + (u.real * one.real - u.imag * one.imag)
            if pairs > 1:
                one = load(other, i)
                step = step + (s.real * one.real - s.imag * one.imag)
            r, step = load(q, i) + step, half * step
            far_x, far_y = larger(abs(load(x, i) * step), far_x), larger(abs(load(y, i) * step), far_y)
            far = larger(abs(load(theta, i) * step), far)
            store(q, i, r)
            store(vx, i, load(cx, i) * r)
            store(vy, i, load(cy, i) * r)
    return most(chain.order, max(largest(larger(far_x, far_y) / load(chain.length, 0), work.spare), largest(far, work.spare)))
