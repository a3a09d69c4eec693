"""N rolling discs joined by springs: the parameters of the mechanical system."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from discs import checks, stencils

ROLLING = ("field", "unit")
FEWEST = {"springs": 3, "paper": 3, "consistent": 4, "ring": 5}
WHY = {
    "springs": "a bend needs two neighbours",
    "paper": "a bend needs two neighbours",
    "consistent": "the ghost disc beyond an end takes four",
    "ring": "a fourth difference takes five",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """A chain of `n` vertical discs that roll without sliding, with bending and torsion springs between them.

    Disc i stands at s_i = i k on the straight chain and for a share w_i of its length; its mass is rho w_i and its moment
    of inertia about the axle alpha w_i. The springs store

        V = sum_links beta/(2k) (theta_{i+1} - theta_i)**2 + sum_bends K k/2 |r''_i|**2,

    and disc i moves by r_i' = e_i omega_i, with e_i = R J r'_i ("field", the paper's (constraints)) or
    e_i = R J r'_i/|r'_i| ("unit", (constraintsphi)); J turns by +90 degrees. The stencils of r' and r'' are in
    `discs.stencils`.

    Parameters
    ----------
    n : number of discs, at least 3 (4 with consistent ends, 5 on a ring).
    length : length of the rod that the chain stands for, > 0.
    density : rho, mass per length, > 0; a number or one per disc (n,).
    spin_inertia : alpha, moment of inertia about the axle per length, >= 0; a number or (n,).
    torsion_stiffness : beta >= 0; a number or one per link (n-1,), (n,) on a ring.
    bending_stiffness : K >= 0; a number or one per bend, (n-2,), (n,) on a ring and with consistent ends.
    radius : R > 0; a number or (n,).
    rolling : "field" or "unit".
    ends : "springs", "consistent", "paper" (as "springs", end discs of full weight) or "ring".
    shift : r advances by this on one turn of a "ring": (0, 0) closes it, (length, 0) makes a straight periodic rod.

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
    ends: str = "springs"
    shift: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        checks.choice("ends", self.ends, stencils.ENDS)
        checks.choice("rolling", self.rolling, ROLLING)
        n = checks.whole(f"n (discs, ends={self.ends!r})", self.n, FEWEST[self.ends], WHY[self.ends])
        shift = checks.field("shift", self.shift, 2)
        if self.ends != "ring" and shift.any():
            raise ValueError(f"shift is the advance of r along a ring; with ends={self.ends!r} it must be (0, 0)")
        n_links, n_bends = n - (self.ends != "ring"), len(stencils.bend_shares(n, 1.0, self.ends))
        ranges: dict[str, tuple[int, bool]] = {
            "density": (n, True),
            "spin_inertia": (n, False),
            "torsion_stiffness": (n_links, False),
            "bending_stiffness": (n_bends, False),
            "radius": (n, True),
        }
        settle = {"n": n, "length": checks.number("length", self.length, positive=True), "shift": tuple(shift.tolist())}
        for name, (size, strict) in ranges.items():
            settle[name] = checks.field(name, getattr(self, name), size, least=0.0, strict=strict)
        for name, value in settle.items():
            object.__setattr__(self, name, value)

    @property
    def k(self) -> float:
        """Spacing of the discs."""
        return stencils.spacing(self.n, self.length, self.ends)

    @property
    def s(self) -> NDArray:
        """Places of the discs along the rod, (n,)."""
        return self.k * np.arange(self.n)

    @property
    def w(self) -> NDArray:
        """Length each disc stands for, (n,)."""
        return stencils.shares(self.n, self.k, self.ends)
