"""Direct calls of kernels: when they are made, and that runs are the same."""

from dataclasses import replace
from typing import NamedTuple

import numba
import numpy as np

from discs import Gauss6, Midpoint, simulate
from discs.kernels import driver
from discs.kernels.direct import direct, machine_code
from tests.discs.conftest import Model, uneven


class Numbers(NamedTuple):
    """A method, or a chain."""

    array: np.ndarray
    number: float


ONE, OTHER = Numbers(np.ones(3), 2.0), Numbers(np.ones(3), 2.0)


def kernel():
    """A kernel as `discs.kernels.compiled.kernel` makes it, with what it was called with; called through `seen`."""
    made, seen = numba.njit(lambda method, chain, x: method.number * x), []

    def call(*arguments):
        seen.append(arguments)
        call.known[tuple(map(type, (*arguments, *arguments[0], *arguments[1])))] = made
        return made(*arguments)

    call.known = {}
    return call, seen


def test_machine_code_is_called_for_the_same_chain_and_a_method_with_the_same_arrays():
    (call, seen), known = kernel(), {}
    chain = Numbers(np.zeros(2), 0.0)
    assert [direct(known, call, ONE, chain)(ONE, chain, x) for x in (3.0, 4.0, 5)] == [6.0, 8.0, 10.0]
    assert len(seen) == 1
    other = ONE._replace(number=3.0)  # numbers are passed on
    assert direct(known, call, other, chain)(other, chain, 3.0) == 9.0
    assert len(seen) == 1
    for method, own in ((OTHER, chain), (ONE, Numbers(np.zeros(2), 0.0))):
        assert direct(known, call, method, own)(method, own, 3.0) == 6.0
    assert len(seen) == 3


def test_kernels_of_several_types_are_called_through_numba():
    (call, _), chain = kernel(), Numbers(np.zeros(2), 0.0)
    call(ONE, chain, 1.0)
    assert machine_code(call, (ONE, chain, 1.0)) is not None
    call(Numbers(np.ones((1, 3)), 2.0), chain, 1.0)  # an array of another kind
    assert machine_code(call, (ONE, chain, 1.0)) is None
    assert machine_code(lambda method, chain: 0, (ONE, chain)) is None


def test_runs_by_direct_calls_have_the_same_bits():
    problem = replace(uneven(9, Model("springs", "field"), seed=3), duration=0.2)
    for method in (Midpoint(), Midpoint(tolerance=1e-6), Gauss6(), "DOP853"):
        settled = {"method": method, "dt": 0.02, "frames": 4, "engine": "compiled", "progress": False}
        first, again, new = (simulate(each, **settled) for each in (problem, problem, replace(problem)))
        for run in (again, new):
            assert run.x.tobytes() == first.x.tobytes()
            assert run.omega.tobytes() == first.omega.tobytes()
    assert problem.system.known[driver.march][1] is problem.system.parameters
    assert not replace(problem).system.known
