"""Sweeps of collocation methods for many discs with own headings, in lanes; the twin of `refine` in
`discs.integrators.collocation`. `discs.kernels.slaved_stages` is the same for slaved headings."""

from discs.kernels import protocol as do
from discs.kernels.compiled import fill, part
from discs.kernels.lanes import HALO
from discs.kernels.orders import most
from discs.kernels.stage_sums import mix, residual, residuals, workspace
from discs.kernels.steered_blocks import pick, solve
from discs.kernels.steered_lanes import TURNING
from discs.kernels.steered_passes import frozen, pulled
from discs.kernels.vectors import LANES, larger, largest, load, store, zero


@fill(do.stages, *TURNING, _nrt=True)
def _stages(chain, method, rows, columns):
    return workspace(chain, method.tableau, rows, columns)


@fill(do.refine, *TURNING)
def _refine(chain, work, method, room, before, h, sweep):
    rule, own, p, v, force, fresh = method.tableau, room.stages, room.p, room.v, room.force, room.moves
    a, stages = rule.a, rule.b.size
    for k in range(stages):
        mix(a[k], h, v, 3, fresh[k, 3], 0)  # C depends on the headings only
        if do.loaded(chain.load) and sweep == 0:
            constant(chain, own.c[k])
        frozen(chain, work, 1.0, p[k], fresh[k], own.c[k], fresh[k], 0)
    for k in range(stages):
        for row in range(4):
            mix(a[k], h, fresh, row, work.half[row], HALO)
        pulled(chain, work, own.c[k], force[k], False, False)
        if do.loaded(chain.load):
            for row in range(4):
                mix(a[k], h, fresh, row, work.step[row], 0)
            do.push(chain.load, before, room.times[k], work.step, own.c[k], p[k], -1.0, force[k])
    for e in range(rule.real.size):
        for row in range(2):
            residual(a, rule.real_in[e], h, before.pi[row], p, force, row, own.x[e, row])
        solve(chain.order, chain.ring, pick(own.single, e), own.x[e])
    for e in range(rule.pairs.size):
        for row in range(2):
            residuals(a, rule.pairs_in[e], h, before.pi[row], p, force, row, own.z[e, row])
        solve(chain.order, chain.ring, pick(own.double, e), own.z[e])
    return renewed(chain, work, rule, own, h, p, v)


@fill(do.finish, *TURNING)
def _finish(chain, work, method, room, before, h):
    rule, moves, v, p, c = method.tableau, room.moves, room.v, room.p, room.stages.c
    for k in range(rule.b.size):
        for i in range(0, p.shape[2], LANES):
            roll = load(p[k, 0], i)
            store(v[k, 0], i, load(c[k, 0], i) * roll)
            store(v[k, 1], i, load(c[k, 1], i) * roll)
            store(v[k, 2], i, load(chain.paces[1], i) * roll)
    for k in range(rule.b.size if chain.load.spent.size > 0 else 0):
        for row in range(4):
            mix(rule.a[k], h, v, row, moves[k, row], 0)
        do.spend(chain.load, before, room.times[k], h * rule.b[k], moves[k], v[k], 1.0)


@part
def constant(chain, c):
    """The rows of C that do not depend on the headings."""
    for i in range(0, c.shape[1], LANES):
        store(c[2], i, load(chain.paces[1], i))
        store(c[3], i, load(chain.paces[2], i))


@part
def renewed(chain, work, rule, own, h, p, v):
    """p += its change at each stage, and the rates of the headings; returns the largest move by that, in units of the scale."""
    half, far, turned = 0.5 * h, zero(), zero()
    x, y, reals, pairs = own.common[0], own.common[1], rule.real.size, rule.pairs.size
    first, second, other = own.x[0], own.z[0], own.z[max(pairs - 1, 0)]
    for k in range(p.shape[0]):
        roll, turn, swings = p[k, 0], p[k, 1], v[k, 3]
        w = rule.real_out[0, k] if reals > 0 else 0.0
        u = rule.pairs_out[0, k] if pairs > 0 else 0.0j
        s = rule.pairs_out[1, k] if pairs > 1 else 0.0j
        for i in range(0, roll.size, LANES):
            one, two = load(second[0], i), load(second[1], i)
            step = w * load(first[0], i) + (u.real * one.real - u.imag * one.imag)
            twist = w * load(first[1], i) + (u.real * two.real - u.imag * two.imag)
            if pairs > 1:
                one, two = load(other[0], i), load(other[1], i)
                step = step + (s.real * one.real - s.imag * one.imag)
                twist = twist + (s.real * two.real - s.imag * two.imag)
            pace, swing = load(chain.paces[1], i), load(chain.paces[2], i)
            r, q = load(roll, i) + step, load(turn, i) + twist
            step = half * step
            far = larger(abs(load(x, i) * step), larger(abs(load(y, i) * step), far))
            turned = larger(abs(pace * step), larger(abs(swing * (half * twist)), turned))
            store(roll, i, r)
            store(turn, i, q)
            store(swings, i, swing * q)
    return most(chain.order, max(largest(far / load(chain.length, 0), work.spare), largest(turned, work.spare)))
