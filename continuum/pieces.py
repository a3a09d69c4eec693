"""Piecewise Legendre polynomials of the initial fields and of parameters that vary, by bisection; see `continuum.initial`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from continuum.gauss import gauss
from continuum.parameters import sample
from continuum.rod import Scene
from discs.arrays import Bool, Float, Int

POINTS = 16  # Gauss nodes of a piece
PROBES = 8192
SMALL = 1e-12  # misfit allowed, relative to the size of the field
NOISE = 1e-9  # relative misfit that counts as rounding of the given data if both halves of a piece have it too
TINY = 1e-9  # of the length: shorter pieces contain a corner or a jump
SHORTEST = 2.0**-43  # of the length: smallest width, as places are rounded
MOST = 4096  # pieces bisected at once
EPS = np.finfo(float).eps
PLACE, WHOLE = {"s": "place", "t": "time"}, {"s": "length", "t": "duration"}  # words for messages

NODES, WEIGHTS = gauss(POINTS)
_OTHERS = 2 * np.modf(0.5 + np.arange(1, 9) * (5**0.5 - 1) / 2)[0] - 1
_BOTH = np.concatenate([NODES, _OTHERS])
EXPAND = (legendre.legvander(NODES, POINTS - 1) * WEIGHTS[:, None]).T * (np.arange(POINTS) + 0.5)[:, None]
_AT_OTHERS = legendre.legvander(_OTHERS, POINTS - 1)
ENDS = np.array([-1.0, 1.0])


class Sampled:
    """Functions of one variable on [0, length] as rows (F, ...); the size of each and the misfit allowed.

    Parameters
    ----------
    read : returns the functions at places (n,), as rows (F, n).
    names : of the functions, for messages.
    unit : (F,), sizes that count as one for rounding.
    letter : of the variable, for messages.
    """

    def __init__(
        self, read: Callable[[Float], ArrayLike], length: float, names: tuple[str, ...], unit: ArrayLike = 0.0, letter: str = "s"
    ) -> None:
        self.length, self.names, self.letter, self._read = length, names, letter, read
        cells = np.arange(PROBES)
        self.probes = length * (cells + np.modf(0.5 + cells * (5**0.5 - 1) / 2)[0]) / PROBES
        raw = np.asarray(read(self.probes))
        self.chord, self.unit = self._chords(raw), np.broadcast_to(unit, len(raw))
        self.known = raw - np.outer(self.chord, self.probes)
        self.size = np.abs(self.known - self.known.mean(axis=1, keepdims=True)).max(axis=1)
        self.rounding = 64 * EPS * np.maximum(np.abs(raw).max(axis=1), self.unit)
        self.allowed = SMALL * self.size + self.rounding

    def _chords(self, raw: Float) -> Float:
        """Slopes that are subtracted from each function, (F,), given the functions at the probes."""
        return np.zeros(len(raw))

    def read(self, s: Float) -> Float:
        """The functions at places (n,) less their chord, (F, n)."""
        return np.asarray(self._read(s)) - np.outer(self.chord, s)

    def refuse(self, row: int, what: str, cure: str) -> NoReturn:
        """Raise ValueError about a function. The message says so if its values depend on the other places asked for."""
        apart = np.abs(self.read(self.probes[::2]) - self.known[:, ::2]).max(axis=1)
        if (apart > 1e3 * self.allowed).any():
            name = self.names[int(np.argmax(apart))]
            raise ValueError(
                f"{name} must be a function of the {PLACE[self.letter]}: its values change with what other "
                f"{PLACE[self.letter]}s are asked for; tabulate it once and interpolate"
            )
        raise ValueError(f"{self.names[row]} {what}; {cure}")


class Data(Sampled):
    """The initial fields of a scene, x and y less their chord, and the parameters of its rod that vary.

    rows : their names in code.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, length, varying = scene, scene.rod.length, scene.rod.varying
        self.rows = (*scene.unknowns, *varying)
        units = {"x": length, "y": length, "omega": 1 / scene.duration, "phi_rate": 1 / scene.duration}
        unit = [units.get(name, 1.0) for name in scene.unknowns] + [1.0 for _ in varying]
        names = (*(f"initial {name}" for name in scene.unknowns), *varying)

        def read(s: Float) -> list[Float]:
            return [*scene.fields(s).values(), *(sample(name, function, s) for name, function in varying.items())]

        super().__init__(read, length, names, unit)

    def _chords(self, raw: Float) -> Float:
        chord = np.zeros(len(raw))
        chord[:2] = (raw[:2, -1] - raw[:2, 0]) / (self.probes[-1] - self.probes[0])
        return chord


@dataclass(eq=False)
class Cut:
    """Pieces of the length, and Legendre coefficients of the fields on them.

    edges : (P + 1,). c : (F, P, 16), coefficients. misfit : (F,), largest misfit of each field. lost : (P,), whether a piece is not
    resolved at the smallest width. worst : (P,), the field with the largest misfit.
    """

    edges: Float
    c: Float
    misfit: Float
    lost: Bool
    worst: Int

    @property
    def width(self) -> Float:
        return np.diff(self.edges)

    def breaks(self) -> list[float]:
        """Places of corners and jumps: in each run of tiny pieces, the middle of the shortest."""
        width = self.width
        tiny = np.flatnonzero(width < TINY * self.edges[-1])
        runs = np.split(tiny, np.flatnonzero(np.diff(tiny) > 1) + 1) if tiny.size else []
        middles = [self.edges[p] + width[p] / 2 for p in (run[np.argmin(width[run])] for run in runs)]
        least = TINY * self.edges[-1]
        return [float(s) for s in middles if least < s < self.edges[-1] - least]

    def at(self, x: Float, derivative: int = 0) -> Float:
        """Fields, or derivatives with respect to s, at places x (n,) in [-1, 1] of every piece, (F, P, n)."""
        polynomials = legendre.legder(np.eye(self.c.shape[-1]), derivative) if derivative else np.eye(self.c.shape[-1])
        values = legendre.legvander(x, len(polynomials) - 1) @ polynomials
        return self.c @ values.T * (2 / self.width[:, None]) ** derivative


def split(data: Sampled, edges: Float) -> Cut:
    """Bisect pieces until they are resolved or too short to be cut."""
    kept: list[tuple[Float, Float, Float, Float, Bool, Int]] = []
    lo, hi = edges[:-1], edges[1:]
    before = np.full((len(data.size), lo.size), np.inf)  # misfits of the pieces before they were cut
    while lo.size:
        half = (hi - lo) / 2
        values = data.read((lo[:, None] + half[:, None] * (1 + _BOTH)).ravel()).reshape(len(data.size), lo.size, -1)
        nodes = values[..., :POINTS]
        c = nodes @ EXPAND.T
        misfit = np.maximum(np.abs(c[..., -3:]).max(axis=-1), np.abs(c @ _AT_OTHERS.T - values[..., POINTS:]).max(axis=-1))
        slope = (np.abs(np.diff(nodes)) / np.diff(NODES)).max(axis=-1) / half
        allowed = data.allowed[:, None] + 8 * EPS * data.length * slope  # for the rounding of places
        good = (misfit <= allowed).all(axis=0)
        misfit = np.maximum(misfit, _misfit_at_probes(data, lo, hi, c, good))
        noise = (misfit <= NOISE * data.size[:, None]) & _in_both_halves(misfit > before / 4)
        ratio = np.where(noise, 0.0, misfit / np.maximum(allowed, 1e-300))  # a function that vanishes is allowed nothing
        lost = (ratio > 1).any(axis=0) & (hi - lo < 2 * SHORTEST * data.length)
        good = (ratio <= 1).all(axis=0) | lost
        # coefficients below rounding are dropped, as derivatives would amplify them
        c = np.where(np.abs(c) <= data.rounding[:, None, None] / 4, 0.0, c)
        kept.append(
            (lo[good], hi[good], np.moveaxis(c[:, good], 1, 0), misfit[:, good].T, lost[good], np.argmax(ratio, axis=0)[good])
        )
        lo, hi, again = lo[~good], hi[~good], ~good
        if lo.size > MOST:
            data.refuse(
                int(np.argmax(ratio[:, int(np.argmax(again))])),
                f"is not resolved by {MOST} pieces of {POINTS} points: at {data.letter} = {lo[0]:g} it varies within "
                f"{hi[0] - lo[0]:.1g}",
                f"smooth it over {WHOLE[data.letter]}/100 = {data.length / 100:g} or more",
            )
        middle = (lo + hi) / 2
        lo, hi = np.stack([lo, middle], axis=1).ravel(), np.stack([middle, hi], axis=1).ravel()
        before = np.repeat(misfit[:, again], 2, axis=1)
    low, high, coefficients, misfits, lost, worst = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    order = np.argsort(low)
    largest = np.where(lost[:, None], 0.0, misfits).max(axis=0)
    return Cut(np.append(low[order], high.max()), np.moveaxis(coefficients[order], 0, 1), largest, lost[order], worst[order])


def _in_both_halves(found: Bool) -> Bool:
    """Where `found` (F, P) holds for a piece and for its other half, its neighbour in the list; False before any cut."""
    if found.shape[1] % 2:
        return np.zeros_like(found)
    return np.repeat(found[:, ::2] & found[:, 1::2], 2, axis=1)


def _misfit_at_probes(data: Sampled, lo: Float, hi: Float, c: Float, which: Bool) -> Float:
    """Largest misfit of every field at the probes in the pieces `which`, (F, P); 0 in other pieces and in those without probes."""
    worst = np.zeros(c.shape[:2])
    first, last = np.searchsorted(data.probes, lo), np.searchsorted(data.probes, hi)
    for p in np.flatnonzero(which & (last > first)):
        x = (2 * data.probes[first[p] : last[p]] - lo[p] - hi[p]) / (hi[p] - lo[p])
        fit = c[:, p] @ legendre.legvander(x, POINTS - 1).T
        worst[:, p] = np.abs(fit - data.known[:, first[p] : last[p]]).max(axis=1)
    return worst
