"""The compiled forms against their plain twins, and the linear algebra in them against NumPy."""

import math
import subprocess
import sys
import time

import numpy as np
import pytest

from discs import Chain, Midpoint, Problem, State, simulate
from discs.chains.twist import untwisting_chain
from discs.integrators import METHODS
from discs.integrators.composition import Composition
from discs.integrators.ivp import Reduced
from discs.kernels import banded, blocks, compiled, steered_links
from discs.running import ready
from tests.conftest import ALL, Model, longer, models, uneven

pytestmark = pytest.mark.slow

SIZES = [2, 3, 4, 5, 6, 7, 8, 9, 12, 31]
# rounding differs in the order of sums: a few units in the last place, times what an unconverged sweep of a stiff step leaves
CLOSE = 3e-12


def settings(name: str):
    """The method converged, and after one sweep, where the matrix it solves with matters."""
    cls = METHODS[name]
    if not hasattr(cls(), "sweeps") and not issubclass(cls, Composition):
        return [cls()]
    once = Midpoint(sweeps=1, tolerance=0) if issubclass(cls, Composition) else None
    return [cls(), cls(once) if once else cls(sweeps=1, tolerance=0)]


@models(ALL, [m for m in ALL if m.ends != "paper" and m != Model("consistent", "field")])
@pytest.mark.parametrize("name", [name for name, cls in METHODS.items() if not cls.adaptive])
@pytest.mark.filterwarnings("ignore:.*energy is conserved, but")  # one sweep of Gauss methods is not yet a step
def test_twins_agree(name, model):
    least = {"springs": 3, "paper": 3, "consistent": 4, "ring": 5}[model.ends] - (
        model.law == "steered" and model.ends == "springs"
    )
    for n in (n for n in SIZES if n >= least):
        problem = uneven(n, model)
        dt = 0.05 if METHODS[name].stability_limit == np.inf else 0.3 / n**2
        times = dt * np.array([0.0, 2.0, 3.5])
        for method in settings(name):
            a, b = (simulate(problem, method, dt, times, ("velocity",), False, engine) for engine in ("compiled", "plain"))
            for row in (*problem.system.rows, "omega", "x_rate", "energy"):
                np.testing.assert_allclose(getattr(a, row), getattr(b, row), atol=CLOSE, err_msg=f"n = {n}, {method}")
            for count in ("steps", "gradients", "solves", "unconverged"):
                assert abs(a.stats[count] - b.stats[count]) <= 0.1 * b.stats[count], (n, method, count)
            assert (a.stats["engine"], b.stats["engine"]) == ("compiled", "plain")


@models(ALL)
def test_reduced_equations_agree_and_stay_within_their_sparsity(model):
    problem = uneven(9, model)
    plain, compiled = Reduced(problem.system), Reduced(problem.system, problem.system.parameters)
    z = problem.start()
    y = plain.join(z.hi, z.pi)
    np.testing.assert_array_equal(plain.split(y).hi, z.hi)
    np.testing.assert_allclose(compiled(0.0, y), plain(0.0, y), atol=1e-11 * np.abs(plain(0.0, y)).max())
    eps = 1e-6
    jacobian = np.array([(plain(0.0, y + eps * e) - plain(0.0, y - eps * e)) / (2 * eps) for e in np.eye(y.size)]).T
    found, pattern = np.abs(jacobian) > 1e-4, plain.sparsity().toarray() > 0
    assert not (found & ~pattern).any()
    row, column = found.nonzero()
    if model.ends != "ring":
        assert np.abs(row - column).max() <= plain.width
    narrower = np.abs(np.subtract.outer(np.arange(9), np.arange(9))) < problem.system.reach
    width = y.size // 9
    assert model.ends == "ring" or (found & ~np.kron(narrower, np.ones((width, width), bool))).any()  # the reach is needed


def dense_banded(a, u, w, corner):
    n = a.size
    matrix = np.diag(a)
    for i in range(n):
        for j, value in ((i + 1, u[i]), (i + 2, w[i])):
            if j < n:
                matrix[i, j] = matrix[j, i] = value
    if n >= 4:
        matrix[0, 3] += corner[0]
        matrix[3, 0] += corner[0]
        matrix[n - 4, n - 1] += corner[1]
        matrix[n - 1, n - 4] += corner[1]
    return matrix


@pytest.mark.parametrize("kind", [float, complex])
def test_pentadiagonal_elimination(kind):
    def solve(a, u, w, corner, b, pair):
        banded.factor(a, u, w, corner)
        banded.substitute(a, u, w, corner, b)
        banded.substitute(a, u, w, corner, pair)

    rng = np.random.default_rng(2)

    def some(n):
        return (rng.standard_normal(n) + (1j * rng.standard_normal(n) if kind is complex else 0)).astype(kind)

    for n in [*range(1, 20), 101]:
        a, u, w, corner, b = some(n) + 12, some(n), some(n), some(2), some(n)
        corner[1] *= n > 4
        corner[0] *= n > 3
        pair = np.stack([b, some(n)])
        expected = np.linalg.solve(dense_banded(a, u, w, corner), pair.T).T
        solve(a, u, w, corner, b, pair)
        np.testing.assert_allclose(b, expected[0], atol=1e-14, err_msg=f"n = {n}")
        np.testing.assert_allclose(pair, expected, atol=1e-14, err_msg=f"n = {n}")


@pytest.mark.parametrize("kind", [float, complex])
def test_block_tridiagonal_elimination(kind):
    def solve(d, o, b):
        blocks.factor(d, o, d.shape[1])
        blocks.substitute(d, o, b, d.shape[1])

    rng = np.random.default_rng(3)

    def some(*shape):
        return (rng.standard_normal(shape) + (1j * rng.standard_normal(shape) if kind is complex else 0)).astype(kind)

    for n in [*range(1, 14), 50]:
        d, o, b = some(3, n) + np.array([[9], [0], [9]]), some(4, n), some(2, n)
        matrix = np.zeros((2 * n, 2 * n), kind)
        for i in range(n):
            matrix[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[d[0, i], d[1, i]], [d[1, i], d[2, i]]]
            if i + 1 < n:
                matrix[2 * i : 2 * i + 2, 2 * i + 2 : 2 * i + 4] = o[:, i].reshape(2, 2)
                matrix[2 * i + 2 : 2 * i + 4, 2 * i : 2 * i + 2] = o[:, i].reshape(2, 2).T
        expected = np.linalg.solve(matrix, b.T.ravel()).reshape(n, 2).T
        solve(d, o, b)
        np.testing.assert_allclose(b, expected, atol=1e-14, err_msg=f"n = {n}")


def test_sines_and_cosines():
    @compiled.jit
    def all_of(x, cos, sin):
        for i in range(x.size):
            cos[i], sin[i] = steered_links.turn(x[i])

    x = np.concatenate([np.linspace(-20, 20, 4001), np.array([0.0, 1e-300, 1e5, -1e6]), np.pi / 4 * np.arange(-40, 41)])
    cos, sin = np.empty_like(x), np.empty_like(x)
    all_of(x, cos, sin)
    np.testing.assert_allclose(cos, [math.cos(v) for v in x], rtol=0, atol=1.2e-16)
    np.testing.assert_allclose(sin, [math.sin(v) for v in x], rtol=0, atol=1.2e-16)


def test_runs_do_not_touch_the_problem():
    problem = uneven(9, Model("springs", "field"))
    before = [array.copy() for array in problem.start()]
    simulate(problem, "leapfrog", 0.001, progress=False)
    simulate(problem, "gauss6", 0.1, progress=False)
    for now, then in zip(problem.start(), before, strict=True):
        np.testing.assert_array_equal(now, then)


def test_more_discs_than_doubles_can_hold_are_warned_of():
    n = 20_001
    chain = Chain(n=n, length=0.2, density=1.0, spin_inertia=1.0, torsion_stiffness=1.0, bending_stiffness=1.0, radius=1.0)
    problem = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 0.1)
    with pytest.warns(UserWarning, match=r"20001 discs at dt = 0.05: each sweep .* take dt below"):
        simulate(problem, dt=0.05, frames=1, progress=False)


class Loading(Midpoint):
    """A midpoint method that takes as long as kernels that are read from a slow disc."""

    @property
    def parameters(self):
        time.sleep(0.3)
        return super().parameters


class Compiling(Midpoint):
    """A midpoint method that must be compiled."""

    @property
    def parameters(self):
        compiled.jit(lambda x: x + 1.0)(2.0)
        return super().parameters


@pytest.mark.parametrize("progress", [True, longer(False)])
@pytest.mark.parametrize("method", [Loading(), Compiling()])
def test_compiling_is_announced_once(method, progress, monkeypatch, capsys):
    problem = uneven(5, Model("springs", "field"))
    simulate(problem, dt=0.5, frames=1, progress=False)  # all others are compiled
    monkeypatch.setattr(ready, "PREPARED", set())
    monkeypatch.setattr(ready, "NOTICE", 0.01)
    for _ in range(2):
        simulate(problem, method, 0.5, 1, progress=progress, engine="compiled")
    said = capsys.readouterr().err.count("compiling 'midpoint', once on this machine")
    assert said == (progress and isinstance(method, Compiling))


def test_importing_does_not_compile():
    """numba is slow to import: it is taken only when something runs."""
    code = "import sys, discs; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_same_input_same_bits():
    """In this process and in another."""
    code = (
        "from discs import simulate; from discs.chains.twist import untwisting_chain;"
        "runs = [simulate(untwisting_chain(16, duration=0.5), method, 0.02, 3, engine=engine, progress=False)"
        " for method, engine in (('midpoint', 'compiled'), ('gauss6', 'plain'), ('Radau', 'plain'))];"
        "found = ''.join(run.x.tobytes().hex() + run.theta.tobytes().hex() for run in runs)"
    )
    here: dict[str, str] = {}
    exec(code, here)  # what the other process does too
    done = subprocess.run([sys.executable, "-c", code + "; print(found)"], capture_output=True, text=True, check=True)
    assert here["found"] == done.stdout.strip()
    assert len(here["found"]) > 3000


def test_engines_agree_to_some_ulps():
    """At t = 4.5, in units in the last place of the largest value: measured 6 for positions and angles and 45 for rates (the
    two-step scheme: 62 and 54). Over the run each step adds roundings of a unit or so, of either sign."""
    for rolling in ("field", "unit", "own"):
        problem = untwisting_chain(16, rolling)
        for method, dt, ulps in (("midpoint", 0.02, 16), ("gauss6", 0.05, 16), ("leapfrog", None, 128))[: 2 + (rolling == "field")]:
            a, b = (simulate(problem, method, dt, 2, progress=False, engine=engine) for engine in ("compiled", "plain"))
            for name in (*problem.system.rows, "omega"):
                one, other = getattr(a, name)[-1], getattr(b, name)[-1]
                apart = np.abs(one - other).max() / np.spacing(np.abs(other).max())
                assert apart <= (128 if name == "omega" else ulps), (rolling, method, name, apart)


def test_the_cache_of_a_kernel_does_not_depend_on_what_else_is_imported():
    """Forms of stubs that another kernel calls, as those of gradients, are not among the files of `march`."""
    from discs.kernels import driver, trace

    method, chain = METHODS["gauss6"]().parameters, uneven(9, Model("springs", "field")).system.parameters
    files = {path.name for path in compiled._files(driver.march.__wrapped__, type(method), type(chain))}
    assert {"driver.py", "slaved.py", "collocation.py"} <= files
    assert "trace.py" not in files
    assert "trace.py" in {path.name for path in compiled._files(trace.trace.__wrapped__, type(method), type(chain))}
