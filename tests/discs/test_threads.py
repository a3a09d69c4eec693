"""One chain of several threads: meetings, the linear system against NumPy, runs against those of one thread."""

import os
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from discs import Midpoint, SimulationError, load, simulate
from discs.integrators import METHODS
from discs.kernels import driver, elimination, meeting, orders, parts, steered_blocks, teams  # noqa: F401, the elimination
from discs.kernels import protocol as do
from discs.kernels.compiled import jit
from discs.kernels.lanes import HALO
from discs.kernels.meeting import LINE, meet
from discs.kernels.teams import Team, using
from discs.kernels.vectors import LANES
from discs.skew import Phase
from tests.conftest import SLAVED, STEERED, Model, models, uneven
from tests.discs.test_kernels import CLOSE, dense_banded
from tests.discs.test_lanes import apart
from tests.discs.test_loads_in_lanes import ROWS, loaded
from tests.discs.test_simulate import collapsing

pytestmark = pytest.mark.slow

FIELD = Model("springs", "field")


def together(call, *given):
    """The results of a call for each of several arguments, each in a thread of its own."""
    with ThreadPoolExecutor(len(given)) as pool:
        return [one.result(60) for one in [pool.submit(call, each) for each in given]]


def board(n, count):
    """The orders of a chain of n discs in so many threads, with a board in common."""
    common = np.zeros((2, count, parts.NOTES)), np.zeros((2, count, parts.NOTES), complex), np.zeros(LINE * count, np.int64)
    return [parts.sharing(one, *common) for one in parts.parts(n, count)]


def talk(arrived, me, words, late):
    """Write, meet, read what the others wrote; returns how often that was not the word of the same round."""
    wrong, count = 0, words.shape[1]
    for i in range(1, words.shape[2]):
        words[i & 1, me, 0] = i
        meet(arrived, me)
        for other in range(count):
            wrong += words[i & 1, other, 0] != i
        for _ in range(late * (i % 3)):  # out of step
            words[0, me, 1] += 1.0
    return wrong


@pytest.mark.parametrize(("compiled", "count"), [(True, 2), (True, 3), (False, 2)])
def test_after_a_meeting_each_thread_reads_what_others_wrote_before(compiled, count):
    arrived, words = np.zeros(LINE * count, np.int64), np.zeros((2, count, 2000 if compiled and count == 2 else 200))
    call = jit(talk) if compiled else talk
    assert together(lambda me: call(arrived, me, words, 50 * me), *range(count)) == [0] * count


def test_a_thread_that_is_gone_does_not_keep_the_others():
    arrived = np.zeros(2 * LINE, np.int64)
    arrived[LINE] = meeting.GONE
    jit(talk)(arrived, 0, np.zeros((2, 1, 50)), 0)
    assert arrived[0] == 49


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("kind", [float, complex])
def test_elimination(count, kind):
    """Parts have rows without a disc in the first lane, or none."""
    rng = np.random.default_rng(4)
    for n in (64 * count, 64 * count + 5, 200 + count):
        for ring, corners in ((False, False), (False, True), (True, False)):
            entries = rng.standard_normal((4, n)) + (1j * rng.standard_normal((4, n)) if kind is complex else 0)
            entries[0] += 12
            a, u, w, right = entries
            corner, found = rng.standard_normal(2) * corners, np.zeros(n, kind)
            matrix = dense_banded(a, u, w, corner)
            for i, j, value in ((n - 1, 0, u[-1]), (n - 2, 0, w[-2]), (n - 1, 1, w[-1])) if ring else ():
                matrix[i, j] = matrix[j, i] = value

            def solve(order, ring=ring, corners=corners, entries=entries, corner=corner, found=found):
                m, b, own = orders.pick(orders.matrices(order, kind(1), 1), 0), np.zeros(LANES * order.rows, kind), discs(order)
                m.a[:] = 1.0
                for array, values in zip((m.a, m.u, m.w, b), entries, strict=True):
                    array[order.places] = values[own]
                m.corner[:] = corner
                orders.factor(order, ring, corners, m)
                orders.solve(order, ring, corners, m, b)
                found[own] = b[order.places]

            together(solve, *board(n, count))
            np.testing.assert_allclose(found, np.linalg.solve(matrix, right), atol=1e-14, err_msg=f"{n}, {ring}")


def discs(order):
    return slice(order.disc, order.disc + order.n)


@models(SLAVED + STEERED)
@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.filterwarnings("ignore:.*too long for this motion", "ignore:.*did not converge", "ignore:.*energy is conserved, but")
def test_several_threads_and_one_agree(model, count, kernels_as_python):
    """Converged, and after one sweep, where the matrix matters; frames between steps; the estimate of the error."""
    problem = uneven(64 * count + 7, model)
    for method in (Midpoint(), Midpoint(sweeps=1, tolerance=0), METHODS["gauss4"](sweeps=4, tolerance=0)):
        one, several = (simulate(problem, method, 0.002, [0.006, 0.007], (), False, "compiled", threads=k) for k in (1, count))
        assert max(apart(one, several)) < CLOSE, method
        assert several.stats["threads"] == count
        assert "threads" not in one.stats
        assert several.stats["step_error"] == pytest.approx(one.stats["step_error"], rel=1e-6)


@models([FIELD, Model("ring", "steered")])
def test_loads(model, kernels_as_python):
    """Their work is that of all parts."""
    problem = loaded(135, model)
    one, several = (simulate(problem, Midpoint(), 0.03, [0.06, 0.1], (), False, "compiled", threads=k) for k in (1, 2))
    assert max(apart(one, several, ROWS)) < CLOSE
    assert np.abs(several.work[1:]).min() > 1e-6


@models([Model("ring", "field"), Model("ring", "steered")])
def test_links_of_both_digits(model):
    """Low digits of positions count in links within parts, between them and around the ring."""
    system, z = uneven(135, model).system, uneven(135, model).start()
    low, links = np.random.default_rng(2).standard_normal(z.hi.shape), np.zeros(z.hi.shape)
    pi = np.atleast_2d(z.pi)

    def settle(chain):
        own = discs(chain.order)
        state = do.enter(chain, Phase(*(np.ascontiguousarray(array[:, own]) for array in (z.hi, low, pi))))
        work = do.workspace(chain)
        do.settle(chain, work, state.hi, state.lo)
        links[:, own] = work.base[:, HALO + chain.order.places]

    settle(system.lanes)
    one = links.copy()
    orders_of = board(135, 2)
    together(settle, *(chain._replace(order=order) for chain, order in zip(system.parts(2), orders_of, strict=True)))
    np.testing.assert_array_equal(links, one)
    assert np.abs(one[0, 0] - (z.hi[0, 0] - z.hi[0, -1])) > 1e-3


def test_frames_of_compiled_steps(kernels_as_python):
    """Positions, rates, energy and slip, as of one thread."""
    problem, method, found = uneven(135, Model("consistent", "unit")), Midpoint(), []
    system, z = problem.system, problem.start()
    for count in (1, 2):
        frames = [np.zeros((3, 2, 135)), np.zeros((1, 2, 135)), np.zeros((2, 2))]
        with using(count):
            stops = 2**62, 0, 0, np.array([0, 2]), np.array([0.0, 0.001]), *frames
            _, tally = method.march(system, system.parameters, z, 0.0, 0.002, 3, np.inf, stops=stops)
        assert tally.framed == 2
        found.append(frames)
    for one, several in zip(*found, strict=True):
        np.testing.assert_allclose(several, one, rtol=1e-12, atol=1e-12)
    assert found[1][2][0] == pytest.approx(problem.energy(), rel=1e-12)


@pytest.mark.filterwarnings("ignore:.*too long for this motion")
def test_compiled():
    """The same bits each time, and those of one thread to rounding."""
    problem = uneven(1001, FIELD)
    one, *two = (simulate(problem, Midpoint(), 0.002, [0.05], (), False, "compiled", threads=k) for k in (1, 2, 2))
    assert max(apart(one, two[0])) < CLOSE
    np.testing.assert_array_equal(two[0].x, two[1].x)
    np.testing.assert_array_equal(two[0].theta, two[1].theta)


def test_ctrl_c_ends_all_threads():
    problem = replace(uneven(2001, FIELD), duration=1000.0)
    simulate(replace(problem, duration=0.004), Midpoint(), 0.002, 1, progress=False, engine="compiled", threads=2)  # compiled
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    started = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        simulate(problem, Midpoint(), 0.002, 1, progress=False, engine="compiled", threads=2)
    assert time.perf_counter() - started < 10
    assert threading.active_count() < 4  # no thread goes on


def test_an_error_in_one_thread_is_that_of_the_run(kernels_as_python, monkeypatch):
    whole = driver.march

    def march(method, chain, *rest):
        if rest[3] > 0 and getattr(chain.order, "number", 0) == 1:
            raise MemoryError("no room")
        return whole(method, chain, *rest)

    monkeypatch.setattr(driver, "march", march)
    with pytest.raises(MemoryError, match="no room"):
        simulate(uneven(135, FIELD), Midpoint(), 0.002, [0.004], (), False, "compiled", threads=2)


def test_a_lost_heading_is_that_of_its_disc(kernels_as_python):
    problem, _ = collapsing(140)
    found = []
    for count in (1, 2):
        with pytest.raises(SimulationError, match="lost its heading") as caught:
            simulate(problem, Midpoint(), 0.01, 1, progress=False, engine="compiled", threads=count)
        found.append((caught.value.step, caught.value.slope))
        assert 0 <= caught.value.disc < 140
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_a_run_goes_on_with_as_many_threads(tmp_path, kernels_as_python):
    problem, path = uneven(135, FIELD), tmp_path / "run.nc"
    given = Midpoint(), 0.002, [0.004, 0.008]
    run = simulate(problem, *given, progress=False, checkpoint=path, threads=2)
    assert load(path).stats["threads"] == run.stats["threads"] == 2
    with pytest.raises(ValueError, match="whose threads differs"):
        simulate(problem, *given, progress=False, checkpoint=path)
    whole = simulate(problem, *given, progress=False, engine="compiled", threads=2)
    np.testing.assert_array_equal(load(path).x, whole.x)


def test_threads_are_for_chains_in_lanes(kernels_as_python):
    """A thread has 64 discs or more; explicit methods and the plain engine have one thread."""
    for n, method, engine in ((127, "midpoint", "compiled"), (135, "rk4", "compiled"), (135, "midpoint", "plain")):
        run = simulate(uneven(n, FIELD), method, 1e-4, [1e-4], (), False, engine, threads=2)
        assert "threads" not in run.stats
    system = uneven(200, FIELD).system
    with using(8):
        assert isinstance(team := Midpoint().twin_of(system, system.parameters), Team)
        assert [chain.order.n for chain in team.chains] == [72, 64, 64]
    for bad in (0, -1, 1.5, "two", None):
        with pytest.raises(ValueError, match="threads must be a whole number of at least 1"):
            simulate(uneven(5, FIELD), threads=bad)


def test_other_threads_are_another_plan(kernels_as_python):
    """Their kernels are others, too."""
    problem, method, plans = uneven(135, FIELD), Midpoint(), list[object]()
    for count in (1, 2, 2):
        simulate(problem, method, 0.002, [0.002], (), False, "compiled", threads=count)
        plans.append(problem.kept["plan"][0])
    assert plans[0] is not plans[1]
    assert plans[1] is plans[2]
