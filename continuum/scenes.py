"""Named scenes. Parameters of the rod are numbers or functions of s; those that are not given have the paper's values."""

from functools import partial
from typing import Any, TypedDict, Unpack

import numpy as np

from continuum.parameters import Parameter
from continuum.rod import Rod, Scene, SteeredRod
from discs import checks
from discs.arrays import Float
from discs.chains.twist import PAPER, twisted
from discs.loads import Rest

LAW = ("curvature", "stretch_stiffness")


class Parameters(TypedDict, total=False):
    """Parameters that every rod has, any of them: numbers or functions of s."""

    length: float
    density: Parameter
    spin_inertia: Parameter
    torsion_stiffness: Parameter
    bending_stiffness: Parameter
    radius: Parameter


class RodParameters(Parameters, total=False):
    """Parameters of a `Rod`, any of them."""

    curvature: str
    stretch_stiffness: Parameter


def _rod(given: RodParameters) -> Rod:
    for name in given:
        checks.choice("rod parameter", name, (*PAPER, *LAW))
    parameters: dict[str, Any] = {**PAPER, **given}
    return Rod(**parameters)


def untwisting_rod(rolling: str = "field", duration: float = 4.5, twist: float = 0.5, **parameters: Unpack[RodParameters]) -> Scene:
    """The paper's scene: a straight rod at rest, twisted by theta = -pi twist cos(pi s/length) and released.

    E(0) = beta pi**4 twist**2/(4 length), which is pi**4/80 for the paper's rod.

    Parameters
    ----------
    rolling : law of rolling, "field" (the paper's) or "unit".
    duration : time to simulate.
    twist : number of turns between the two ends, in the paper 1/2.
    parameters : of the `Rod`, numbers or functions of s; those that are not given have the paper's values.

    Raises
    ------
    ValueError : for an unknown parameter, or a value outside its range.
    """
    rod = _rod(parameters)
    turns = checks.number("twist", twist)
    initial = partial(twisted, length=rod.length, amplitude=np.pi * turns)
    return Scene(rod=rod, initial=initial, duration=duration, rolling=rolling, name="untwisting rod")


def steered_rod(
    stretch_stiffness: Parameter = 10.0,
    shear_stiffness: Parameter = 10.0,
    heading_inertia: Parameter = 0.25,
    duration: float = 4.5,
    twist: float = 0.5,
    mounting_angle: float = 0.0,
    **parameters: Unpack[Parameters],
) -> Scene:
    """The paper's twist for a rod whose sections have headings of their own, at rest with phi = 0; see `SteeredRod`.

    Parameters
    ----------
    stretch_stiffness, shear_stiffness, heading_inertia : A, G and J of the `SteeredRod`, numbers or functions of s.
    duration, twist, parameters : as for `untwisting_rod`; parameters are those that every rod has.
    mounting_angle : rad; the rod is then at rest with phi = mounting_angle, by `discs.loads.Rest`: at pi/2 a wheeled snake.

    Raises
    ------
    ValueError : for an unknown parameter, or a value outside its range.
    """
    for name in parameters:
        checks.choice("rod parameter", name, PAPER)
    given: dict[str, Any] = {**PAPER, **parameters}
    rod = SteeredRod(
        **given,
        stretch_stiffness=stretch_stiffness,
        shear_stiffness=shear_stiffness,
        heading_inertia=heading_inertia,
    )
    psi = checks.number("mounting_angle", mounting_angle)
    initial = partial(_steered, length=rod.length, amplitude=np.pi * checks.number("twist", twist), phi=psi)
    loads = (Rest(mounting_angle=psi),) if psi else ()
    return Scene(rod=rod, initial=initial, duration=duration, rolling="unit", name="steered rod", loads=loads)


def rolling_rod(
    rolling: str = "field",
    duration: float = 10.0,
    omega: float = 1.0,
    mode: int = 1,
    amplitude: float = 1e-6,
    **parameters: Unpack[RodParameters],
) -> Scene:
    """A straight rod, periodic up to a shift, that rolls sideways, with a small perturbation.

    The perturbation is the result of uneven rolling from the straight line: theta = amplitude cos(q s), y = R theta,
    q = 2 pi mode/length. How it grows is known: `continuum.dispersion`.

    Parameters
    ----------
    rolling, duration, parameters : as for `untwisting_rod`.
    omega : rate of roll, rad per time.
    mode : number of waves along the rod, at least 1.
    amplitude : of theta, rad.

    Raises
    ------
    ValueError : for an unknown parameter, or a value outside its range.
    """
    rod = _rod(parameters)
    q = 2 * np.pi * checks.whole("mode", mode, 1) / rod.length
    initial = partial(_rolling, q=q, rod=rod, omega=checks.number("omega", omega), amplitude=checks.number("amplitude", amplitude))
    return Scene(
        rod=rod,
        initial=initial,
        duration=duration,
        rolling=rolling,
        closed=True,
        shift=(rod.length, 0.0),
        name="rolling rod",
    )


def breathing_ring(rolling: str = "field", duration: float = 0.5, omega: float = 0.4, **parameters: Unpack[RodParameters]) -> Scene:
    """A circle of circumference `length` whose discs all roll at one rate, so that it stays a circle and breathes.

    Its motion is known in closed form under both laws: `continuum.exact`.

    Parameters
    ----------
    rolling, duration, parameters : as for `untwisting_rod`.
    omega : rate of roll, rad per time; towards the centre if it is positive.

    Raises
    ------
    ValueError : for an unknown parameter, or a value outside its range.
    """
    rod = _rod(parameters)
    initial = partial(_circle, radius=rod.length / (2 * np.pi), omega=checks.number("omega", omega))
    return Scene(rod=rod, initial=initial, duration=duration, rolling=rolling, closed=True, name="breathing ring")


def _steered(s: Float, length: float, amplitude: float, phi: float) -> tuple[Float, ...]:
    return (*twisted(s, length, amplitude), np.full_like(s, phi), 0 * s)


def _rolling(s: Float, q: float, rod: Rod, omega: float, amplitude: float) -> tuple[Float, Float, Float, Float]:
    theta = amplitude * np.cos(q * s)
    return s, rod.at(s).radius * theta, theta, np.full_like(s, omega)


def _circle(s: Float, radius: float, omega: float) -> tuple[Float, Float, Float, Float]:
    angle = s / radius
    return radius * np.cos(angle), radius * np.sin(angle), 0 * s, np.full_like(s, omega)


SCENES = {f.__name__: f for f in (untwisting_rod, steered_rod, rolling_rod, breathing_ring)}
