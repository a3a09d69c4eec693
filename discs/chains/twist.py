"""The paper's twisted rod as a chain of discs: the default scene."""

from typing import Any, TypedDict

import numpy as np

from discs import checks
from discs.arrays import Float
from discs.chains import elements
from discs.chains.chain import Chain, SteeredChain
from discs.chains.rolling import ROLLING
from discs.problem import Problem, State


class Parameters(TypedDict, total=False):
    """Parameters of the rod, any of them."""

    length: float
    density: float
    spin_inertia: float
    torsion_stiffness: float
    bending_stiffness: float
    radius: float


PAPER: Parameters = {
    "length": 4.0,
    "density": 1.0,
    "spin_inertia": 1.0,
    "torsion_stiffness": 0.8,
    "bending_stiffness": 0.7,
    "radius": 1.0,
}
STEERED = {"heading_inertia": 0.25, "stretch_stiffness": 10.0, "shear_stiffness": 10.0}
DURATION = 4.5
TURNS = 0.5


def twisted(s: Float, length: float, amplitude: float) -> tuple[Float, Float, Float, Float]:
    """x, y, theta, omega of a straight rod at rest, theta = -amplitude cos(pi s/length)."""
    return s, 0 * s, -amplitude * np.cos(np.pi * s / length), 0 * s


def untwisting_chain(
    n: int,
    rolling: str = "field",
    ends: str = "springs",
    duration: float = DURATION,
    twist: float = TURNS,
    degree: int = 1,
    **parameters: Any,
) -> Problem:
    """The paper's scene: n discs in a straight line, at rest, twisted by theta = -pi twist cos(pi s/length).

    Parameters
    ----------
    n : number of discs.
    rolling : a name in `discs.chains.rolling`, "field" or "unit", or "own" for discs with a heading of their own.
    ends : of a `Chain`; "springs" for own headings.
    duration : time to simulate.
    twist : turns between the two ends.
    degree : of a `SteeredChain`; 1 for other chains.
    parameters : of the chain; by default the paper's, with J = 0.25 and A = G = 10 for own headings.

    Raises
    ------
    ValueError : for an unknown parameter, or a value outside its range.
    """
    steered = checks.choice("rolling", rolling, (*ROLLING, "own")) == "own"
    standard = PAPER | STEERED if steered else PAPER
    for name in parameters:
        checks.choice("parameter of the chain" + (" (own headings)" if steered else ""), name, standard)
    given: dict[str, Any] = {"n": n, "ends": ends} | standard | parameters
    checks.choice("ends (a straight rod)", ends, ("springs",) if steered else ("springs", "consistent", "paper"))
    if not steered:
        elements.refuse(degree)
    chain: Chain | SteeredChain = SteeredChain(**given, degree=degree) if steered else Chain(**given, rolling=rolling)
    x, y, theta, omega = twisted(chain.s, chain.length, np.pi * checks.number("twist", twist))
    return Problem(chain, State(x, y, theta, omega, phi=0 * x if steered else None), duration)
