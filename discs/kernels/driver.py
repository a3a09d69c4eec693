"""The compiled driver: steps of any method for any chain, with the checks of every run.

Its plain twin is `discs.running.time_loop`. Methods fill in `step` beside their plain form, in `discs.integrators`. Chains fill in
the functions that steps call, in this folder.
"""

import numpy as np

from discs.kernels import protocol as do
from discs.kernels.compiled import fill, kernel, part, stub
from discs.kernels.limits import TURNED
from discs.kernels.shared import ahead, columns, disc_by_disc, forward, seen
from discs.skew import Phase

POLLED = 16  # steps between two polls of Ctrl-C; sweeps poll it themselves


@kernel
def march(
    method,
    chain,
    state,
    t,
    h,
    steps,
    bound,
    first,
    looks,
    places,
    defects,
    most,
    many,
    since,
    framed,
    stops,
    rests,
    q,
    rates,
    told,
):
    """Take `steps` steps from a state at the time t, in place, after `first` earlier ones.

    Returns (taken, gradients, solves, unconverged, lost, passed, doubted, blown, framed). The steps end after one whose kinetic
    energy exceeds `bound` (`blown`), and after one in which the heading of disc `lost` >= 0 vanishes: on the straight line of its
    motion or, if the step did not converge or is explicit, along its initial velocity. The state is then undefined. It is undefined
    too if `taken` is -1, after Ctrl-C.

    The steps whose numbers are in `looks` (m,) are looked at, see `discs.running.step_error`: `defects` (m, 2, rows) and `places`
    are filled in, and `passed` counts the looks. The steps end before one whose defect exceeds `most` (`doubted`).

    Frames from number `framed` on are recorded a time `rests` (F,) after `stops` (F,) steps, of which `since` were taken before, by
    a step of their own that does not change the motion: positions in q (rows, F, n), the rates of the rows from theta on in
    `rates` (rows - 2, F, n), energy and largest slip in `told` (2, F). The steps end before a frame whose step does not converge,
    loses a heading or exceeds `bound`, and after `many` steps that did not converge; `framed` is the number of the next frame.
    """
    before = do.enter(chain, state)
    work, room, after = do.workspace(chain), do.room(method, chain, before), do.like(before)
    rows, n = before.hi.shape
    few, vanishing = looks.size > 0 and looks[0] < 3, do.vanishing(chain)
    half, c, slope = np.empty((rows, n * vanishing)), np.empty((rows, n * (few or vanishing))), np.zeros((2, n))
    g, kicked = np.empty((columns(rows), n * few)), np.empty((rows, n * few))
    gradients, solves, unconverged, lost, passed, doubted, blown = 0, 0, 0, -1, 0, False, False
    due = looks[0] - first if looks.size else -1  # steps of this call
    spent, kept = chain.load.spent, np.empty(chain.load.spent.size)
    basis, rate = np.empty((rows, n * (stops.size > 0))), np.empty((rows, n * (stops.size > 0)))
    do.settle(chain, work, before.hi, before.lo)
    do.lost(chain, work, slope)
    step = 0
    while True:
        framing = framed < stops.size and stops[framed] - since == step
        if step == steps and not framing:
            break
        if step % POLLED == 0 and do.halted(chain, POLLED * rows * n):
            return -1, gradients, solves, unconverged, -1, passed, doubted, False, framed
        size = rests[framed] if framing else h
        if do.vanishing(chain) and do.jumps(method):
            lost = ahead(chain, work, before, size, c, half, slope)
            if lost >= 0 and not framing:
                return step + 1, gradients, solves, unconverged, lost, passed, doubted, False, framed
        if not framing and step >= due - 3 and step < due:
            place = places[passed % places.shape[0]]
            if step == due - 3:
                place[:] = 0.0
            add_up(chain, before.hi, -1.0 if step == due - 3 else 3.0 if step == due - 2 else -3.0, place)
        for j in range(spent.size):
            kept[j] = spent[j]
        moves = size != 0  # a frame may be at a step
        new = do.step(method, chain, work, room, before, after, t + step * h, size) if moves else (0, 0, 0)
        if new[0] < 0:
            return -1, gradients, solves, unconverged, -1, passed, doubted, False, framed
        if framing:
            shown = after if moves else before
            lost = max(lost, do.lost(chain, work, slope))
            unfit = moves and (lost >= 0 or new[2] > 0 or not do.kinetic(after, chain, h) <= bound)
            if not unfit:
                do.frame(chain, work, shown, basis, rate, q[:, framed], rates[:, framed], told[:, framed])
                gradients, solves, framed = gradients + new[0], solves + new[1], framed + 1
            for j in range(spent.size):
                spent[j] = kept[j]
            do.settle(chain, work, before.hi, before.lo)
            do.lost(chain, work, slope)
            lost = -1  # of the steps: a frame whose step loses a heading is left to `simulate`
            if unfit:
                break
            continue
        if step + 1 == due:
            place = places[passed % places.shape[0]]
            add_up(chain, after.hi, 1.0, place)
            if few:
                do.kick(before, after, chain, work, t + step * h, h, c, g, kicked)
                disc_by_disc(chain, kicked, place)
            if judge(chain, before.hi, after.hi, place, defects[passed]) > most:
                doubted = True
                for j in range(spent.size):
                    spent[j] = kept[j]
                break
            passed += 1
            due = looks[passed] - first if passed < looks.size else -1
        step += 1
        gradients, solves, unconverged = gradients + new[0], solves + new[1], unconverged + new[2]
        if do.vanishing(chain) and new[2] > 0 and not do.jumps(method):
            do.settle(chain, work, before.hi, before.lo)
            lost = ahead(chain, work, before, h, c, half, slope)
            if lost >= 0:
                return step, gradients, solves, unconverged, lost, passed, doubted, False, framed
            do.settle(chain, work, after.hi, after.lo)
        lost = do.lost(chain, work, slope)
        before, after = after, before
        blown = not do.kinetic(before, chain, h) <= bound
        if lost >= 0 or blown or unconverged >= many:
            break
    do.leave(chain, before, state)
    return step, gradients, solves, unconverged, lost, passed, doubted, blown, framed


@part
def add_up(chain, q, factor, total):
    """total += factor q, both (rows, n), q in the order of the chain."""
    for row in range(q.shape[0]):
        x, to = q[row], total[row]
        for i in range(to.size):
            to[i] += factor * x[do.place(chain, i)]


@stub
def judge(chain, start, end, place, defect):
    """The largest relative defect of a step; infinite if a heading turns by more than TURNED, as whole turns do not show.

    start, end : positions in the order of the chain. place : third differences, (rows, n); then positions at the `end` of the step.
    defect : (2, rows), defects and sizes, filled in.
    """


@fill(judge, object)
def _judge(chain, start, end, place, defect):
    worst = 0.0
    for row in range(end.shape[0]):
        off, size, turned, before, after, to = 0.0, 0.0, 0.0, start[row], end[row], place[row]
        for i in range(to.size):
            j = do.place(chain, i)
            off, size, turned = max(off, abs(to[i])), max(size, abs(after[j])), max(turned, abs(after[j] - before[j]))
            to[i] = after[j]
        off, size, turned = do.most(chain, off), do.most(chain, size), do.most(chain, turned)
        defect[0, row], defect[1, row] = off / 12, size
        worst = np.inf if row == 3 and turned > TURNED else max(worst, defect[0, row] / (size if size > 0 else 1.0))
    return worst


@kernel
def look(chain, state, v, q):
    """v = the velocities at a state; returns the energy and the largest slip, and q as for `seen`."""
    work, c = do.workspace(chain), np.empty_like(v)
    do.settle(chain, work, state.hi, state.lo)
    do.rate(state, chain, work, c, 1.0, v)
    return seen(chain, work, c, state.hi, state.lo, v, q)


@kernel
def observe(chain, hi, lo, v, q):
    """The energy and the largest slip at hi + lo and rates v; q as for `seen`."""
    work, c = do.workspace(chain), np.empty_like(hi)
    do.settle(chain, work, hi, lo)
    do.basis(chain, work, np.zeros_like(hi), c)
    return seen(chain, work, c, hi, lo, v, q)


@kernel
def reduced(chain, t, y, out):
    """The reduced equations q. = C pi, pi. = -C^T (grad V - f) at the time t, y = (q, pi) disc by disc, (n (rows + columns),)."""
    n, rows = chain.weights.shape[1], chain.scale.size
    width = rows + columns(rows)
    work, hi, v, c = do.workspace(chain), np.empty((rows, n)), np.empty((rows, n)), np.empty((rows, n))
    still, p, g = np.zeros((rows, n)), np.empty((columns(rows), n)), np.empty((columns(rows), n))
    for i in range(n):
        for row in range(rows):
            hi[row, i] = y[width * i + row]
        for row in range(columns(rows)):
            p[row, i] = y[width * i + rows + row]
    do.settle(chain, work, hi, still)
    do.basis(chain, work, still, c)
    forward(c, p, v)
    do.pullback(chain, work, Phase(hi, still, p), t, still, c, p, g)
    for i in range(n):
        for row in range(rows):
            out[width * i + row] = v[row, i]
        for row in range(columns(rows)):
            out[width * i + rows + row] = -g[row, i]
