"""The scenes of the command line as chains of discs: the paper's twisted rod, and a rolling circle."""

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
    checks.choice("ends (a straight rod)", ends, ("springs",) if steered else ("springs", "consistent", "paper"))
    chain = _chain(n, rolling, ends, degree, parameters)
    x, y, theta, omega = twisted(chain.s, chain.length, np.pi * checks.number("twist", twist))
    return Problem(chain, State(x, y, theta, omega, phi=0 * x if steered else None), duration)


def circle_chain(
    n: int, omega: float, rolling: str = "field", duration: float = DURATION, degree: int = 1, **parameters: Any
) -> Problem:
    """A closed circle of n discs that all roll at the rate `omega`, rad per time, towards the centre if it is positive.

    With a = length/(2 pi) and phi the direction of the line, r = a (cos(s/a), sin(s/a)), phi = s/a + pi/2, and the contact points
    move at omega R towards the centre. Other parameters and errors as for `untwisting_chain`.
    """
    chain = _chain(n, rolling, "ring", degree, parameters)
    a, angle = chain.length / (2 * np.pi), 2 * np.pi * chain.s / chain.length
    phi = angle + np.pi / 2 if isinstance(chain, SteeredChain) else None
    rate = checks.number("omega", omega)
    return Problem(chain, State(a * np.cos(angle), a * np.sin(angle), 0 * angle, 0 * angle + rate, phi=phi), duration)


def _chain(n: int, rolling: str, ends: str, degree: int, parameters: dict[str, Any]) -> Chain | SteeredChain:
    """A chain with the paper's parameters, but for those given."""
    steered = checks.choice("rolling", rolling, (*ROLLING, "own")) == "own"
    standard = PAPER | STEERED if steered else PAPER
    for name in parameters:
        checks.choice("parameter of the chain" + (" (own headings)" if steered else ""), name, standard)
    given: dict[str, Any] = {"n": n, "ends": ends} | standard | parameters
    if steered:
        return SteeredChain(**given, degree=degree, turns=int(ends == "ring"))
    elements.refuse(degree)
    return Chain(**given, rolling=rolling)
