"""One chain of several threads: each has some of its discs, in lanes as in `discs.kernels.lanes`, and takes the same steps.

A chain of T threads is cut into 8 T segments. The threads meet (`discs.kernels.meeting`) wherever a lane needs what is in another
thread: neighbours, the system of the separators, which each of them solves as a whole, and sums and largest values, from which all
threads draw the same conclusions. What they tell each other is on a board; its two sides take turns, so that a thread may write on
one while others still read the other.

`discs.kernels.teams` starts the threads.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels import lanes, orders
from discs.kernels.compiled import PART, fill, later, part
from discs.kernels.interrupts import interrupted
from discs.kernels.lanes import HALO
from discs.kernels.meeting import LINE, meet
from discs.kernels.vectors import LANES, after, before, load, store

NOTES = 12 * LANES  # numbers that a thread tells the others at once, at most


class Part(NamedTuple):
    """The order of the discs of thread `number` of `of`; see `lanes.Order`. disc : its first disc in the chain.

    real, complex : (2, of, NOTES), the board, of numbers of either kind. arrived : (LINE of,), see `meeting`. stop : (2,),
    whether this thread was told of Ctrl-C, which only thread 0 is, and whether all threads know of it.
    """

    n: int
    rows: int
    first: int
    places: NDArray
    inner: NDArray
    left: int
    right: int
    disc: int
    number: int
    of: int
    real: NDArray
    complex: NDArray
    arrived: NDArray
    stop: NDArray


def parts(n: int, count: int) -> list[Part]:
    """The orders of the parts of a chain of n >= 64 count discs; all but the first have whole rows."""
    rows, made = n // (LANES * count), list[Part]()
    board = {"real": np.empty((2, 0, 0)), "complex": np.empty((2, 0, 0), complex), "arrived": np.empty(0, np.int64)}
    for number in range(count):
        size = n - LANES * rows * (count - 1) if number == 0 else LANES * rows
        own: dict[str, Any] = lanes.order(size)._asdict() | board | {"number": number, "of": count, "stop": np.zeros(2)}
        own |= {"left": int(number > 0), "right": 1 + int(number == count - 1), "disc": sum(one.n for one in made)}
        if number > 0:
            own["inner"] = np.ones(LANES)
        made.append(Part(**own))
    return made


def sharing(order: Part, real: NDArray, of_complex: NDArray, arrived: NDArray) -> Part:
    """The order with a board that it shares with other parts."""
    return order._replace(real=real, complex=of_complex, arrived=arrived, stop=np.zeros(2))


def board(order, v):
    """The board for vectors like v, as a tuple of one: parts may not return an array that is no argument."""
    return (order.complex if np.iscomplexobj(v) else order.real,)


def _form() -> None:
    from numba.extending import overload

    def form(order, v):
        return (lambda order, v: (order.complex,)) if str(v) == "complex vector" else (lambda order, v: (order.real,))

    overload(board, jit_options=PART)(form)


later(_form)


@part
def side(order):
    """The side of the board that is written on before the next meeting."""
    return order.arrived[LINE * order.number] & 1


@part
def beside(order):
    """The numbers of the threads before and after this one, around a ring."""
    return (order.number if order.number > 0 else order.of) - 1, order.number + 1 if order.number + 1 < order.of else 0


fill(orders.present, Part)(lanes.present)
fill(orders.record, Part)(lanes.record)


@fill(orders.separators, Part, _nrt=True)
def _separators(order, g, count):
    return lanes.tied(LANES * order.of, g, count)


@fill(orders.previous, Part)
def _previous(order, v, w):
    notes = board(order, v)[0][side(order)]
    mine = notes[order.number]
    store(mine, 0, before(v))
    store(mine, LANES, before(w))
    store(mine, 2 * LANES, before(v))
    store(mine, 3 * LANES, before(w))
    meet(order.arrived, order.number)
    back, _ = beside(order)
    mine[2 * LANES], mine[3 * LANES] = notes[back, 0], notes[back, LANES]
    return load(mine, 2 * LANES), load(mine, 3 * LANES)


@fill(orders.join, Part)
def _join(order, ring, x):
    end, notes = HALO + LANES * order.rows, order.real[side(order)]
    for row in range(x.shape[0]):
        for k in range(2):
            notes[order.number, 4 * row + k] = x[row, LANES * (order.rows + k) + LANES - 1]
            notes[order.number, 4 * row + 2 + k] = x[row, HALO + order.places[k]]
    meet(order.arrived, order.number)
    back, on = beside(order)
    for row in range(x.shape[0]):
        to = x[row]
        for k in range(2):
            store(to, LANES * k, before(load(to, LANES * (order.rows + k))))
            store(to, end + LANES * k, after(load(to, HALO + LANES * k)))
            to[LANES * k], to[end + LANES * (k + 1) - 1] = 0.0, 0.0
        for k in range(2):  # the two entries before the first disc, which may be in the rows above, and after the last one
            if ring or back < order.number:
                to[LANES * (order.first + k)] = notes[back, 4 * row + k]
            if ring or on > order.number:
                to[end + LANES * (k + 1) - 1] = notes[on, 4 * row + 2 + k]


@fill(orders.wrap, Part)
def _wrap(order, x):
    notes = order.real[side(order)]
    for row in range(x.shape[0]):
        for k in range(2):
            notes[order.number, 2 * row + k] = x[row, order.places[k]]
    meet(order.arrived, order.number)
    _, on = beside(order)
    for row in range(x.shape[0]):
        for k in range(2):
            i = LANES * (order.rows + k)
            store(x[row], i, after(load(x[row], LANES * k)))
            x[row, i + LANES - 1] = notes[on, 2 * row + k]


@fill(orders.first_links, Part)
def _first_links(order, ring, shift, x, e, to):
    notes, last, i = order.real[side(order)], x.shape[1] - 1, LANES * order.first
    for row in range(x.shape[0]):
        notes[order.number, 2 * row], notes[order.number, 2 * row + 1] = x[row, last], e[row, last]
    meet(order.arrived, order.number)
    if order.number > 0:
        return
    back, _ = beside(order)
    for row in range(x.shape[0]):
        for j in range(0, i + LANES, LANES):
            to[row, HALO + j] = 0.0
        if ring:
            to[row, HALO + i] = (x[row, i] - notes[back, 2 * row]) + (e[row, i] - notes[back, 2 * row + 1]) + shift[row]


@fill(orders.rejoin, Part)
def _rejoin(order, base, move, to):
    notes, last, i = order.real[side(order)], move.shape[1] - 1, LANES * order.first
    for row in range(2):
        notes[order.number, row] = move[row, last]
    meet(order.arrived, order.number)
    back, _ = beside(order)
    for row in range(2 if order.number == 0 else 0):
        to[row, HALO + i] = base[row, HALO + i] + (move[row, i] - notes[back, row])


@fill(orders.lead, Part)
def _lead(order, m):
    i, end, u, w, notes = LANES * order.first, LANES * order.rows - 1, m.u, m.w, board(order, load(m.u, 0))[0][side(order)]
    mine = notes[order.number]
    mine[0], mine[1], mine[2] = w[end - LANES], u[end], w[end]
    meet(order.arrived, order.number)
    back, _ = beside(order)
    if order.number == 0:
        m.lead[0, i], m.lead[1, i], m.lead[1, i + LANES] = notes[back, 0], notes[back, 1], notes[back, 2]


@fill(orders.factor_separators, Part)
def _factor_separators(order, ring, m, own, sums, ties):
    notes, size = board(order, own[0])[0][side(order)], LANES * order.of
    mine = notes[order.number]
    for k in range(3):
        store(mine, LANES * k, own[k])
        store(mine, LANES * (3 + k), sums[k])
    for k in range(4):
        store(mine, LANES * (6 + k), ties[k])
    meet(order.arrived, order.number)
    for j in range(size):
        here, there = notes[j // LANES], notes[(j + 1) % size // LANES]
        lane, on = j % LANES, (j + 1) % LANES
        for k in range(3):
            m.d[k, j] = here[LANES * k + lane] - there[LANES * (3 + k) + on]
        for k in range(4):
            m.o[k, j] = there[LANES * (6 + k) + on]
    lanes.factor_tied(ring, m, size)


@fill(orders.solve_separators, Part)
def _solve_separators(order, ring, m, x, y, at_x, at_y):
    notes, size, start = board(order, x)[0][side(order)], LANES * order.of, LANES * order.number
    mine = notes[order.number]
    store(mine, 0, x)
    store(mine, LANES, y)
    store(mine, 2 * LANES, at_x)
    store(mine, 3 * LANES, at_y)
    meet(order.arrived, order.number)
    for j in range(size):
        here, there = notes[j // LANES], notes[(j + 1) % size // LANES]
        for k in range(2):
            m.rest[k, j] = here[LANES * k + j % LANES] - there[LANES * (2 + k) + (j + 1) % LANES]
    lanes.solve_tied(ring, m, size)
    for lane in range(LANES):
        j = (start if start + lane > 0 else size) + lane - 1
        mine[4 * LANES + lane], mine[5 * LANES + lane] = m.rest[0, j], m.rest[1, j]
    return load(m.rest[0], start), load(m.rest[1], start), load(mine, 4 * LANES), load(mine, 5 * LANES)


@fill(orders.most, Part)
def _most(order, x):
    notes = order.real[side(order)]
    notes[order.number, 0], notes[order.number, 1] = x, order.stop[0]
    meet(order.arrived, order.number)
    found = notes[0, 0]
    for number in range(1, order.of):
        found = notes[number, 0] if notes[number, 0] > found else found
    order.stop[1] = notes[0, 1]
    return found


@fill(orders.added, Part)
def _added(order, x):
    notes = order.real[side(order)]
    notes[order.number, 0] = x
    meet(order.arrived, order.number)
    total = 0.0
    for number in range(order.of):
        total += notes[number, 0]
    return total


@fill(orders.halted, Part)
def _halted(order, size):
    """Thread 0 asks; all threads hear of it where they next compare changes."""
    if order.number == 0 and interrupted(order.of * size):
        order.stop[0] = 1.0
    return order.stop[1] > 0
