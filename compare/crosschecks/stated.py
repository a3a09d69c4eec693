r"""The problems of the cross-checks, stated in scalars that the symbols of any program can stand for.

Nothing of `discs` is used but in `Stated.problem`. A disc i has mass m_i = rho_i w_i, spin inertia alpha_i w_i and, with a
heading of its own, heading inertia J_i w_i, where w = k inside and k/2 at the two ends. With d_j the differences over link j,

    line :  V = sum_j beta_j/(2k) d_j theta^2 + sum_i K_i/(2k^3) |r_{i+1} - 2 r_i + r_{i-1}|^2,
            r'_i = (r_{i+1} - r_{i-1})/(2k), at an end (-3 r_0 + 4 r_1 - r_2)/(2k) and its mirror image;
    own :   V = sum_j [beta_j/(2k) d_j theta^2 + K_j/(2k) d_j phi^2 + A_j k/2 (Gamma_1 - 1)^2 + G_j k/2 Gamma_2^2],
            Gamma = Rot(-(phi_j + phi_{j+1})/2) (r_{j+1} - r_j)/k,

and rolling is r. = e theta. with e = R J r' (field law), R J r'/|r'| (unit law), R (-sin phi, cos phi) (own headings).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from discs import Chain, Problem, State, SteeredChain
from discs.arrays import Float

Scalars = Sequence[Any]
Rows = Sequence[Scalars]  # x, y, theta(, phi), each with a scalar for every disc


@dataclass(frozen=True, eq=False)
class Stated:
    """A chain with free ends: every disc and link has parameters of its own.

    Attributes
    ----------
    law : "field", "unit" or "own".
    n : number of discs. length : of the rod. duration : time to run.
    """

    law: str
    n: int
    length: float = 3.1
    duration: float = 10.0
    parameters: dict[str, Float] = field(init=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(24)
        links, bends = self.n - 1, self.n - 1 if self.law == "own" else self.n - 2

        def around(mean: float, size: int) -> Float:
            return mean * rng.uniform(0.7, 1.4, size)

        given = {
            "density": around(1.3, self.n),
            "spin_inertia": around(0.6, self.n),
            "radius": around(0.7, self.n),
            "torsion_stiffness": around(0.9, links),
            "bending_stiffness": around(0.8, bends),
        }
        if self.law == "own":
            given |= {
                "heading_inertia": around(0.3, self.n),
                "stretch_stiffness": around(9.0, links),
                "shear_stiffness": around(7.0, links),
            }
        object.__setattr__(self, "parameters", given)

    @property
    def name(self) -> str:
        """As in the table."""
        laws = {"field": "field law", "unit": "unit law", "own": "own headings"}
        return f"{self.n} discs, {laws[self.law]}, t = {self.duration:g}"

    @property
    def rows(self) -> tuple[str, ...]:
        """The coordinates of a disc."""
        return ("x", "y", "theta", "phi") if self.law == "own" else ("x", "y", "theta")

    @property
    def k(self) -> float:
        """Spacing."""
        return self.length / (self.n - 1)

    @cached_property
    def inertia(self) -> Float:
        """Inertia of each coordinate, (rows, n)."""
        w = np.full(self.n, self.k)
        w[[0, -1]] /= 2
        names = ["density", "density", "spin_inertia", *(["heading_inertia"] if self.law == "own" else [])]
        return np.array([w * self.parameters[name] for name in names])

    @cached_property
    def q0(self) -> Float:
        """Coordinates at the start, (rows, n): a bent, twisted line."""
        s = np.linspace(0, 1, self.n)
        rows = [self.length * (s + 0.03 * s**2), 0.1 * self.length * s**2 * (1 - 0.4 * s), 0.8 * s**2 - 0.5 * s**3]
        return np.array([*rows, *([0.3 * s**2 - 0.1 * s] if self.law == "own" else [])])

    @cached_property
    def u0(self) -> Float:
        """theta.(, phi.) at the start, (1 or 2, n)."""
        s = np.linspace(0, 1, self.n)
        return np.array([0.5 - 0.7 * s, *([0.3 - 0.4 * s] if self.law == "own" else [])])

    def potential(self, q: Rows, m: Any) -> Any:
        """V. m : module or namespace with sin, cos and sqrt for these scalars."""
        k, last = self.k, self.n - 1
        p = {name: list(map(float, values)) for name, values in self.parameters.items()}
        x, y, theta = q[:3]
        v = sum(p["torsion_stiffness"][j] / (2 * k) * (theta[j + 1] - theta[j]) ** 2 for j in range(last))
        if self.law != "own":
            for i in range(1, last):
                bx, by = x[i + 1] - 2 * x[i] + x[i - 1], y[i + 1] - 2 * y[i] + y[i - 1]
                v = v + p["bending_stiffness"][i - 1] / (2 * k**3) * (bx**2 + by**2)
            return v
        phi = q[3]
        for j in range(last):
            c, s = m.cos((phi[j] + phi[j + 1]) / 2), m.sin((phi[j] + phi[j + 1]) / 2)
            dx, dy = x[j + 1] - x[j], y[j + 1] - y[j]
            v = v + p["bending_stiffness"][j] / (2 * k) * (phi[j + 1] - phi[j]) ** 2
            v = v + p["stretch_stiffness"][j] * k / 2 * ((c * dx + s * dy) / k - 1) ** 2
            v = v + p["shear_stiffness"][j] * k / 2 * ((c * dy - s * dx) / k) ** 2
        return v

    def arms(self, q: Rows, m: Any) -> tuple[list[Any], list[Any]]:
        """e of every disc, by components. m : as in `potential`."""
        radius = list(map(float, self.parameters["radius"]))
        if self.law == "own":
            return (
                [-r * m.sin(phi) for r, phi in zip(radius, q[3], strict=True)],
                [r * m.cos(phi) for r, phi in zip(radius, q[3], strict=True)],
            )
        dx, dy = self._slopes(q[0]), self._slopes(q[1])
        size = [m.sqrt(a**2 + b**2) if self.law == "unit" else 1.0 for a, b in zip(dx, dy, strict=True)]
        return (
            [-r * b / s for r, b, s in zip(radius, dy, size, strict=True)],
            [r * a / s for r, a, s in zip(radius, dx, size, strict=True)],
        )

    def _slopes(self, x: Scalars) -> list[Any]:
        inside = [x[i + 1] - x[i - 1] for i in range(1, self.n - 1)]
        ends = [-3 * x[0] + 4 * x[1] - x[2], 3 * x[-1] - 4 * x[-2] + x[-3]]
        return [d / (2 * self.k) for d in (ends[0], *inside, ends[1])]

    def problem(self) -> Problem:
        """The same in the words of `discs`."""
        chain: Any = SteeredChain if self.law == "own" else Chain
        law = {} if self.law == "own" else {"rolling": self.law}
        start = dict(zip(self.rows, self.q0, strict=True)) | dict(zip(("omega", "phi_rate"), self.u0, strict=False))
        return Problem(chain(n=self.n, length=self.length, **law, **self.parameters), State(**start), self.duration)
