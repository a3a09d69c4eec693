"""Nodes joined by links: the parameters, and a state."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Bool, Float

HELD = {True: ("roll", "phi"), False: ("x", "y", "phi")}  # what can be held, with and without a wheel
PER_NODE = ("mass", "heading_inertia", "spin_inertia", "rolling_drag")  # each at least 0
PER_LINK = ("stretch_compliance", "shear_compliance", "bending_stiffness", "torsion_stiffness")


@dataclass(frozen=True, kw_only=True, eq=False)
class Linkage:
    """A chain of `n` nodes in the plane, with or without a wheel, joined by links that may be rigid.

    A node has (x, y, theta, phi), as in a `discs.SteeredChain`: phi is the direction of the axle, theta the roll. A node with a
    wheel moves along J (cos phi, sin phi) only, by R theta'; a node without one moves freely, and its theta stays.
    The body of a node looks along phi - psi, with psi its mounting angle: psi = 0 is the rod of rolling discs, whose axles are
    along the line, and psi = 90 degrees a snake, whose wheels roll along the line. See docs/snakes.md for the equations.

    Parameters
    ----------
    n : number of nodes, at least 2 (3 if closed).
    link_length : k of the links, > 0. What is "per link" is a number or an array (n-1,), (n,) if closed; per node, (n,).
    mass, heading_inertia : of nodes, >= 0; zero where rigid links, or what is held, leave no velocity without inertia.
    bending_stiffness : K of links, >= 0: the moment K (change of the body's direction)/k.
    wheel : which nodes have a wheel.
    mounting_angle : psi of nodes, rad.
    stretch_compliance, shear_compliance : 1/A and 1/G of links, >= 0: strain per force, 0 for rigid.
    torsion_stiffness : beta of links, >= 0, between wheels.
    spin_inertia : of wheels about the axle, >= 0.
    radius : R of wheels, > 0.
    rolling_drag : of wheels, torque per rate of roll, >= 0.
    second_share : weight of the second node in the direction of a link, 0 to 1: 1/2 is a beam, 1 a bar that is fixed to its second
        node and hinged at its first, as a trailer.
    rest_curvature : of links, per length, or a function of t with such values: muscles.
    force_x, force_y : constant forces on nodes (dead loads).
    held : pairs of a node and what is held there: "x", "y" or "phi" without a wheel, "roll" or "phi" with one.
    closed : whether a link joins the last node and the first. shift, turns : then the advance of r, and the whole turns of the
        body, once around.

    Raises
    ------
    ValueError : for any parameter outside its range.
    """

    n: int
    link_length: ArrayLike
    mass: ArrayLike
    heading_inertia: ArrayLike
    bending_stiffness: ArrayLike
    wheel: ArrayLike = True
    mounting_angle: ArrayLike = 0.0
    stretch_compliance: ArrayLike = 0.0
    shear_compliance: ArrayLike = 0.0
    torsion_stiffness: ArrayLike = 0.0
    spin_inertia: ArrayLike = 0.0
    radius: ArrayLike = 1.0
    rolling_drag: ArrayLike = 0.0
    second_share: ArrayLike = 0.5
    rest_curvature: ArrayLike | Callable[[float], ArrayLike] = 0.0
    force_x: ArrayLike = 0.0
    force_y: ArrayLike = 0.0
    held: tuple[tuple[int, str], ...] = ()
    closed: bool = False
    shift: tuple[float, float] = (0.0, 0.0)
    turns: int = 0

    def __post_init__(self) -> None:
        checks.flag("closed", self.closed)
        n = checks.whole("n (nodes)", self.n, 3 if self.closed else 2, "a link joins two nodes")
        checks.fits(f"n = {n} nodes", 32 * n)
        links = n - (not self.closed)
        settled: dict[str, Any] = {"n": n, "turns": checks.whole("turns", self.turns)}
        for name in PER_NODE:
            settled[name] = _settled(f"{name} of nodes", getattr(self, name), n, 0.0)
        for name in PER_LINK:
            settled[name] = _settled(f"{name} of links", getattr(self, name), links, 0.0)
        settled["radius"] = _settled("radius of nodes", self.radius, n, 0.0, True)
        settled["link_length"] = _settled("link_length of links", self.link_length, links, 0.0, True)
        for name in ("mounting_angle", "force_x", "force_y"):
            settled[name] = _settled(f"{name} of nodes", getattr(self, name), n)
        settled["second_share"] = _settled("second_share of links", self.second_share, links, 0.0)
        if (settled["second_share"] > 1).any():
            link = int(np.argmax(settled["second_share"]))
            raise ValueError(f"second_share of links must be at most 1; got {settled['second_share'][link]:g} at place {link}")
        settled["shift"] = tuple(checks.field("shift", self.shift, 2).tolist())
        if not self.closed and (np.any(settled["shift"]) or settled["turns"]):
            raise ValueError("shift and turns are those of a closed chain; with closed=False leave them out")
        settled["wheel"] = self._wheels(n)
        for name, value in settled.items():
            object.__setattr__(self, name, value)
        self._check_twist()
        self._check_held()
        self.rest(0.0)

    def _wheels(self, n: int) -> Bool:
        given = np.asarray(self.wheel)
        if given.dtype != bool or given.shape not in ((), (n,)):
            raise ValueError(f"wheel must be True, False, or one of them for each of the {n} nodes; got {checks.shown(self.wheel)}")
        return np.broadcast_to(given, (n,)).copy()

    def _check_twist(self) -> None:
        first, second = self.ends
        for link in np.flatnonzero(self.torsion_stiffness).tolist():
            for node in (first[link], second[link]):
                if not self.wheels[node]:
                    raise ValueError(
                        f"torsion_stiffness of link {link} needs wheels at its nodes; node {node} has none: take 0 for that link"
                    )

    def _check_held(self) -> None:
        for entry in checks.several("held", self.held, "pairs, as ((0, 'phi'), (0, 'y'))"):
            if not isinstance(entry, tuple) or len(entry) != 2:
                raise ValueError(f"held must be pairs, as ((0, 'phi'), (0, 'y')); got {checks.shown(self.held)}")
            node, what = checks.whole("node of held", entry[0], 0), entry[1]
            if node >= self.n:
                raise ValueError(f"held names node {node}; the nodes are 0 to {self.n - 1}")
            wheel = bool(self.wheels[node])
            if what not in HELD[wheel]:
                there = "a wheel" if wheel else "no wheel"
                raise ValueError(f"held: node {node} has {there}, where one of {HELD[wheel]} can be held; got {checks.shown(what)}")

    @property
    def wheels(self) -> Bool:
        """Which nodes have a wheel, (n,)."""
        return np.asarray(self.wheel)

    @property
    def ends(self) -> tuple[Any, Any]:
        """First and second node of each link, (n_links,)."""
        first = np.arange(self.n - (not self.closed))
        return first, (first + 1) % self.n

    @property
    def s(self) -> Float:
        """Places of the nodes along the chain, (n,)."""
        found: Float = np.append(0.0, np.cumsum(np.asarray(self.link_length)))[: self.n]
        return found

    @property
    def length(self) -> float:
        """Sum of the lengths of the links."""
        return float(np.sum(self.link_length))

    def rest(self, t: float) -> Float:
        """The rest curvatures at a time, (n_links,)."""
        given = self.rest_curvature
        value = checks.called("rest_curvature", given, t, where=f" at t = {t:g}") if callable(given) else given
        return checks.field("rest_curvature of links", value, self.n - (not self.closed))


def _settled(name: str, value: ArrayLike, size: int, least: float | None = None, strict: bool = False) -> Float:
    return np.array(checks.field(name, value, size, least=least, strict=strict))


@dataclass(frozen=True, eq=False)
class LinkageState:
    """Places, directions and velocities of the nodes, numbers or arrays (n,).

    Where there is a wheel the velocity must be along it; the rate of roll follows from it.

    Attributes
    ----------
    x, y : places, length.
    phi : directions of the axles, rad.
    theta : roll angles, rad.
    x_rate, y_rate : velocities, length per time.
    phi_rate : rates of turning, rad per time.

    Raises
    ------
    ValueError : for arrays of different lengths, and for what is not a finite number.
    """

    x: ArrayLike
    y: ArrayLike
    phi: ArrayLike
    theta: ArrayLike = 0.0
    x_rate: ArrayLike = 0.0
    y_rate: ArrayLike = 0.0
    phi_rate: ArrayLike = 0.0

    def __post_init__(self) -> None:
        given = {f.name: checks.array(f"initial {f.name}", getattr(self, f.name)) for f in fields(self)}
        n = max(value.size for value in given.values())
        for name, value in given.items():
            object.__setattr__(self, name, checks.field(f"initial {name}", value, n))
