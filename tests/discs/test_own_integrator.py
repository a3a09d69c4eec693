"""A user's own integrators: plain ones run at once, and Gauss collocation of any number of stages."""

import sys
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from discs import integrators, simulate
from discs.integrators import Gauss, OneStep
from discs.skew import Phase, add
from tests.conftest import STEERED, Model, models, uneven


@dataclass(frozen=True)
class Heun(OneStep):
    """The explicit trapezoidal rule on the reduced equations: the smallest possible method."""

    name: ClassVar[str] = "heun"
    order: ClassVar[int] = 2
    preserves: ClassVar[str] = "the rolling constraint"
    reference: ClassVar[str] = "Heun, Z. Math. Phys. 45 (1900) 23"
    stability_limit: ClassVar[float] = 0.1

    def step(self, system, z, t, h, work):
        def rate(dq, dpi):
            shape = system.moved(system.shape(z.hi, z.lo), dq)
            c = system.basis(shape)
            return system.forward(c, z.pi + dpi), -system.pull(c, system.gradient(shape), t, z, dq, z.pi + dpi)

        work.gradients += 2
        v, a = rate(0 * z.hi, 0 * z.pi)
        w, b = rate(h * v, h * a)
        return Phase(*add(z.hi, z.lo, h / 2 * (v + w)), z.pi + h / 2 * (a + b))


@models([Model("consistent", "field"), *STEERED])
def test_a_method_without_a_compiled_form_runs_on_the_plain_engine(model):
    problem = uneven(6, model)
    exact = simulate(problem, "gauss8", 0.02, [0.2], progress=False)
    errors = []
    for steps in (200, 400, 800):
        run = simulate(problem, Heun(), 0.2 / steps, [0.2], progress=False)
        assert run.stats["engine"] == "plain"
        assert run.stats["method"] == "heun"
        errors.append(abs(run.theta - exact.theta).max())
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(2, abs=0.1)


def test_a_file_beside_the_others_is_found_by_the_name_of_its_method(tmp_path, monkeypatch):
    code = "from tests.discs.test_own_integrator import Heun\nclass Mine(Heun):\n    name = 'mine'\n"
    (tmp_path / "a_file_of_mine.py").write_text(code)
    monkeypatch.setattr(integrators, "__path__", [*integrators.__path__, str(tmp_path)])
    found = integrators._methods()
    module = sys.modules.pop("discs.integrators.a_file_of_mine")
    assert found == integrators.METHODS | {"heun": Heun, "mine": module.Mine}


class Gauss10(Gauss):
    name: ClassVar[str] = "gauss10"
    order: ClassVar[int] = 10
    stages: ClassVar[int] = 5


class Gauss12(Gauss):
    name: ClassVar[str] = "gauss12"
    order: ClassVar[int] = 12
    stages: ClassVar[int] = 6


@models([Model("consistent", "unit"), Model("ring", "steered")])
@pytest.mark.parametrize("method", [Gauss10(), Gauss12()])
def test_collocation_of_more_stages_is_right_on_both_engines(method, model):
    problem = uneven(6, model)
    exact = simulate(problem, "gauss8", 0.01, [0.3], progress=False)
    for engine in ("compiled", "plain"):
        run = simulate(problem, method, 0.1, [0.3], progress=False, engine=engine)
        assert run.stats["engine"] == engine
        assert run.stats["unconverged"] == 0
        np.testing.assert_allclose(run.theta, exact.theta, rtol=0, atol=1e-9)
        np.testing.assert_allclose(run.x, exact.x, rtol=0, atol=1e-9)
