"""Initial data of the free rod: checks of |r'| = 1 and r'.v' = 0, between the nodes too.

**Functions of s** are evaluated at the nodes and at 13 Gauss-Lobatto points of every link, which give their derivatives. So |r'| is
measured, not the chord of a link, which is shorter than the arc by psi^2/24 if the arc turns by psi. A kink at a node shows as two
different values of r'.

**Arrays** have values at the nodes only. Three kinds are accepted:

* nodes of a line: |r'| = 1 and r'.v' = 0 hold for splines of degree 7; the difference to splines of degree 5 is their uncertainty;
* links of length k: |d| = k, and d.Lv = 0 for the velocity;
* a frame of an earlier run: d.Lv = 0 to rounding, where a sampled velocity has k^2 r''.v''/12. Its links have the lengths that they
  had at the start of that run, at most k.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from continuum.element_grid import lobatto
from discs import Chain, checks
from discs.arrays import Float, Spline
from discs.chains import stencils

Data = Callable[[Float], ArrayLike] | ArrayLike
STRAIN = 1e-6  # tolerance of | |r'| - 1 | and, relative to the largest |v'|, of r'.v', for the user's rounding
UNKNOWN = 5e-4  # largest additional tolerance for the uncertainty of arrays
SHORT = 0.05  # of k: links of an earlier run may be shorter by this, as the chord of one radian is
KINK = 0.1  # rad: largest difference of the turn at a node of an array from the mean of its neighbours
BENT = 0.05  # rad: curvature of a free end times the length, above which a warning is given
DEGREE = 7  # of splines through nodes
X, _, D = lobatto(12)
MIDDLE = slice(X.size // 2, X.size // 2 + 1)  # of a link, where splines through nodes are most accurate
ULPS = 1000 * np.finfo(float).eps


class Given:
    """The data for one quantity of the rod: a function of s, or values at the nodes.

    Parameters
    ----------
    name : for messages.
    data : function of s (n,), or values.
    rows : 2 for x and y, (2, n); 1 for (n,) or a number.
    chain : the nodes.

    Attributes
    ----------
    call : the function, or None.
    nodes : (rows, n), the values at the nodes.
    rounding : the error of a derivative that rounding of the values may cause.
    """

    def __init__(self, name: str, data: Data, rows: int, chain: Chain) -> None:
        self.name, self._rows, self._chain = name, rows, chain
        self.call: Callable[[Float], ArrayLike] | None = data if callable(data) else None
        self.nodes = self._read(self._called(data, chain.s) if callable(data) else data, chain.n)
        self.rounding = ULPS * float(np.abs(self.nodes).max()) / chain.k

    def _called(self, function: Callable[[Float], ArrayLike], s: Float) -> Any:
        """The function's values at places s."""
        return checks.called(self.name, function, s, where=f", at {s.size} places s from {s.min():g} to {s.max():g}")

    def _read(self, values: ArrayLike, size: int) -> Float:
        if self._rows == 1:
            return checks.field(self.name, values, size)[None]
        rows = tuple(values) if isinstance(values, Iterable) else ()
        try:
            shape = str(np.shape(values))
        except ValueError:  # x and y of unequal lengths
            shape = ", ".join(str(np.shape(row)) for row in rows)
        if shape != str((2, size)):
            asked = f" where s has shape ({size},): it is evaluated between the nodes too" if self.call else ""
            raise ValueError(f"{self.name} must give x and y, an array of shape {(2, size)}{asked}; got shape {shape}")
        return np.array([checks.field(self.name, row, size) for row in rows])

    def at(self, s: Float, degree: int = DEGREE) -> Float:
        """Values at places s, (rows, s.size); those of an array by a spline."""
        if self.call is not None:
            return self._read(self._called(self.call, s), s.size)
        return through(self._chain, self.nodes, degree)(s)

    def slopes(self, places: Float) -> tuple[Float, Float]:
        """d/ds at the places of each link, (2, n_links, 13), and its uncertainty, (n_links, 13), which is not zero for arrays."""
        if self.call is None:
            slope, lower = (through(self._chain, self.nodes, g).derivative()(places) for g in (DEGREE, DEGREE - 2))
            return slope, np.hypot(*(slope - lower))
        values = self.at(places.ravel()).reshape(2, *places.shape)
        return (values - values[..., :1]) @ D.T * (2 / self._chain.k), np.zeros(places.shape)

    def links(self) -> Float:
        """L/k, (2, n_links)."""
        return stencils.links(self.nodes, self._chain.ends) / self._chain.k


def through(chain: Chain, values: Float, degree: int = DEGREE, offset: float = 0.0) -> Spline:
    """Spline through values (..., n) at the nodes, or (..., n_links) at `offset` after them; periodic around a ring."""
    s = chain.s[: values.shape[-1]] + offset
    if chain.ends == "ring":
        s = np.concatenate([s - chain.length, s, s + chain.length])
        values = np.concatenate([values] * 3, axis=-1)
    most = max(1, s.size - 1 - (DEGREE - degree))
    spline: Spline = scipy.interpolate.make_interp_spline(s, values, degree if degree <= most else most - (most % 2 == 0), axis=-1)
    return spline


def check(chain: Chain, r: Given, v: Given) -> str:
    """The warning about the initial data, or "". ValueError if the line or its velocity is stretched, not closed or not smooth."""
    if chain.ends == "ring":
        _closed(chain, r)
        _closed(chain, v)
    if r.call is None and v.call is None and _of_earlier_run(chain, r, v):
        return ""
    first = chain.s[: chain.n - (chain.ends != "ring")]
    places = np.minimum(first[:, None] + chain.k * (X + 1) / 2, chain.length)
    (dr, open_r), (dv, open_v) = r.slopes(places), v.slopes(places)
    here = slice(None) if r.call is not None else MIDDLE
    _line(chain, r, places[:, here], dr[..., here], open_r[:, here])
    here = slice(None) if r.call is not None and v.call is not None else MIDDLE
    places, dr, dv = places[:, here], dr[..., here], dv[..., here]
    speed = float(np.abs(dv).max())
    strain = np.abs((dr * dv).sum(axis=0))
    rounding = STRAIN * speed + v.rounding + r.rounding * speed
    allowed = np.full_like(strain, rounding)
    if here is MIDDLE:
        if np.abs((r.links() * v.links()).sum(axis=0)).max() <= rounding:
            strain = np.zeros_like(strain)
        allowed = rounding + np.minimum(open_r[:, here] * speed + open_v[:, here], UNKNOWN * speed)
    if (strain > allowed).any():
        at = _worst(strain - allowed)
        raise ValueError(
            f"v0 must not stretch the rod, r0'.v0' = 0; got {strain[at]:.3g} at s = {places[at]:.4g}, between nodes {at[0]} and "
            f"{(at[0] + 1) % chain.n}, where |v0'| is up to {speed:.3g}"
        )
    return _bent_ends(chain, r) if chain.ends != "ring" else ""


def _line(chain: Chain, r: Given, places: Float, dr: Float, doubt: Float) -> None:
    """Raise ValueError if the line is stretched or has a kink."""
    length, allowed = np.hypot(*dr), STRAIN + r.rounding + np.minimum(doubt, UNKNOWN)
    off = np.abs(length - 1)
    if r.call is None and np.abs(np.hypot(*r.links()) - 1).max() <= STRAIN + r.rounding:
        off = np.zeros_like(off)  # links of length k
    if (off > allowed).any():
        at = _worst(off - allowed)
        raise ValueError(
            f"r0 must have |r0'| = 1, s being its arc length; got {length[at]:.7g} at s = {places[at]:.4g}, between nodes {at[0]} "
            f"and {(at[0] + 1) % chain.n}: there it is stretched, has a kink, a jump or noise, or n is too small for it"
        )
    if r.rounding > UNKNOWN:
        far = float(np.abs(r.nodes).max())
        raise ValueError(
            f"r0 is too far from the origin, {far:.3g}: by rounding |r0'| is known to {r.rounding:.1g} only; shift it nearer"
        )
    # links of an array, or the slopes of a function before and after each node
    before, after = (r.links(),) * 2 if r.call is None else (dr[..., -1], dr[..., 0])
    ring = chain.ends == "ring"
    before, after = (np.roll(before, 1, axis=1), after) if ring else (before[:, :-1], after[:, 1:])
    turn = np.arctan2(before[0] * after[1] - before[1] * after[0], (before * after).sum(axis=0))
    around = np.pad(turn, 1, mode="wrap" if ring else "edge")
    sharp = np.abs(turn - (around[2:] + around[:-2]) / 2) if r.call is None else np.abs(turn)
    node = int(np.argmax(sharp)) + (not ring)
    if sharp.max() > (KINK if r.call is None else STRAIN + r.rounding):
        raise ValueError(
            f"r0 must be smooth, as a kink has infinite bending energy; got one of {sharp.max():.3g} rad at s = "
            f"{chain.s[node]:.4g}, node {node}"
        )


def _closed(chain: Chain, given: Given) -> None:
    """Raise ValueError if a function differs at the two ends of a ring. For arrays the closing link shows this."""
    if given.call is None:
        return
    ends = given.at(np.array([0.0, chain.length]))
    gap, largest = float(np.hypot(*(ends[:, 1] - ends[:, 0]))), float(np.abs(given.nodes).max())
    if gap > STRAIN * (chain.k if given.name == "r0" else largest) + ULPS * largest:
        (x0, x1), (y0, y1) = ends
        raise ValueError(
            f"{given.name} must be closed around a ring, the same at s = 0 and s = {chain.length:g}; got ({x0:.6g}, {y0:.6g}) and "
            f"({x1:.6g}, {y1:.6g}), {gap:.3g} apart"
        )


def _of_earlier_run(chain: Chain, r: Given, v: Given) -> bool:
    """Whether arrays are a frame of an earlier run: its velocity preserves the links to rounding, but not the line."""
    d, rate = r.links(), v.links()
    chord, speed = np.hypot(*d), float(np.abs(rate).max())
    rounding = 1e-10 * speed + v.rounding + r.rounding * speed
    middle = chain.s[: chord.size] + chain.k / 2
    dr, dv = (through(chain, given.nodes).derivative()(middle) for given in (r, v))
    by_links, by_line = (float(np.abs((a * b).sum(axis=0)).max()) for a, b in ((d, rate), (dr, dv)))
    lengths = chord.max() <= 1 + 1e-9 + r.rounding and chord.min() >= 1 - SHORT
    return bool(lengths and by_links <= rounding and by_line > 100 * rounding)


def _bent_ends(chain: Chain, r: Given) -> str:
    """A warning if a free end starts with curvature kappa or with kappa'; otherwise empty.

    Free ends have neither. Their initial values send out waves of size q^-3 (kappa) or q^-4 (kappa') in r, and q^2 times that in v.
    With kappa the sum of the velocities has no limit; with either the sum of the tension has none.
    """
    wide = max(chain.k, chain.length / 32)
    rounding = ULPS * float(np.abs(r.nodes).max()) / wide * np.array([1e2 / wide, 1e5 / wide**2])
    for end, inwards in ((0.0, 1.0), (chain.length, -1.0)):

        def ends(degree: int, end: float = end, inwards: float = inwards) -> Float:
            """kappa and kappa' at the end."""
            values = r.at(end + inwards * wide * (X + 1) / 2, degree)
            values, d = values - values[:, :1], D.T * (2 * inwards / wide)
            first, second, third = ((values @ np.linalg.matrix_power(d, m))[:, 0] for m in (1, 2, 3))
            return np.array([first[0] * z[1] - first[1] * z[0] for z in (second, third)])

        found = ends(DEGREE)
        known = np.abs(found) - np.abs(found - ends(DEGREE - 2)) - rounding
        for bent, name, lost in zip(
            found * (known * [chain.length, chain.length**2] > [BENT, 10 * BENT]),
            ("curvature", "rate of curvature kappa' ="),
            ("velocities and tension have", "tension has"),
            strict=True,
        ):
            if bent:
                return (
                    f"r0 has the {name} {bent:.3g} at s = {end:g}, where a free end has none: positions are right, but the {lost} "
                    "no limit for many nodes; start with a line that is straight near free ends"
                )
    return ""


def _worst(values: Float) -> tuple[int, ...]:
    """The index of the largest entry."""
    return tuple(int(i) for i in np.unravel_index(np.argmax(values), values.shape))
