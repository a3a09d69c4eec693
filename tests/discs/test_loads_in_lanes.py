"""Chains under loads in lanes against the plain engine: trajectories, energies, and the work of the loads."""

from dataclasses import replace

import numpy as np
import pytest

from discs import Midpoint, simulate
from discs.integrators import METHODS
from discs.kernels.lanes import Order
from discs.loads import Damping, Force, Motor, Slope, Spring, Torque, signals
from tests.conftest import SLAVED, STEERED, Model, models, uneven
from tests.discs.test_kernels import CLOSE
from tests.discs.test_lanes import apart

pytestmark = pytest.mark.slow

ROWS = "x", "y", "theta", "omega", "energy", "work", "dissipated"


def loaded(n, model):
    """A chain under every kind of load that acts on each disc by itself; two act on one disc."""
    problem = uneven(n, model)
    place = problem.chain.s[20]
    steady = Damping(rolling=0.3), Slope(0.1, 0.3), Spring(0.2, 0.1, 1.5, at=place)
    driven = Torque(0.2, signals.sine(1.0, 2.0)), Force(0.3, 0.1, signals.ramp(0, 1), at=place)
    turned = (Damping(turning=0.2), Torque(0.1, about="turn")) if model.law == "steered" else ()
    return replace(problem, loads=(*steady, *driven, *turned))


def agree(problem, method):
    a, b = (simulate(problem, method, 0.03, [0.06, 0.1], (), False, engine) for engine in ("compiled", "plain"))
    assert isinstance(method.twin_of(problem.system, problem.system.parameters).order, Order)
    assert a.stats["engine"] == "compiled"
    assert max(apart(a, b, ROWS)) < CLOSE, method
    assert np.abs(a.work).min(initial=1.0, where=a.t > 0) > 1e-6
    assert np.abs(a.dissipated).min(initial=1.0, where=a.t > 0) > 1e-6
    assert a.stats["step_error"] == pytest.approx(b.stats["step_error"], rel=1e-9)


@models(SLAVED + STEERED)
@pytest.mark.filterwarnings("ignore:.*too long for this motion", "ignore:.*energy is conserved, but", "ignore:.*did not converge")
def test_loads_in_lanes_and_the_plain_engine_agree(model, kernels_as_python):
    """Converged, and after one sweep, where the matrix matters."""
    for method in (Midpoint(), Midpoint(sweeps=1, tolerance=0), METHODS["gauss4"](sweeps=6, tolerance=0)):
        agree(loaded(65, model), method)


@models([Model("springs", "field"), Model("ring", "steered")])
def test_compiled(model):
    agree(loaded(67, model), Midpoint())


def test_loads_that_join_discs_go_disc_by_disc():
    for model in (Model("springs", "field"), Model("springs", "steered")):
        problem = uneven(65, model)
        at_start = problem.initial.omega[-1]
        for load in (Damping(torsion=0.1), Motor(float(at_start), at=problem.chain.s[-1])):
            assert replace(problem, loads=(load,)).system.lanes is None
        assert replace(problem, loads=(Damping(rolling=0.1),)).system.lanes is not None
