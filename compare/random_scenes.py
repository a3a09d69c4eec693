"""Random scenes with fixed seeds, used for no tuning: `random_scene(seed, index)`.

The kinds alternate, so any range of indices has all of them. Free ends require x'y'' = y'x'' and beta theta' = K e.r''' (`Rod`) or
phi' = 0 and e.n + beta theta' = 0 (`SteeredRod`). The fields here satisfy these conditions, and those that follow for omega: twists
and rates of roll are sums of cos(m pi s/l), and lines have a curvature with a factor sin(pi s/l)^4. The kind "bent end" violates
them on purpose. Its curvature is not zero at the ends, which therefore send out ever shorter waves, and it may be refused.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from continuum import Rod, Scene, SteeredRod
from discs import checks
from discs.arrays import Float

KINDS = ("twist", "bump", "bent", "rolling", "stretched", "ring", "periodic", "own", "own ring", "bent end")
DEGREE = 255  # of the polynomials that integrate lines: their error is rounding, as there are at most eight waves
PARAMETERS = {"density": 1.0, "spin_inertia": 1.0, "torsion_stiffness": 0.8, "bending_stiffness": 0.7, "radius": 1.0}
FACTOR = 2.0  # largest ratio of a parameter to the paper's, and of the paper's to it

Function = Callable[[Float], Float]
Line = Callable[[Float], tuple[Float, Float, Float]]  # x, y and the direction phi at places s


class Drawn(NamedTuple):
    """A random scene: its kind, a description in words, and a number of discs for its chain."""

    scene: Scene
    kind: str
    words: str
    n: int


def random_scene(seed: int, index: int) -> Drawn:
    """Scene number `index` of a seed; the same on every machine.

    The length is 2 to 8, other parameters are 1/2 to 2 times the paper's, all different. Durations are 0.5 to 60, log-uniform. Both
    laws of rolling occur, twists of 0.1 to 2 rad, and bumps of width l/200 to l/4.
    """
    rng = np.random.default_rng([checks.whole("seed", seed, 0), checks.whole("index", index, 0)])
    kind = KINDS[index % len(KINDS)]
    length = 4.0 * _factor(rng)
    parameters: dict[str, Any] = {name: value * _factor(rng) for name, value in PARAMETERS.items()}
    duration, law = float(between(rng, 0.5, 60.0)), str(rng.choice(["field", "unit"]))
    closed, steered = kind in ("ring", "periodic", "own ring"), kind.startswith("own")
    theta = series(rng, length, closed, between(rng, 0.1, 2.0))
    rate = series(rng, length, closed, between(rng, 0.05, 1.0)) if kind in ("rolling", "own", "ring") else _zero
    words = [f"twist {np.ptp(theta(np.linspace(0, length, 999))):.2g} rad"]
    if kind == "bump" or (kind == "periodic" and rng.random() < 0.5):
        width, place, height = between(rng, length / 200, length / 4), rng.uniform(0.2, 0.8) * length, between(rng, 0.1, 2.0)
        width = min(width, 0.1 * length if closed else width)  # its tails stay clear of the seam
        theta = _bump(height, place, width)
        words = [f"bump {height:.2g} rad, width l/{length / width:.0f}"]
    line: Line = _straight
    shift = (0.0, 0.0)
    if kind in ("bent", "bent end", "stretched", "own"):
        bend = between(rng, 0.2, 1.5) if kind != "stretched" else 0.0
        stretch = rng.uniform(0.05, 0.4) * rng.choice([-1.0, 1.0]) if kind == "stretched" else 0.0
        line = _line(rng, length, bend, stretch, ends=kind == "bent end")
        words.append(f"bent by {bend:.2g} rad" if bend else f"|r'| up to {1 + abs(stretch):.2g}")
    elif kind in ("ring", "own ring"):
        line = _ring(rng, length, between(rng, 0.01, 0.15))
    elif kind == "periodic":
        line, shift = _wavy(rng, length, between(rng, 0.005, 0.05)), (length, 0.0)
    if steered:
        stretch, shear, inertia = between(rng, 3.0, 100.0), between(rng, 3.0, 100.0), between(rng, 0.05, 0.5)
        parameters |= {"stretch_stiffness": stretch, "shear_stiffness": shear, "heading_inertia": inertia}
        law, words = "unit", [*words, f"A = {stretch:.3g}, G = {shear:.3g}, J = {inertia:.2g}"]
    rod = (SteeredRod if steered else Rod)(length=length, **parameters)
    scene = Scene(
        rod=rod,
        initial=Initial(line, theta, rate, steered),
        duration=duration,
        rolling=law,
        closed=closed,
        shift=shift,
        turns=int(kind == "own ring"),
        name=f"random scene {seed}:{index}",
    )
    return Drawn(scene, kind, ", ".join(words), int(rng.integers(9, 130)))


class Initial:
    """The fields at places s: x, y, theta, omega; for a steered rod also phi, along the line, and its rate, zero."""

    def __init__(self, line: Line, theta: Function, rate: Function, steered: bool):
        self.line, self.theta, self.rate, self.steered = line, theta, rate, steered

    def __call__(self, s: Float) -> tuple[Float, ...]:
        x, y, phi = self.line(s)
        fields = x, y, self.theta(s), self.rate(s)
        return (*fields, phi, 0 * s) if self.steered else fields


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """A log-uniform random number."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _factor(rng: np.random.Generator) -> float:
    return between(rng, 1 / FACTOR, FACTOR)


def _zero(s: Float) -> Float:
    return 0 * s


def series(rng: np.random.Generator, length: float, closed: bool, size: float) -> Function:
    """A sum of up to eight waves with coefficients that decay like exp(-m/2); `size` is the root of the sum of their squares."""
    m = np.arange(0 if closed else 1, 9)
    a = rng.standard_normal(m.size) * np.exp(-m / 2)
    b = rng.standard_normal(m.size) * np.exp(-m / 2) * closed
    a, b = (size * c / np.sqrt(np.sum(a**2 + b**2)) for c in (a, b))
    q = m * np.pi * (2 if closed else 1) / length
    return lambda s: np.cos(np.multiply.outer(s, q)) @ a + np.sin(np.multiply.outer(s, q)) @ b


def _bump(height: float, place: float, width: float) -> Function:
    return lambda s: height * np.exp(-(((s - place) / width) ** 2))


def _straight(s: Float) -> tuple[Float, Float, Float]:
    return s, 0 * s, 0 * s


def _line(rng: np.random.Generator, length: float, bend: float, stretch: float, ends: bool) -> Line:
    """A line with r' = (1 + stretch sin(pi s/l)^4) (cos phi, sin phi), where phi turns smoothly by at most `bend`."""
    waves, domain = series(rng, length, False, 1.0), [0.0, length]

    def curvature(s: Float) -> Float:
        return (waves(s) + 0.7) * (1.0 if ends else np.sin(np.pi * s / length) ** 4)

    phi = Chebyshev.interpolate(curvature, DEGREE, domain).integ(lbnd=0)
    scale = bend / np.abs(phi(np.linspace(0, length, 999))).max()

    def rate(f: Function) -> Chebyshev:
        g = lambda s: (1 + stretch * np.sin(np.pi * s / length) ** 4) * f(scale * phi(s))  # noqa: E731
        return Chebyshev.interpolate(g, DEGREE, domain).integ(lbnd=0)

    x, y = rate(np.cos), rate(np.sin)
    return lambda s: (x(s), y(s), scale * phi(s))


def _ring(rng: np.random.Generator, length: float, size: float) -> Line:
    """A circle of circumference `length`, its radius perturbed by `size` (relative) in waves 2 to 4; phi along the tangent."""
    a, b = rng.standard_normal((2, 3)) * size / np.arange(2, 5)
    m, q = np.arange(2, 5), 2 * np.pi / length

    def line(s: Float) -> tuple[Float, Float, Float]:
        waves = np.multiply.outer(q * s, m)
        radius = (1 + np.cos(waves) @ a + np.sin(waves) @ b) / q
        rate = (-np.sin(waves) @ (m * a) + np.cos(waves) @ (m * b)) / q
        return radius * np.cos(q * s), radius * np.sin(q * s), q * s + np.pi / 2 - np.arctan2(rate, radius)

    return line


def _wavy(rng: np.random.Generator, length: float, size: float) -> Line:
    """A straight line with waves of `size` times the length, across and along."""
    along, across = series(rng, length, True, 0.3 * size * length), series(rng, length, True, size * length)
    return lambda s: (s + along(s), across(s), 0 * s)
