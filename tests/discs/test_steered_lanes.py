"""Own headings in lanes: the linear system against NumPy, runs of 64 discs or more against the plain engine."""

from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import steered_rod
from discs import Midpoint, simulate
from discs.integrators import METHODS
from discs.kernels import abreast, lanes, steered_blocks
from discs.kernels import protocol as do
from discs.kernels.compiled import jit
from discs.kernels.lean import lean
from discs.kernels.steered_lanes import MANY, Turning
from discs.kernels.vectors import LANES
from discs.skew import Phase
from tests.conftest import STEERED, Model, longer, models, uneven
from tests.discs.test_kernels import CLOSE
from tests.discs.test_lanes import apart

pytestmark = pytest.mark.slow

ROWS = "x", "y", "theta", "phi", "omega", "phi_rate", "energy"
SIZES = [*range(64, 74), 130]  # with 0, 7, 6, ... 0, 7, 6 entries without a disc


def factor_and_solve(order, ring, m, b):
    steered_blocks.factor(order, ring, m)
    steered_blocks.solve(order, ring, m, b)


def dense(d, o, ring):
    """The matrix with the blocks d (3, n), o (4, n); the last one of o ties the last disc to the first one on a ring."""
    n = d.shape[1]
    full = np.zeros((n, 2, n, 2), d.dtype)
    for i in range(n):
        full[i, :, i] += np.array([[d[0, i], d[1, i]], [d[1, i], d[2, i]]])
        if i < n - 1 or ring:
            full[i, :, (i + 1) % n] += o[:, i].reshape(2, 2)
            full[(i + 1) % n, :, i] += o[:, i].reshape(2, 2).T
    return full.reshape(2 * n, 2 * n)


def blocks(rng, kind, *shape):
    """Random d, o and right side of a diagonally dominant system."""
    parts = [rng.standard_normal((rows, *shape)) for rows in (3, 4, 2)]
    if kind is complex:
        parts = [part + 1j * rng.standard_normal(part.shape) for part in parts]
    parts[0][[0, 2]] += 12
    return parts


@pytest.mark.parametrize("kind", [float, longer(complex)])
def test_elimination_of_one_chain(kind):
    compiled, rng = jit(factor_and_solve), np.random.default_rng(4)
    for n in (*SIZES, 1000):
        order = lanes.order(n)
        for ring in (False, True):
            m = steered_blocks.pick(steered_blocks.matrices(order, ring, kind(1), 1), 0)
            d, o, right = blocks(rng, kind, n)
            o[:, -1] *= ring
            b = np.zeros((2, LANES * order.rows), kind)
            m.d[[0, 2]] = 1.0
            for to, values in ((m.d, d), (m.o, o), (b, right)):
                to[:, order.places] = values
            with lean():
                (factor_and_solve if n == 65 else compiled)(order, ring, m, b)
            expected = np.linalg.solve(dense(d, o, ring), right.T.ravel()).reshape(n, 2).T
            np.testing.assert_allclose(b[:, order.places], expected, atol=1e-14, err_msg=f"{n}, {ring}")


@pytest.mark.parametrize("kind", [float, longer(complex)])
def test_elimination_of_chains_side_by_side(kind):
    compiled, rng = jit(factor_and_solve), np.random.default_rng(4)
    for ring, n in ((False, 2), (False, 3), (False, 9), (True, 5), (True, 9)):
        order = abreast.Abreast(n, n, 0, ring)
        m = steered_blocks.pick(steered_blocks.matrices(order, ring, kind(1), 1), 0)
        d, o, right = blocks(rng, kind, n, LANES)
        o[:, -1] *= ring
        m.d[:], m.o[:] = d.reshape(3, -1), o.reshape(4, -1)
        b = right.reshape(2, -1).copy()
        with lean():
            (factor_and_solve if n == 9 else compiled)(order, ring, m, b)
        for lane in range(LANES):
            expected = np.linalg.solve(dense(d[..., lane], o[..., lane], ring), right[..., lane].T.ravel()).reshape(n, 2).T
            np.testing.assert_allclose(b.reshape(2, n, LANES)[..., lane], expected, atol=1e-14, err_msg=f"{n}, {ring}, {lane}")


@models(STEERED)
@pytest.mark.filterwarnings("ignore:.*too long for this motion", "ignore:.*energy is conserved, but")
def test_lanes_and_the_plain_engine_agree(model):
    """Converged, and after one sweep, where the matrix matters; `step_error` compares positions in the order of discs."""
    for n in SIZES:
        problem = uneven(n, model)
        for method in (Midpoint(), Midpoint(sweeps=1, tolerance=0)):
            a, b = (simulate(problem, method, 0.05, [0.1, 0.175], (), False, engine) for engine in ("compiled", "plain"))
            assert max(apart(a, b, ROWS)) < CLOSE, (n, method)
            assert abs(a.stats["solves"] - b.stats["solves"]) <= 1
            assert a.stats["step_error"] == pytest.approx(b.stats["step_error"], rel=1e-9)


@pytest.mark.parametrize("name", ["gauss4", "gauss6", "gauss8", "radau5"])
@pytest.mark.filterwarnings("ignore:.*too long for this motion", "ignore:.*energy is conserved, but")
def test_collocation_in_lanes_and_the_plain_engine_agree(name, kernels_as_python):
    for model in STEERED:
        problem, method = uneven(65, model), METHODS[name](sweeps=6, tolerance=0)
        a, b = (simulate(problem, method, 0.03, [0.06, 0.07], (), False, engine) for engine in ("compiled", "plain"))
        assert a.stats["engine"] == "compiled"
        assert max(apart(a, b, ROWS)) < CLOSE, model


def test_compiled_collocation_in_lanes():
    twist = lump(steered_rod(stretch_stiffness=10, shear_stiffness=10, heading_inertia=0.25, duration=0.05), 513)
    for problem in (uneven(65, Model("ring", "steered")), twist):
        a, b = (simulate(problem, "gauss6", 0.025, [0.05], (), False, engine) for engine in ("compiled", "plain"))
        assert max(apart(a, b, ("x", "y", "theta", "phi", "energy"))) < CLOSE


@pytest.mark.parametrize("n", [4097, 16385])
@pytest.mark.filterwarnings("ignore:.*too long for this motion")  # two steps: y has hardly moved
def test_many_discs_in_lanes(n):
    problem = lump(steered_rod(stretch_stiffness=10, shear_stiffness=10, heading_inertia=0.25, duration=0.05), n)
    a, b = (simulate(problem, Midpoint(), 0.025, 1, progress=False, engine=engine) for engine in ("compiled", "plain"))
    assert max(apart(a, b, ("x", "y", "theta"))) < 1e-12  # sweeps stop at 1e-12
    assert abs(a.phi - b.phi).max() < 1e-12
    assert abs(a.energy[-1] - problem.energy()) < 4e-13


def test_what_belongs_to_no_disc_is_at_rest():
    problem = uneven(65, Model("ring", "steered"))
    chain, z = problem.system.lanes, problem.start()
    own, work = do.enter(chain, Phase(z.hi, z.lo, z.pi)), do.workspace(chain)
    c, still, g = np.zeros_like(own.hi), np.zeros_like(own.hi), np.zeros_like(own.pi)
    do.settle(chain, work, own.hi, own.lo)
    do.basis(chain, work, still, c)
    do.pullback(chain, work, own, 0.0, still, c, own.pi, g)
    of_discs = np.zeros(g.shape[1], bool)
    of_discs[chain.order.places] = True
    assert not g[:, ~of_discs].any()
    assert g[:, of_discs].all()


def test_which_chains_run_in_lanes():
    """Not few discs, nor elements of degree 2, nor explicit methods."""
    few, many = (uneven(n, Model("springs", "steered")) for n in (MANY - 1, MANY + 1))
    quadratic = replace(many, chain=replace(many.chain, degree=2))
    assert few.system.lanes is None
    assert quadratic.system.lanes is None
    for name in ("midpoint", "suzuki4", "gauss6", "radau5"):
        assert isinstance(METHODS[name]().twin_of(many.system, many.system.parameters), Turning)
    assert METHODS["rk4"]().twin_of(many.system, many.system.parameters) is many.system.parameters
