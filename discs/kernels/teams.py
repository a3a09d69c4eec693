"""A chain that several threads share (`discs.kernels.parts`): its parts, and the call of a kernel in all threads at once."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import Context, ContextVar
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discs.kernels.meeting import GONE, LINE
from discs.skew import add

FEWEST = 64  # discs of a thread

_THREADS = ContextVar("threads", default=1)
_COMPILED: set[tuple[object, ...]] = set()  # kernels, and kinds of methods and chains, that were called


class Team(NamedTuple):
    """The parameters of a chain in lanes, one `Laned` or `Turning` for each thread, whose orders are `discs.kernels.parts.Part`.

    spent : as in `discs.kernels.load.Linear`, of the whole chain.
    """

    chains: tuple[Any, ...]
    spent: NDArray


@contextmanager
def using(threads: int) -> Iterator[None]:
    """Within it runs of fixed steps use so many threads, where their chain can be in lanes."""
    token = _THREADS.set(threads)
    try:
        yield
    finally:
        _THREADS.reset(token)


def threads(n: int) -> int:
    """The number of threads for a chain of n discs: that of `using`, but no more than have `FEWEST` discs each."""
    return max(1, min(_THREADS.get(), n // FEWEST))


def alone(chain: Any) -> Any:
    """The first part of a chain without other threads: compiled code that takes no steps with it need not wait for them."""
    from discs.kernels.parts import NOTES, sharing

    board = np.zeros((2, 1, NOTES)), np.zeros((2, 1, NOTES), complex), np.zeros(LINE, np.int64)
    return chain._replace(order=sharing(chain.order._replace(of=1), *board))


def march(
    kernel: Callable[..., Any],
    method: Any,
    team: Team,
    state: Any,
    t: float,
    h: float,
    steps: int,
    bound: float,
    first: int,
    looks: Any,
    places: Any,
    defects: Any,
    *rest: Any,
) -> tuple[Any, ...]:
    """`discs.kernels.driver.march` for a team: the arguments, and the arrays that it fills in, are those of the whole chain."""
    from discs.kernels.parts import NOTES, sharing

    most, many, since, framed, stops, rests, q, rates, told = rest
    count, whole, pieces = len(team.chains), (*state, places, q, rates), list[tuple[Any, ...]]()  # arrays (..., n)
    board = np.zeros((2, count, NOTES)), np.zeros((2, count, NOTES), complex), np.zeros(LINE * count, np.int64)
    own = [slice(chain.order.disc, chain.order.disc + chain.order.n) for chain in team.chains]
    cut = [[array[..., discs].copy() if array.size else array for array in whole] for discs in own]
    spent = [np.zeros_like(team.spent) for _ in own]
    for chain, (*z, place, positions, v), work in zip(team.chains, cut, spent, strict=True):
        chain = chain._replace(order=sharing(chain.order, *board), load=chain.load._replace(spent=work))
        look = looks, place, defects if not pieces else defects.copy()  # all threads fill in the same
        frame = stops, rests, positions, v, told if not pieces else told.copy()
        pieces.append((method, chain, type(state)(*z), t, h, steps, bound, first, *look, most, many, since, framed, *frame))

    failed = list[BaseException]()

    def run(number: int) -> tuple[Any, ...]:
        try:
            return tuple(kernel(*pieces[number]))
        except BaseException as error:
            failed.append(error)
            board[2][LINE * number] = GONE  # the others go on without this thread; what they find is dropped
            return ()

    if (kinds := (kernel, type(method), *map(type, team.chains[0]))) not in _COMPILED:
        kernel(method, alone(team.chains[0]), *pieces[0][2:5], 0, *pieces[0][6:])
        _COMPILED.add(kinds)
    with ThreadPoolExecutor(count - 1) as pool:
        for number in range(1, count):
            pool.submit(Context().run, run, number)
        found = Context().run(run, 0)
    if failed:
        raise failed[0]
    for discs, parts in zip(own, cut, strict=True):
        for array, part in zip(whole, parts, strict=True):
            if array.size:
                array[..., discs] = part
    for work in spent:
        team.spent[::2], team.spent[1::2] = add(team.spent[::2], team.spent[1::2] + work[1::2], work[::2])
    return found
