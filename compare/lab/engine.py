"""Kernels for live runs: read from disc, or compiled, while the discs already move by the plain engine."""

import time
from concurrent.futures import Future, ThreadPoolExecutor

from discs import Problem
from discs.integrators import find
from discs.kernels.background import usual
from discs.running.engine import plain_because
from discs.running.ready import kernels, kinds
from discs.warn import kept

LOOK_AGAIN = 2.0  # seconds until kernels that were not there are looked for again


class Engines:
    """Which engine a run can take now. A thread reads kernels; what is not on disc is compiled by the process of `simulate`."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "kernels")
        self._asked: dict[tuple[object, ...], Future[bool]] = {}
        self._looked: dict[tuple[object, ...], float] = {}

    def engine(self, problem: Problem, method: str, dt: float) -> str:
        """The engine "compiled" if the kernels are there; otherwise "plain", and they are asked for."""
        integrator, engine = find(method), usual()
        if plain_because(problem, integrator, engine, ()):
            return "plain"
        key, now = kinds(problem.system, integrator, True), time.monotonic()
        future = self._asked.get(key)
        if future is not None and future.done() and future.exception() is None and future.result():
            return "compiled"
        if future is None or (future.done() and now > self._looked[key] + LOOK_AGAIN):
            self._asked[key], self._looked[key] = self._thread.submit(_there, engine, problem, method, dt), now
        return "plain"

    def close(self) -> None:
        """End the thread when it has read what it reads now."""
        self._thread.shutdown(wait=False, cancel_futures=True)


def _there(engine: str, problem: Problem, method: str, dt: float) -> bool:
    """Whether the kernels of a run are there: what the thread does."""
    with kept():  # the run itself warns
        return bool(kernels(engine, problem, find(method), dt, True, True))
