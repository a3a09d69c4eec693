"""Chains and problems that the tests share: unequal, non-unit parameters, no symmetry."""

import numpy as np
import pytest

from discs import Chain, Problem, State

BENDS = {"springs": -2, "paper": -2, "consistent": 0, "ring": 0}


def uneven(n: int, ends: str, rolling: str, seed: int = 1, *, equal: bool = False) -> Problem:
    """A bent, twisted, rolling chain; every disc and spring different unless `equal`."""
    rng = np.random.default_rng(seed)
    links = n - (ends != "ring")

    def around(mean: float, size: int):
        return mean if equal else mean * rng.uniform(0.7, 1.4, size)

    chain = Chain(
        n=n,
        length=3.1,
        density=around(1.3, n),
        spin_inertia=around(0.6, n),
        torsion_stiffness=around(0.9, links),
        bending_stiffness=around(0.8, n + BENDS[ends]),
        radius=around(0.7, n),
        rolling=rolling,
        ends=ends,
    )
    s = chain.s / chain.length
    if ends == "ring":
        turn = 2 * np.pi * s
        a = chain.length / (2 * np.pi)
        x, y = a * (np.cos(turn) + 0.1 * np.cos(2 * turn)), a * (np.sin(turn) - 0.2 * np.cos(turn))
        theta, omega = 0.3 * np.sin(turn) + 0.1 * np.cos(2 * turn), 0.4 + 0.2 * np.cos(turn)
    else:
        x, y = chain.length * (s + 0.03 * s**2), chain.length * 0.1 * s**2 * (1 - 0.4 * s)
        theta, omega = 0.8 * s**2 - 0.5 * s**3, 0.5 - 0.7 * s
    return Problem(chain, State(x, y, theta, omega), 1.0)


@pytest.fixture(params=["springs", "consistent", "paper", "ring"])
def ends(request):
    return request.param


@pytest.fixture(params=["field", "unit"])
def rolling(request):
    return request.param
