"""One chain in lanes: vectors, the linear system against NumPy, runs of 64 discs or more against the plain engine."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import untwisting_rod
from discs import Midpoint, SimulationError, simulate
from discs.integrators import METHODS
from discs.kernels import elimination, lanes, orders, vectors  # noqa: F401, the elimination
from discs.kernels import protocol as do
from discs.kernels.compiled import jit
from discs.kernels.lean import lean
from discs.kernels.slaved_lanes import MANY, Laned
from discs.kernels.vectors import LANES, after, before, larger, largest, load, store, zero
from discs.skew import Phase
from tests.conftest import SLAVED, Model, longer, models, uneven
from tests.discs.test_kernels import CLOSE, dense_banded
from tests.discs.test_simulate import collapsing

pytestmark = pytest.mark.slow

SIZES = [*range(64, 74), 129]  # with 0, 7, 6, ... 0, 7 entries without a disc


def formula(a, b, out):
    v, w = load(a, 0), load(b, 1)
    store(out, 0, (2.0 * v - w) / (1.0 + abs(w)) + np.sqrt(v * v))
    store(out, LANES, before(-v))
    store(out, 2 * LANES, after(v) + zero())
    store(out, 3 * LANES, larger(w, v))
    return largest(v, out[4 * LANES :])


def of_complex(a, b, out):
    v, w, x = load(a, 0), load(a, LANES), load(b, 0)
    store(out, 0, (v - w * v) * (1.0 / w) + 2.0 * (x * v))
    store(out, LANES, before(-v))
    store(out, 2 * LANES, after(w * x))


@pytest.mark.parametrize("compiled", [True, False])
def test_complex_vectors(compiled):
    rng = np.random.default_rng(6)
    a, b, out = (
        rng.standard_normal(2 * LANES) + 1j * rng.standard_normal(2 * LANES),
        rng.standard_normal(LANES),
        np.zeros(24, complex),
    )
    (jit(of_complex) if compiled else of_complex)(a, b, out)
    v, w = a.reshape(2, LANES)
    np.testing.assert_allclose(out[:LANES], (v - w * v) / w + 2 * b * v, rtol=1e-14)
    np.testing.assert_array_equal(out[LANES : 2 * LANES], np.roll(-v, 1))
    np.testing.assert_allclose(out[2 * LANES :], np.roll(w * b, -1), rtol=4e-16)


@pytest.mark.parametrize("compiled", [True, False])
def test_vectors(compiled):
    a, b = np.random.default_rng(5).standard_normal((2, LANES + 1))
    out, v, w = np.zeros(5 * LANES), a[:LANES], b[1:]
    assert (jit(formula) if compiled else formula)(a, b, out) == v.max()
    np.testing.assert_allclose(out[:LANES], (2 * v - w) / (1 + abs(w)) + abs(v), rtol=4e-16)
    expected = np.roll(-v, 1), np.roll(v, -1), np.maximum(v, w)
    np.testing.assert_array_equal(out[LANES : 4 * LANES].reshape(3, LANES), expected)


def test_the_larger_entry_is_never_not_a_number():
    """A sweep that changes a disc by NaN is noticed by the energy, as one disc by disc."""
    out = np.full(5 * LANES, np.nan)
    jit(formula)(np.ones(LANES), np.full(LANES + 1, np.nan), out)
    np.testing.assert_array_equal(out[3 * LANES : 4 * LANES], 1.0)


def test_vectors_are_computed_all_lanes_at_once():
    compiled = jit(formula)
    compiled(*np.ones((2, LANES + 1)), np.zeros(5 * LANES))
    (assembly,) = compiled.inspect_asm().values()
    if "xmm" not in assembly:
        pytest.skip("not a processor of this kind")
    assert "divpd" in assembly
    assert "divsd" not in assembly


@pytest.mark.parametrize("kind", [float, longer(complex)])
def test_elimination_in_lanes(kind):
    def solve(order, ring, corners, m, b):
        orders.factor(order, ring, corners, m)
        orders.solve(order, ring, corners, m, b)

    compiled, rng = jit(solve), np.random.default_rng(4)
    for n in [*SIZES, 1000]:
        order = lanes.order(n)
        for ring, corners in ((False, False), (False, True), (True, False)):
            m, b = orders.pick(orders.matrices(order, kind(1), 1), 0), np.zeros(LANES * order.rows, kind)
            entries = rng.standard_normal((4, n)) + (1j * rng.standard_normal((4, n)) if kind is complex else 0)
            a, u, w, right = entries
            a += 12
            m.a[:] = 1.0
            for array, values in zip((m.a, m.u, m.w, b), entries, strict=True):
                array[order.places] = values
            m.corner[:] = rng.standard_normal(2) * corners
            matrix = dense_banded(a, u, w, m.corner)
            for i, j, value in ((n - 1, 0, u[-1]), (n - 2, 0, w[-2]), (n - 1, 1, w[-1])) if ring else ():
                matrix[i, j] = matrix[j, i] = value
            with lean():  # compiles in half the time
                (solve if n == 65 else compiled)(order, ring, corners, m, b)
            np.testing.assert_allclose(b[order.places], np.linalg.solve(matrix, right), atol=1e-14, err_msg=f"{n}, {ring}")


def apart(a, b, rows=("x", "y", "theta", "omega", "energy")):
    """The largest difference of two runs in each of some rows, relative to the largest value."""
    return [np.abs(getattr(a, row) - getattr(b, row)).max() / np.abs(getattr(b, row)).max() for row in rows]


@models(SLAVED)
@pytest.mark.filterwarnings("ignore:.*too long for this motion")
def test_lanes_and_the_plain_engine_agree(model):
    """Converged, and after one sweep, where the matrix matters; `step_error` compares positions in the order of discs."""
    for n in SIZES:
        problem = uneven(n, model)
        for method in (Midpoint(), Midpoint(sweeps=1, tolerance=0)):
            a, b = (simulate(problem, method, 0.05, [0.1, 0.175], (), False, engine) for engine in ("compiled", "plain"))
            assert max(apart(a, b)) < CLOSE, (n, method)
            assert abs(a.stats["solves"] - b.stats["solves"]) <= 1
            assert a.stats["step_error"] == pytest.approx(b.stats["step_error"], rel=1e-9)


@pytest.mark.parametrize("name", ["gauss4", "gauss6", "gauss8", "radau5"])
@pytest.mark.filterwarnings("ignore:.*too long for this motion", "ignore:.*energy is conserved, but")
def test_collocation_in_lanes_and_the_plain_engine_agree(name, kernels_as_python):
    for ends, law in (("springs", "field"), ("consistent", "unit"), ("paper", "unit"), ("ring", "field")):
        problem, method = uneven(65, Model(ends, law)), METHODS[name](sweeps=6, tolerance=0)
        a, b = (simulate(problem, method, 0.03, [0.06, 0.07], (), False, engine) for engine in ("compiled", "plain"))
        assert a.stats["engine"] == "compiled"
        assert max(apart(a, b)) < CLOSE, (ends, law)


def test_compiled_collocation_in_lanes():
    twist = lump(untwisting_rod(duration=0.05), 513)
    for problem in (uneven(64, Model("springs", "field")), uneven(65, Model("ring", "field")), twist):
        a, b = (simulate(problem, "gauss6", 0.025, [0.05], (), False, engine) for engine in ("compiled", "plain"))
        assert max(apart(a, b)) < CLOSE
        assert a.energy[-1] == pytest.approx(problem.energy(), rel=1e-12)


def test_a_run_of_one_step_is_judged_in_the_order_of_discs(kernels_as_python, monkeypatch):
    """By the change of the force, as disc by disc."""
    problem = replace(uneven(65, Model("ring", "field")), duration=3e-4)
    one = simulate(problem, dt=3e-4, frames=1, progress=False)
    monkeypatch.setitem(vars(problem.system), "lanes", None)
    other = simulate(problem, dt=3e-4, frames=1, progress=False)
    assert one.stats["step_error"] == pytest.approx(other.stats["step_error"], rel=1e-6)
    assert one.stats["step_error"] > 1e-6


def test_what_belongs_to_no_disc_is_at_rest():
    problem = uneven(65, Model("ring", "field"))
    chain, z = problem.system.lanes, problem.start()
    own, work = do.enter(chain, Phase(z.hi, z.lo, z.pi[None])), do.workspace(chain)
    c, still, g = np.zeros_like(own.hi), np.zeros_like(own.hi), np.zeros_like(own.pi)
    do.settle(chain, work, own.hi, own.lo)
    do.basis(chain, work, still, c)
    do.pullback(chain, work, own, 0.0, still, c, own.pi, g)
    of_discs = np.zeros(g.size, bool)
    of_discs[chain.order.places] = True
    assert not g[0, ~of_discs].any()
    assert g[0, of_discs].all()


@pytest.mark.parametrize("n", [4097, 16385])
def test_many_discs_in_lanes(n):
    problem = lump(untwisting_rod(duration=0.05), n, "consistent")
    a, b = (simulate(problem, Midpoint(), 0.025, 1, progress=False, engine=engine) for engine in ("compiled", "plain"))
    assert max(apart(a, b, ("x", "y", "theta"))) < 1e-12  # sweeps stop at 1e-12
    assert abs(a.energy[-1] - problem.energy()) < 4e-13  # a sum of 16385 terms: as measured disc by disc, too


def test_the_number_of_discs_decides():
    """Fewer discs, and explicit methods, run disc by disc."""
    few, many = (uneven(n, Model("springs", "field")).system for n in (MANY - 1, MANY))
    assert few.lanes is None
    for name, method in METHODS.items():
        if name in ("midpoint", "suzuki4", "gauss6", "radau5"):
            assert isinstance(method().twin_of(many, many.parameters), Laned)
            assert method().twin_of(few, few.parameters) is few.parameters
        elif not method.adaptive:
            assert method.in_lanes or method().twin_of(many, many.parameters) is many.parameters


def test_a_lost_heading_is_that_of_its_disc():
    """All discs of a ring that collapses lose their headings at about the same time."""
    problem, _ = collapsing(70)
    found = []
    for engine in ("compiled", "plain"):
        with pytest.raises(SimulationError, match="lost its heading") as caught:
            simulate(problem, Midpoint(), 0.01, 1, progress=False, engine=engine)
        found.append((caught.value.step, caught.value.slope))
        assert 0 <= caught.value.disc < 70
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_steps_in_lanes_go_on_from_any_state_to_the_same_bits():
    problem, method = uneven(67, Model("ring", "unit")), Midpoint()
    system, start = problem.system, problem.start()
    whole, _ = method.march(system, system.parameters, start, 0.0, 0.02, 5, np.inf)
    part, _ = method.march(system, system.parameters, start, 0.0, 0.02, 2, np.inf)
    part, _ = method.march(system, system.parameters, part, 0.04, 0.02, 3, np.inf)
    for one, other in zip(whole, part, strict=True):
        np.testing.assert_array_equal(one, other)
    assert not np.array_equal(start.hi, whole.hi)


def test_vectors_have_eight_lanes():
    assert vectors.LANES == 8  # `Order.first` < 8 is at most the rows of 64 discs less two
