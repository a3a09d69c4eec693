"""Chains and problems that the tests share: unequal, non-unit parameters, no symmetry."""

import os
import signal
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from continuum import solve, untwisting_rod
from discs import Chain, Problem, State, SteeredChain
from discs.integrators import METHODS
from discs.kernels import adjoint, dop853, driver, tangent, trace
from discs.kernels.__main__ import sharing
from discs.kernels.background import ENGINE, USUAL

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in a background job: tests send Ctrl-C, to themselves and to children
    signal.signal(signal.SIGINT, signal.default_int_handler)


os.environ[ENGINE] = USUAL[0] = "ready"  # of command lines, too: what `make tested` has not compiled runs plain


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """The lessons first, which take long, as do the tests of `compare` that follow: so no worker waits for another at the end.

    Tests of compiled pairs of a chain and a method that the short suite does not compile are long.
    """
    items.sort(key=lambda item: item.path.stem != "test_notebooks")
    for item in items:
        given = item.callspec.params if hasattr(item, "callspec") else {}
        model, name = given.get("model"), given.get("name", given.get("method"))
        if not isinstance(model, Model) or name not in METHODS or given.get("engine") == "plain":
            continue
        law = "own" if model.law == "steered" else model.law
        if "kernels_as_python" not in item.fixturenames and name not in ahead(law):
            item.add_marker(pytest.mark.long)


@cache
def ahead(law: str) -> set[str]:
    """The methods whose kernels for chains of this law the short suite compiles."""
    return {method.name for methods in sharing(law, tested=True) for method in methods}


class Model(NamedTuple):
    """Kind of ends, and of law: "field", "unit", "true" (unit law, true curvature, stretch) or "steered" (own headings)."""

    ends: str
    law: str


SLAVED = [Model(ends, law) for ends in ("springs", "consistent", "paper", "ring") for law in ("field", "unit")]
TRUE = [Model(ends, "true") for ends in ("springs", "consistent", "ring")]
STEERED = [Model(ends, "steered") for ends in ("springs", "ring")]
ALL = SLAVED + TRUE + STEERED


def longer(*values):
    """Parameters of a test for the long suite only."""
    return pytest.param(*values, marks=pytest.mark.long)


def models(kinds: list[Model], short: list[Model] | None = None):
    """Each model; if `short` is given, those not in it in the long suite only."""
    marked = [m if short is None or m in short else longer(m) for m in kinds]
    return pytest.mark.parametrize("model", marked, ids=[f"{m.law}-{m.ends}" for m in kinds])


def models_and_engines(kinds: list[Model], plain: list[Model] | None = None, short: list[Model] | None = None):
    """Each model with the compiled twin, and with the plain one, which may be tried on fewer or on more.

    If `short` is given, the plain one runs with other models in the long suite only.
    """
    pairs = [(m, "compiled") for m in kinds]
    every = dict.fromkeys([*kinds, *(plain or [])])
    pairs += [(m, "plain") for m in every if plain is None or m in plain]
    marked = [pair if short is None or pair[1] == "compiled" or pair[0] in short else longer(*pair) for pair in pairs]
    return pytest.mark.parametrize(("model", "engine"), marked, ids=[f"{m.law}-{m.ends}-{engine}" for m, engine in pairs])


def uneven(n: int, model: Model, seed: int = 1, *, equal: bool = False) -> Problem:
    """A bent, twisted, rolling chain; every disc and spring different unless `equal`."""
    rng = np.random.default_rng(seed)
    ends, law = model
    links = n - (ends != "ring")
    bends = n if ends == "ring" or (ends == "consistent" and law != "true") else n - 2

    def around(mean: float, size: int):
        return mean if equal else mean * rng.uniform(0.7, 1.4, size)

    common = {
        "n": n,
        "length": 3.1,
        "density": around(1.3, n),
        "spin_inertia": around(0.6, n),
        "torsion_stiffness": around(0.9, links),
        "bending_stiffness": around(0.8, links if law == "steered" else bends),
        "radius": around(0.7, n),
        "ends": ends,
    }
    s = np.arange(n) / (n if ends == "ring" else n - 1)
    if ends == "ring":
        turn = 2 * np.pi * s
        a = 3.1 / (2 * np.pi)
        x, y = a * (np.cos(turn) + 0.1 * np.cos(2 * turn)), a * (np.sin(turn) - 0.2 * np.cos(turn))
        theta, omega = 0.3 * np.sin(turn) + 0.1 * np.cos(2 * turn), 0.4 + 0.2 * np.cos(turn)
        heading, turns = turn + np.pi / 2 + 0.2 * np.sin(turn), 1
    else:
        x, y = 3.1 * (s + 0.03 * s**2), 3.1 * 0.1 * s**2 * (1 - 0.4 * s)
        theta, omega = 0.8 * s**2 - 0.5 * s**3, 0.5 - 0.7 * s
        heading, turns = 0.3 * s**2 - 0.1 * s, 0
    chain: Chain | SteeredChain
    if law == "steered":
        beams = {"stretch_stiffness": around(9.0, links), "shear_stiffness": around(7.0, links)}
        chain = SteeredChain(**common, **beams, heading_inertia=around(0.3, n), turns=turns)
        return Problem(chain, State(x, y, theta, omega, heading, 0.3 - 0.4 * s if ends != "ring" else 0.1), 1.0)
    if law == "true":
        chain = Chain(**common, rolling="unit", curvature="true", stretch_stiffness=around(5.0, links))
    else:
        chain = Chain(**common, rolling=law)
    return Problem(chain, State(x, y, theta, omega), 1.0)


@pytest.fixture
def kernels_as_python(monkeypatch):
    """Kernels run as plain Python, to the arithmetic's last bits but one: what no user has compiled ahead takes 20 s to compile."""
    for name in ("march", "look", "observe", "reduced"):
        monkeypatch.setattr(driver, name, getattr(driver, name).__wrapped__)
    monkeypatch.setattr(dop853, "run", dop853.run.__wrapped__)
    for module, names in ((adjoint, ("back",)), (tangent, ("tangent",)), (trace, ("trace",))):
        for name in names:
            monkeypatch.setattr(module, name, getattr(module, name).__wrapped__)


@pytest.fixture(scope="session")
def paper_field():
    """The field of the paper's scene to 1e-5, at t = 0, 2.25 and 4.5."""
    return solve(untwisting_rod(), 1e-5, frames=3, progress=False)


@pytest.fixture(params=["springs", "consistent", "paper", "ring"])
def ends(request):
    return request.param


@pytest.fixture(params=["field", "unit"])
def rolling(request):
    return request.param
