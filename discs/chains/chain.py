"""N rolling discs joined by springs: the parameters of the mechanical system."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.chains import elements, links, stencils
from discs.chains.rolling import ROLLING, RollingLaw

FIELDS = 16  # numbers to a disc, at least, in a chain and its state
SHORTEST = 1e-60  # spacing; its fourth power, times stiffness or inertia, does not underflow
FEWEST = {"springs": 3, "paper": 3, "consistent": 4, "ring": 5}
WHY = {  # the reason for `FEWEST`
    "springs": "a bend needs two neighbours",
    "paper": "a bend needs two neighbours",
    "consistent": "the ghost disc beyond an end takes four",
    "ring": "a fourth difference takes five",
}


class Spaced:
    """Discs at equal spacing along a rod."""

    n: int
    length: float
    ends: str
    degree: int = 1

    @property
    def k(self) -> float:
        """Spacing of the discs."""
        return stencils.spacing(self.n, self.length, self.ends)

    @property
    def s(self) -> Float:
        """Places of the discs along the rod, (n,)."""
        s: Float = self.k * np.arange(self.n, dtype=float)
        return s

    @property
    def middles(self) -> Float:
        """Places of the strains of links along the rod, (n_links,): their middles, or the strain points of `elements`."""
        if self.degree == 2:
            return elements.places(self.n - (self.ends != "ring"), self.k)
        middles: Float = self.k * (0.5 + np.arange(self.n - (self.ends != "ring"), dtype=float))
        return middles

    @property
    def w(self) -> Float:
        """Share of the length of each disc, (n,)."""
        if self.degree == 2:
            return elements.shares(self.n, self.k, self.ends)
        return stencils.shares(self.n, self.k, self.ends)

    def tension(self, moment: Float) -> Float:
        """Tensions of links from moments at the places of their strains, (..., n_links)."""
        return elements.mixed(moment) if self.degree == 2 else moment


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain(Spaced):
    """A chain of `n` vertical discs that roll without sliding, with bending and torsion springs between them.

    On the straight chain disc i is at s_i = i k. Its share of the length is w_i, its mass rho w_i and its moment of inertia about
    the axle alpha w_i. The springs store

        V = sum_links beta/(2k) (theta_{i+1} - theta_i)**2 + sum_bends K k/2 |r''_i|**2,

    and disc i moves by r_i' = e_i omega_i, with e_i = R J r'_i ("field", the paper's (constraints)) or
    e_i = R J r'_i/|r'_i| ("unit", (constraintsphi)); J turns by +90 degrees. The laws are in `discs.chains.rolling` and
    `discs.chains.links`, the stencils of r' and r'' in `discs.chains.stencils`.

    Parameters
    ----------
    n : number of discs, at least 3 (4 with consistent ends, 5 on a ring).
    length : length of the rod, > 0.
    density : rho, mass per length, > 0; a number or one per disc (n,).
    spin_inertia : alpha, moment of inertia about the axle per length, >= 0; a number or (n,).
    torsion_stiffness : beta >= 0; a number or one per link (n-1,), (n,) on a ring.
    bending_stiffness : K >= 0; a number or one per bend, (n-2,), (n,) on a ring and with consistent ends.
    radius : R >= 0; a number or (n,). A disc of radius 0 does not move, it only twists.
    rolling : "field" or "unit".
    curvature : "linear", bending energy K/2 |r''|**2, the paper's; or "true", K/2 phi'**2 with phi the direction of the line,
        independent of stretch. With "true" the ends have no bending spring: the natural condition is phi' = 0.
    stretch_stiffness : A >= 0, energy A/2 (|r'| - 1)**2 of links; a number or one per link. Only with the true curvature.
    ends : "springs", "consistent", "paper" (as "springs", with end discs of full weight) or "ring".
    shift : advance of r over one period of a "ring": (0, 0) for a closed ring, (length, 0) for a straight periodic rod.

    Any consistent unit system may be used.

    Raises
    ------
    ValueError : for any parameter outside its range.
    """

    n: int
    length: float
    density: ArrayLike
    spin_inertia: ArrayLike
    torsion_stiffness: ArrayLike
    bending_stiffness: ArrayLike
    radius: ArrayLike
    rolling: str = "field"
    curvature: str = "linear"
    stretch_stiffness: ArrayLike = 0.0
    ends: str = "springs"
    shift: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        checks.choice("ends", self.ends, stencils.ENDS)
        checks.choice("rolling", self.rolling, ROLLING)
        checks.choice("curvature", self.curvature, links.CURVATURE)
        n = checks.whole(f"n (discs, ends={self.ends!r})", self.n, FEWEST[self.ends], WHY[self.ends])
        object.__setattr__(self, "n", n)
        checks.fits(f"n = {n} discs", FIELDS * n)
        joints = n - (self.ends != "ring")
        _check_and_store(
            self,
            density=(n, True),
            spin_inertia=(n, False),
            torsion_stiffness=(joints, False),
            bending_stiffness=(stencils.bend_shares(n, 1.0, self._bend_ends).size, False),
            stretch_stiffness=(joints, False),
            radius=(n, False),
        )
        links.find(self.curvature, np.any(self.stretch_stiffness))

    @property
    def rolling_law(self) -> RollingLaw:
        """The law of rolling."""
        return ROLLING[self.rolling]

    @property
    def link_law(self) -> type[links.LinkLaw]:
        """The link law."""
        return links.CURVATURE[self.curvature]

    @property
    def bend_shares(self) -> Float:
        """Share of the length of each bend, (n_bends,)."""
        return stencils.bend_shares(self.n, self.k, self._bend_ends)

    @property
    def bends(self) -> Float:
        """Places of the bends along the rod, (n_bends,): those of their discs."""
        s, missing = self.s, self.n - self.bend_shares.size
        return s[missing // 2 : self.n - missing // 2]

    @property
    def _bend_ends(self) -> str:
        return "springs" if self.ends == "consistent" and not self.link_law.end_bends else self.ends


@dataclass(frozen=True, kw_only=True, eq=False)
class SteeredChain(Spaced):
    """A chain of `n` vertical rolling discs with headings of their own, joined by flexible beams.

    The configuration of a disc is (x, y, theta, phi), with phi the direction of its axle. It rolls along J (cos phi, sin phi).
    A link between neighbours resists stretch, shear, torsion and bending; see `discs.chains.steered` for the energy.

    Parameters
    ----------
    n : number of discs, at least 2 (5 on a ring); for degree 2 odd and at least 3, on a ring even and at least 6.
    length, density, spin_inertia, torsion_stiffness, bending_stiffness, radius : as for `Chain`; the bending stiffness is
        per link.
    heading_inertia : J, moment of inertia about the vertical per length, > 0; a number or one per disc (n,).
    stretch_stiffness : A >= 0, force per stretch; a number or one per link.
    shear_stiffness : G >= 0, force per shear angle; a number or one per link.
    ends : "springs" or "ring".
    shift : advance of r over one period of a "ring".
    turns : whole turns of the heading over one period of a "ring": 1 for a circle, 0 for a straight periodic rod.
    degree : 1, a beam joins two neighbours; 2, three, as the parabola through them: errors fall like 1/n**4 instead of 1/n**2
        (`discs.chains.elements`). What is per link is then per strain point, at `middles`.

    Raises
    ------
    ValueError : for any parameter outside its range.
    """

    n: int
    length: float
    density: ArrayLike
    spin_inertia: ArrayLike
    heading_inertia: ArrayLike
    stretch_stiffness: ArrayLike
    shear_stiffness: ArrayLike
    torsion_stiffness: ArrayLike
    bending_stiffness: ArrayLike
    radius: ArrayLike
    ends: str = "springs"
    shift: tuple[float, float] = (0.0, 0.0)
    turns: int = 0
    degree: int = 1

    def __post_init__(self) -> None:
        checks.choice("ends (own headings)", self.ends, ("springs", "ring"))
        least, why = (5, "a ring's neighbours must differ") if self.ends == "ring" else (2, "a link joins two discs")
        n = checks.whole(f"n (discs, ends={self.ends!r})", self.n, least, why)
        object.__setattr__(self, "degree", elements.check(self.degree, n, self.ends))
        object.__setattr__(self, "n", n)
        checks.fits(f"n = {n} discs", FIELDS * n)
        links = n - (self.ends != "ring")
        _check_and_store(
            self,
            density=(n, True),
            spin_inertia=(n, False),
            heading_inertia=(n, True),
            stretch_stiffness=(links, False),
            shear_stiffness=(links, False),
            torsion_stiffness=(links, False),
            bending_stiffness=(links, False),
            radius=(n, False),
        )
        object.__setattr__(self, "turns", checks.whole("turns", self.turns))
        if self.ends != "ring" and self.turns:
            raise ValueError(f"turns of the heading are counted around a ring; with ends={self.ends!r} it must be 0")


def _check_and_store(chain: "Chain | SteeredChain", **ranges: tuple[int, bool]) -> None:
    """Check length, shift and the parameters (each with its size, and whether it must be positive), and store them as arrays."""
    object.__setattr__(chain, "length", checks.number("length", chain.length, positive=True))
    if not SHORTEST < chain.k < 1 / SHORTEST:
        raise ValueError(
            f"length gives the discs a spacing of {chain.k:g}; it must be between {SHORTEST:g} and {1 / SHORTEST:g}: change units"
        )
    shift = checks.field("shift", chain.shift, 2)
    if chain.ends != "ring" and shift.any():
        raise ValueError(f"shift is the advance of r along a ring; with ends={chain.ends!r} it must be (0, 0)")
    object.__setattr__(chain, "shift", tuple(shift.tolist()))
    for name, (size, strict) in ranges.items():
        object.__setattr__(chain, name, checks.field(name, getattr(chain, name), size, least=0.0, strict=strict))
