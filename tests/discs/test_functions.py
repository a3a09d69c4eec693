"""Forces and potentials of one's own as functions that numba compiles: on the compiled engine as on the plain one."""

from dataclasses import replace

import numba
import numpy as np
import pytest

from discs import Gauss4, Midpoint, Radau3, simulate
from discs.integrators import METHODS
from discs.kernels import compiled
from discs.loads import Custom, Damping, Motor, Potential, Torque, signals
from tests.conftest import longer, models, uneven
from tests.discs.test_loads import KINDS

pytestmark = pytest.mark.slow  # numba compiles functions


@numba.njit
def wind(t, q, v):
    f = np.zeros_like(q)
    f[0] = 0.3 * np.sin(2 * t) - 0.2 * np.abs(v[0]) * v[0]
    f[2] = 0.1 * q[1]
    return f


@numba.njit
def power(t, q, v):
    """Not that of the wind: it is told from the default."""
    return 0.5 * np.sum(wind(t, q, v) * v, axis=0)


@numba.njit
def hills(x, y):
    return 0.2 * np.cos(2 * x) * np.sin(y)


@numba.njit
def slopes(x, y):
    return -0.4 * np.sin(2 * x) * np.sin(y), 0.2 * np.cos(2 * x) * np.cos(y)


GUST, HILLS = Custom(wind), Potential(hills, slopes)


def both(problem, method, dt=0.02):
    found = [simulate(problem, method, dt, [0.13, 0.3], progress=False, engine=e) for e in ("compiled", "plain")]
    assert [run.stats["engine"] for run in found] == ["compiled", "plain"]
    for name in (*problem.system.rows, "omega", "energy", "work", "dissipated"):
        one, other = (getattr(run, name) for run in found)
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-13, err_msg=f"{method}, {name}")
    return found[0]


MANY = HILLS, Damping(0.1), GUST, Torque(0.2, signals.sine(1.0, 2.0))


@models(KINDS, KINDS[:1])
def test_the_same_trajectory_on_both_engines(model, kernels_as_python):
    problem = replace(uneven(6, model), duration=0.3)
    loaded = replace(problem, loads=MANY)
    for method in (Midpoint(), Midpoint(sweeps=2, tolerance=0), Gauss4(sweeps=2, tolerance=0), Radau3()):
        assert abs(both(loaded, method).work[-1]) > 1e-3
    if model == KINDS[0]:
        both(loaded, "rk4", 0.005)
        both(loaded, "DOP853")
    motor = Motor(float(np.broadcast_to(problem.initial.omega, 6)[2]), problem.chain.s[2])
    both(replace(problem, loads=(motor, *MANY)), "midpoint")


def test_compiled_code_calls_functions_by_their_address():
    """Forces and powers of sums of loads, in compiled code of one type for all of them."""

    @compiled.jit
    def of(load, t, q, v):
        return load.force(load.w, t, q, v), load.power(load.w, t, q, v)

    rng, problem = np.random.default_rng(1), uneven(6, KINDS[0])
    q, v = rng.standard_normal((3, 6)), rng.standard_normal((3, 6))
    for loads in ((HILLS, GUST), (Custom(wind, power, per_length=True),)):
        load = replace(problem, loads=loads).system.load
        force, work = of(load.parameters, 0.7, q, v)
        np.testing.assert_allclose(force, load.force(0.7, q, v), rtol=1e-13)
        assert work == pytest.approx(load.power(0.7, q, v)[0], rel=1e-13)
    assert len(of.signatures) == 1


@pytest.mark.long
@pytest.mark.parametrize(("model", "method"), [(KINDS[0], "gauss6"), (KINDS[4], "midpoint")])
def test_kernels_with_functions_compile(model, method):
    both(replace(uneven(6, model), duration=0.3, loads=MANY), METHODS[method]())
    conservative = replace(uneven(6, KINDS[0]), duration=0.3, loads=(HILLS,))
    assert not both(conservative, "leapfrog", 0.002).work.any()


@numba.njit
def raising(t, q, v):
    if t > 0.3:
        raise ValueError("too late")
    return 0.1 * v


@numba.njit
def not_finite(t, q, v):
    return 0.1 * v if t < 0.3 else np.nan * v


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (raising, "force of Custom raised ValueError: too late at t = 0.3"),
        longer(
            not_finite, r"Custom: the force must be finite numbers of shape \(3, 6\); got values that are not finite at t = 0.3"
        ),
    ],
)
def test_a_bad_force_is_named_with_its_time_as_on_the_plain_engine(force, words, kernels_as_python):
    problem = replace(uneven(6, KINDS[0]), loads=(Custom(force),))
    assert problem.system.parameters is not None
    for method, frames in (("midpoint", 2), ("midpoint", [0.31]), ("DOP853", 2)):
        with pytest.raises(ValueError, match=words):
            simulate(problem, method, 0.05, frames, progress=False)


def test_other_functions_take_the_plain_engine():
    """Those of Python, and those that numba does not compile to what kernels call."""
    problem = uneven(6, KINDS[0])
    pair = numba.njit(lambda x, y: np.stack((0.2 * x, 0.2 * y)))
    for load in (Custom(wind.py_func), Custom(wind, power.py_func), Custom(numba.njit(lambda t, q, v: (q[0], q[1], q[2])))):
        assert replace(problem, loads=(load, HILLS)).system.parameters is None
    stats = simulate(replace(problem, loads=(Custom(wind.py_func),)), "midpoint", 0.1, 2, progress=False).stats
    assert stats["engine"] == "plain"
    assert stats["plain_because"] == "the functions of Custom are not compiled by numba, as with numba.njit"
    assert replace(problem, loads=(Potential(hills, pair),)).system.parameters is not None  # an array of two rows is a pair, too
