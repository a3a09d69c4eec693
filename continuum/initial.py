"""Resolution of the initial fields, before anything is computed from them: `resolve(scene)`.

A solver that samples the initial fields at its own n places can miss a bump between two of them. So the length is first cut into
pieces on which every field is smooth, by bisection (Chebfun's splitting; Pachon, Platte and Trefethen, 2010). On a piece of width h
a field f is sampled at 16 Gauss nodes and expanded in Legendre polynomials,

    f(s) = sum_{k < 16} c_k P_k(x),    x = 2 (s - middle)/h.

The piece is kept if the following are, for every field, below 1e-12 of its size or below rounding: the last three |c_k|, the misfit
at eight other places of the piece, and the misfit at those of 8192 probes that lie in the piece. (The size is the largest deviation
from the mean, for x and y from the chord.) Each 8192th of the length has one probe, at an irregular place. So gaps between probes
are at most 1/4096 of the length. A feature wider than length/4000 is found wherever it is, and so is a Gaussian of width
length/40000.

Bisection closes in on a corner or a jump. Pieces narrower than 1e-9 of the length are replaced by one edge, and the rest is cut
again. The fields are then smooth on both sides of the edge, and the jumps f(s+) - f(s-), f'(s+) - f'(s-) are known. Refused are

* a jump of any field: a jump of theta has infinite energy, and smooth functions do not converge uniformly to a jump of omega;
* a corner of the line if it has bending stiffness, because int K |r''|^2/2 is infinite (steered rods bend by phi', so only phi must
  be continuous);
* an infinite slope, as of sqrt(s), and noise;
* r' = 0 where the line needs a heading.

A corner of theta, omega or phi has finite energy and is accepted.

Parameters of the rod that are functions of s are resolved with the fields, on the same pieces: jumps are refused, corners accepted,
and narrow features of a parameter are features of the scene.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre

from continuum.gauss import gauss
from continuum.pieces import ENDS, EXPAND, NODES, POINTS, TINY, WEIGHTS, Cut, Data, split
from continuum.rod import Scene
from discs.arrays import Float
from discs.chains.links import CURVATURE
from discs.chains.rolling import ROLLING

SHARP = 1e-6  # of the length: shorter pieces may have at most a thousandth of the energy
STILL = 1e-6  # of the largest slope: smaller slopes count as zero
NARROW = 20.0  # features are narrower than the length over this


@dataclass(frozen=True, eq=False)
class Resolved:
    """The initial fields of a scene on pieces where they are smooth.

    Attributes
    ----------
    scene : the scene.
    pieces : (P + 1,), edges of the pieces, from 0 to the length. Corners are among them, those of parameters too.
    energy : kinetic and potential energy by Gauss quadrature, relative error about 1e-12.
    potential : the potential energy.
    features : (place, width) of each feature narrower than length/20. With g = max(|f'|, sqrt(F |f''|/2))/F for a field f of size
        F, a feature is a stretch where g is above 20/length for some field. place : its middle. width : 1/max g on it, which is
        about w for exp(-(s/w)^2) and tanh(s/w).
    kinks : places where the slope of a field jumps, to 1e-10 of the length.
    """

    scene: Scene
    pieces: Float
    energy: float
    potential: float
    features: tuple[tuple[float, float], ...] = ()
    kinks: tuple[float, ...] = ()

    def fields(self, s: Float) -> dict[str, Float]:
        """The initial fields at places (n,) by name, each (n,)."""
        return self.scene.fields(s)

    def quadrature(self, order: int) -> tuple[Float, Float]:
        """Places and weights of Gauss quadrature with `order` points on every piece, each (P order,)."""
        x, w = gauss(order)
        half = np.diff(self.pieces)[:, None] / 2
        return (self.pieces[:-1, None] + half * (1 + x)).ravel(), (half * w).ravel()

    def twist(self, edges: Float, order: int) -> Float:
        """theta' as `derivative` has it."""
        return self.derivative("theta", edges, order)

    def derivative(self, name: str, edges: Float, order: int, m: int = 1) -> Float:
        """The m-th derivative of a field at the places of Gauss quadrature on pieces, of these or parts of them, (P order,)."""
        # from the 16 nodes that resolve it: with more, rounding of the highest coefficients would be amplified
        half = np.diff(edges)[:, None] / 2
        field = self.fields((edges[:-1, None] + half * (1 + NODES)).ravel())[name].reshape(-1, POINTS) @ EXPAND.T
        places = legendre.legvander(gauss(order)[0], POINTS - 1 - m)
        found: Float = (field @ legendre.legder(np.eye(POINTS), m).T @ places.T / half**m).ravel()
        return found

    def at(self, name: str, s: Float, m: int) -> Float:
        """The m-th derivative of a field at places (S,)."""
        width = np.diff(self.pieces)
        places = (self.pieces[:-1, None] + width[:, None] / 2 * (1 + NODES)).ravel()
        c = self.fields(places)[name].reshape(-1, POINTS) @ EXPAND.T
        p = np.clip(np.searchsorted(self.pieces, s, side="right") - 1, 0, width.size - 1)
        x = 2 * (s - self.pieces[p]) / width[p] - 1
        values = legendre.legvander(x, POINTS - 1 - m) * legendre.legder(c[p], m, axis=1)
        found: Float = values.sum(axis=1) * (2 / width[p]) ** m
        return found


def resolve(scene: Scene) -> Resolved:
    """Cut the length of a scene into pieces on which its initial fields are smooth. The result is stored with the scene.

    Raises
    ------
    ValueError : for fields that no pieces resolve, and for a closed scene whose ends do not meet. The message names the place and
        the cure.
    """
    if "_resolved" not in scene.__dict__:
        object.__setattr__(scene, "_resolved", _resolve(scene))
    found: Resolved = scene.__dict__["_resolved"]
    return found


def _resolve(scene: Scene) -> Resolved:
    data = Data(scene)
    cut = split(data, np.array([0.0, scene.rod.length]))
    if breaks := cut.breaks():
        cut = split(data, np.array([0.0, *breaks, scene.rod.length]))
    if cut.lost.any():
        p = int(np.argmax(cut.lost))
        data.refuse(cut.worst[p], f"has no finite slope at s = {cut.edges[p]:g}", "take data with finite slopes there")
    with np.errstate(all="ignore"):
        parts = _energies(data, cut)
        energies, fewer = parts.sum(axis=0), _energies(data, replace(cut, c=cut.c[..., : 3 * POINTS // 4])).sum(axis=0)
    unsettled = np.abs(energies - fewer) + np.where(cut.width < SHARP * scene.rod.length, energies, 0.0)
    rod = scene.rod.at(cut.edges)
    rounding = 1e-16 * float(np.max(rod.torsion_stiffness + rod.bending_stiffness)) / scene.rod.length
    if not unsettled.sum() <= 1e-3 * energies.sum() + rounding:  # nan too
        place = cut.edges[np.argmax(np.nan_to_num(unsettled, nan=np.inf))]
        raise ValueError(
            f"the energy of the initial fields does not settle near s = {place:g}: it is infinite, or they vary over less than a "
            f"millionth of the length there; take data that vary over length/500 = {scene.rod.length / 500:g} or more"
        )
    _check_jumps(data, cut)
    return Resolved(scene, cut.edges, float(energies.sum()), float(parts[1].sum()), _features(data, cut), _kinks(data, cut))


def _seam(data: Data) -> Float:
    """The advance of each field of a closed scene over its length, (F,)."""
    gains = {"x": data.scene.shift[0], "y": data.scene.shift[1], "phi": 2 * np.pi * data.scene.turns}
    return np.array([gains.get(name, 0.0) for name in data.rows])


def _check_jumps(data: Data, cut: Cut) -> None:
    """Refuse jumps of fields and corners of the line: between pieces, at the seam of a closed scene and at free ends."""
    scene, ends = data.scene, cut.at(ENDS)
    limit = 1e3 * np.maximum(data.allowed, cut.misfit)
    first, last = ends[:, 0, 0], ends[:, -1, 1]
    jumps = ends[:, 1:, 0] - ends[:, :-1, 1]
    misplaced = TINY * data.length * np.abs(cut.at(ENDS, 1)).max(axis=2)  # of corners, times the slopes
    _check_jump(data, jumps, limit[:, None] + np.maximum(misplaced[:, 1:], misplaced[:, :-1]), cut.edges[1:-1])
    if scene.closed:
        gap = last + data.chord * data.length - first - _seam(data)
        if (np.abs(gap) > limit).any():
            row = int(np.argmax(np.abs(gap) / limit))
            gain, end = _seam(data)[row], last[row] + data.chord[row] * data.length
            what = f"the value at s = 0 plus {gain:g}" if gain else "the value at s = 0"
            by = {"x": " (or another shift)", "y": " (or another shift)", "phi": " (or other turns)"}.get(data.rows[row], "")
            data.refuse(
                row,
                f"must be periodic on a closed scene: at s = length it is {end:.10g}, and {what} is {first[row] + gain:.10g}",
                f"take data that meet at the seam{by}",
            )
    else:
        given = data.read(np.array([0.0, data.length]))
        jumps = np.stack([first - given[:, 0], given[:, 1] - last], axis=1)
        _check_jump(data, jumps, limit[:, None], np.array([0.0, data.length]))
    if not scene.steered:
        if np.any(scene.rod.at(cut.edges).bending_stiffness):
            _check_corners(data, cut)
        if ROLLING[scene.rolling].vanishing or CURVATURE[scene.rod.curvature].directed:
            _check_heading(data, cut)


def _check_jump(data: Data, jumps: Float, limit: Float, places: Float) -> None:
    """Refuse jumps (F, places) beyond the limit."""
    beyond = np.abs(jumps) > limit
    if not beyond.any():
        return
    row, p = np.unravel_index(int(np.argmax(np.where(beyond, np.abs(jumps) / data.unit[:, None], 0.0))), jumps.shape)
    s, width = places[p], data.length / 100
    kind = "field" if data.rows[int(row)] in data.scene.unknowns else "parameter"
    data.refuse(
        int(row),
        f"jumps by {jumps[row, p]:.4g} at s = {s:.10g}: a {kind} of a rod is continuous, and no functions resolve a jump",
        f"spread it over a width of {width:g} or more, for example by tanh((s - {s:.6g})/{width:g})",
    )


def _turns(data: Data, cut: Cut) -> tuple[Float, Float, Float]:
    """Jumps of slopes (F, places), 0 if within the errors; the places; and the largest slopes (F,)."""
    slope, width = cut.at(ENDS, 1) + data.chord[:, None, None], cut.width
    jumps, near, places = slope[:, 1:, 0] - slope[:, :-1, 1], np.minimum(width[1:], width[:-1]), cut.edges[1:-1]
    if data.scene.closed:
        jumps = np.concatenate([jumps, slope[:, :1, 0] - slope[:, -1:, 1]], axis=1)
        near, places = np.append(near, min(width[0], width[-1])), np.append(places, cut.edges[-1])
    real = np.abs(jumps) * near > 1e4 * np.maximum(data.allowed, cut.misfit)[:, None]
    return np.where(real, jumps, 0.0), places, np.abs(slope).max(axis=(1, 2))


def _check_corners(data: Data, cut: Cut) -> None:
    """Refuse a line with a corner."""
    jumps, places, largest = _turns(data, cut)
    turn = np.hypot(*jumps[:2]) / max(float(np.hypot(*largest[:2])), 1e-300)
    if not (turn > 1e-6).any():
        return
    p = int(np.argmax(turn))
    where = f"s = {places[p]:.10g}" + (" (the seam)" if places[p] == data.length else "")
    data.refuse(
        int(np.argmax(np.abs(jumps[:2, p]))),
        f"has a corner at {where}: r' jumps by ({jumps[0, p]:.4g}, {jumps[1, p]:.4g}), and bending energy K |r''|^2/2 is infinite",
        f"round it over a width of {data.length / 100:g} or more, or take bending_stiffness = 0",
    )


def _check_heading(data: Data, cut: Cut) -> None:
    """Refuse a line with r' = 0 somewhere; r' is interpolated linearly between nodes."""
    slope = cut.at(np.concatenate([ENDS[:1], NODES, ENDS[1:]]), 1)[:2] + data.chord[:2, None, None]
    z = slope[0] + 1j * slope[1]
    now, move = z[:, :-1], np.diff(z)
    part = np.clip(-(now.conj() * move).real / np.maximum(np.abs(move) ** 2, 1e-300), 0.0, 1.0)
    least = np.abs(now + part * move).min(axis=1)
    p = int(np.argmin(least))
    if least[p] <= STILL * np.abs(z).max():
        rolls = ROLLING[data.scene.rolling].vanishing
        law = f"rolling={data.scene.rolling!r}" if rolls else f"curvature={data.scene.rod.curvature!r}"
        raise ValueError(
            f"{law} needs a heading: r' = 0 between s = {cut.edges[p]:g} and {cut.edges[p + 1]:g}; take a line with r' != 0"
        )


def _kinks(data: Data, cut: Cut) -> tuple[float, ...]:
    jumps, places, _ = _turns(data, cut)
    return tuple(places[(jumps != 0).any(axis=0)].tolist())


def _energies(data: Data, cut: Cut) -> Float:
    """Kinetic and potential energy of every piece, (2, P); see `Rod` for the densities."""
    scene, rod = data.scene, data.scene.rod.at(cut.edges[:-1, None] + cut.width[:, None] / 2 * (1 + NODES))
    value, slope, bend = (dict(zip(data.rows, cut.at(NODES, d), strict=True)) for d in range(3))
    z = slope["x"] + data.chord[0] + 1j * (slope["y"] + data.chord[1])
    z1 = bend["x"] + 1j * bend["y"]
    if scene.steered:
        strain = z * np.exp(-1j * value["phi"]) - 1
        kinetic = rod.inertia * value["omega"] ** 2 + rod.heading_inertia * value["phi_rate"] ** 2
        density = rod.stretch_stiffness * strain.real**2 + rod.shear_stiffness * strain.imag**2
        density += rod.bending_stiffness * slope["phi"] ** 2
    else:
        e = rod.radius * ROLLING[scene.rolling].size(np.abs(z))
        kinetic = (rod.spin_inertia + rod.density * e**2) * value["omega"] ** 2
        density = CURVATURE[scene.rod.curvature].density(rod.bending_stiffness, rod.stretch_stiffness, z, z1)
    density += rod.torsion_stiffness * slope["theta"] ** 2
    energies: Float = cut.width / 4 * (np.stack([kinetic, density]) @ WEIGHTS)
    return energies


def _features(data: Data, cut: Cut) -> tuple[tuple[float, float], ...]:
    fields = len(data.scene.unknowns)
    about = np.append(data.known.mean(axis=1)[:fields], np.zeros(len(data.rows) - fields))  # all of a parameter is its size
    size = np.abs(cut.at(NODES) - about[:, None, None]).max(axis=(1, 2))
    size = np.where(size > 1e3 * data.rounding, size, np.inf)[:, None, None]
    first, second = cut.at(NODES, 1), cut.at(NODES, 2)
    rate = np.maximum(np.abs(first) / size, np.sqrt(np.abs(second) / size / 2)).max(axis=0).ravel()
    s = (cut.edges[:-1, None] + cut.width[:, None] / 2 * (1 + NODES)).ravel()
    narrow = np.flatnonzero(rate > NARROW / data.length)
    runs = np.split(narrow, np.flatnonzero(np.diff(s[narrow]) > data.length / NARROW) + 1) if narrow.size else []
    return tuple((float(s[run[0]] + s[run[-1]]) / 2, float(1 / rate[run].max())) for run in runs)
