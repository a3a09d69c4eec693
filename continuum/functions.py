"""The functions in which a field is expanded: polynomials between free ends, Fourier series on a closed rod."""

from functools import lru_cache
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from continuum.density import Density
from continuum.element_grid import lobatto
from continuum.gauss import gauss
from continuum.parameters import sample
from continuum.rod import Rod
from discs.arrays import Float

FINER = 1.5  # points per node: products of three polynomials are integrated exactly
SOFTEST = 1e-4  # least bending stiffness over the largest

Coefficients: TypeAlias = NDArray[np.floating]  # of polynomials, as NumPy's stubs have them


class Derivatives(Protocol):
    """The matrix (S, n) from values at the nodes, or coefficients, to the m-th derivatives at places s (S,); m = 0, 1, 2."""

    def __call__(self, s: Float, m: int = 0, /) -> Float: ...


class Functions(NamedTuple):
    """n functions of s. The line is given by coefficients, roll and its rate by values at nodes.

    s, w : (n,), the nodes and their shares of the length. there, shares : (F,), the same for the finer points.
    bends : (n + 3 F, n), from coefficients to z at the nodes, then to z, z', z'' at F finer points (less the shift of a closed
        rod). They are for headings: the highest functions are damped by `smooth`.
    rates : (3 F, n), from values at the nodes to the field and its two derivatives at the finer points.
    project : (n, F + n), from f'' at the finer points and f at the nodes to the coefficients of P f.
    bending : (n,); int |r''|^2 is the sum of this times |coefficient|^2. torsion : (n, n), the matrix of int theta'^2.
    line, field : see `Derivatives`; those of the line take coefficients.
    ends : number of leading coefficients that are r at the ends.
    """

    s: Float
    w: Float
    there: Float
    shares: Float
    bends: Float
    rates: Float
    project: Float
    bending: Float
    torsion: Float
    line: Derivatives
    field: Derivatives
    ends: int


def smooth(order: Float) -> Float:
    """Factors that remove the highest functions from headings, for order/highest in [0, 1]: exp(-36 order^16).

    The motion r. = i R omega r' alone is like the Cauchy-Riemann equations: a wave of number q grows at the rate R omega q. Bending
    stops the growth, by changes of omega. For the highest functions of r this fails, because e omega would need still higher ones.
    So the highest functions must not affect headings. (A steeper factor, as exp(-36 order^36) of Hou and Li, 2007, gives
    neighbouring functions unequal factors, and some growth remains.)
    """
    return np.exp(-36.0 * order**16)


@lru_cache(maxsize=16)
def polynomials(n: int, density: Density) -> Functions:
    """Polynomials of degree n - 1 in the coordinate xi of the density, between free ends.

    The coefficients of r are its values at the ends, then the coefficients of r'' in polynomials in xi that are orthonormal in s.
    These polynomials are integrated in s by Legendre series in xi: of degree n if s is linear in xi, which is exact, otherwise of a
    much higher degree.
    """
    length, modes = density.length, 3 * n + 300 if density.centres else n
    points, weights = gauss(modes + 1)
    stretch = 1 / density.rate(density.place(points))[:, None]  # ds/dxi
    series = (legendre.legvander(points, modes) * weights[:, None]).T * (np.arange(modes + 1) + 0.5)[:, None]
    values = legendre.legvander(points, n - 3)
    _, r = np.linalg.qr(values * np.sqrt(weights[:, None] * stretch))
    second = np.linalg.inv(r) * np.sign(np.diag(r))  # columns are functions, by their Legendre coefficients
    first = legendre.legint(series @ (values @ second * stretch), lbnd=-1)
    zeroth = legendre.legint(series @ (legendre.legval(points, first).T * stretch), lbnd=-1)
    # slope of the straight line that makes the functions vanish at both ends
    tilt = (legendre.legval(1.0, zeroth) - legendre.legval(-1.0, zeroth)) / length
    to_legendre = np.linalg.inv(legendre.legvander(lobatto(n - 1)[0], n - 1))
    derivatives = [legendre.legder(to_legendre, m) for m in range(3)]

    def value(xi: Float, functions: Coefficients) -> Float:
        return (legendre.legvander(xi, len(functions) - 1) @ functions).astype(np.float64, copy=False)

    def slope(xi: Float) -> Float:
        ends = np.full(xi.size, 1 / length)
        return np.column_stack([-ends, ends, value(xi, first) - tilt])

    def line(s: Float, m: int = 0) -> Float:
        xi = density.coordinate(s)
        if m == 0:
            return np.column_stack([1 - s / length, s / length, value(xi, zeroth) - np.outer(s, tilt)])
        return slope(xi) if m == 1 else np.hstack([np.zeros((s.size, 2)), value(xi, second)])

    def field(s: Float, m: int = 0) -> Float:
        xi = density.coordinate(s)
        found = value(xi, derivatives[m]) * density.rate(s)[:, None] ** m
        return found if m < 2 else found + value(xi, derivatives[1]) * density.change(s)[:, None]

    x, w, _ = lobatto(n - 1)
    s = density.place(x)
    fine, wf = gauss(int(np.ceil(FINER * n)))
    there = density.place(fine)
    rate = density.rate(there)[:, None]
    wf = wf / rate[:, 0]
    bend = value(fine, second)
    none = np.zeros((fine.size, 2))
    curved = [np.hstack([none, bend]), np.hstack([none, value(fine, legendre.legder(second)) * rate])]
    project = np.zeros((n, fine.size + n))
    project[0, fine.size] = project[1, -1] = 1
    project[2:, : fine.size] = (bend * wf[:, None]).T
    rates = [field(there, m) for m in range(3)]
    return Functions(
        s=s,
        w=w / density.rate(s),
        there=there,
        shares=wf,
        bends=np.vstack([slope(x), slope(fine), *curved]) * smooth(np.concatenate([[0, 0], np.arange(n - 2) / (n - 3)])),
        rates=np.vstack(rates),
        project=project,
        bending=np.concatenate([[0, 0], np.ones(n - 2)]),
        torsion=(rates[1].T * wf) @ rates[1],
        line=line,
        field=field,
        ends=2,
    )


@lru_cache(maxsize=16)
def waves(n: int, density: Density) -> Functions:
    """The first n (odd) of 1, cos, sin, ... on a closed rod. The coefficients of r are those of the series."""
    length = density.length
    q = 2 * np.pi / length * np.repeat(np.arange(1.0, n // 2 + 1), 2)
    phase = np.tile([0.0, -np.pi / 2], n // 2)
    s, count = length / n * np.arange(float(n)), int(np.ceil(FINER * n))
    fine = length / count * np.arange(float(count))

    def value(s: Float, m: int = 0) -> Float:
        """The m-th derivatives at s, (S, n)."""
        return np.column_stack([np.full(s.size, m == 0), q**m * np.cos(np.outer(s, q) + phase + m * np.pi / 2)])

    fit = np.linalg.inv(value(s))
    square = np.full(n - 1, length / 2)  # int of cos^2
    project = np.zeros((n, count + n))
    project[0, count:] = 1 / n
    project[1:, :count] = -(value(fine)[:, 1:] * (length / count)).T / (q**2 * square)[:, None]
    twist = value(fine, 1) @ fit
    return Functions(
        s=s,
        w=np.full(n, length / n),
        there=fine,
        shares=np.full(count, length / count),
        bends=np.vstack([value(s, 1), *(value(fine, m) for m in (1, 2, 3))]) * smooth(np.concatenate([[0], q / q[-1]])),
        rates=np.vstack([value(fine, m) @ fit for m in range(3)]),
        project=project,
        bending=np.concatenate([[0.0], q**4 * square]),
        torsion=length / count * twist.T @ twist,
        line=value,
        field=lambda s, m=0: value(s, m) @ fit,
        ends=0,
    )


def unresolved(given: Functions, rod: Rod, s: Float, w: Float) -> float:
    """The part of a rod's parameters that functions miss: the largest int |L (p - p through the nodes)|/int p.

    L is the projection on polynomials of degree n/4. What a smooth p has beyond the functions is short waves, which hardly matter;
    what is narrower than the nodes are apart changes long waves too.

    s, w : places and weights (S,) of a quadrature.
    """
    missed, low = [], legendre.legvander(2 * s / rod.length - 1, given.s.size // 4)
    unit = (2 * np.arange(low.shape[1]) + 1) / rod.length
    for name, function in rod.varying.items():
        known, there = (sample(name, function, places) for places in (given.s, s))
        off = low @ (unit * (low.T @ (w * (given.field(s) @ known - there))))
        missed.append(float(w @ np.abs(off)) / max(float(w @ there), 1e-300))
    return max(missed)


def weighted(given: Functions, rod: Rod) -> Functions:
    """Functions with the parameters of a rod that vary in their integrals, K, beta and R: with them K = beta = R = 1.

    The weak form keeps its shape, with

        int K Re(conj(r'') (e psi)'') + beta theta' psi',   e psi = i h(z) (R psi).

    r'' is expanded in functions that are orthonormal with the weight K: if G = L L^T is the matrix of int K phi_k phi_l for the
    given ones, the coefficients a = L^-T b have int K |r''|^2 = |b|^2. P projects with this weight, so that int K Re(conj(r'') f'')
    is still the same for f and P f, for every r''. R psi is the function through R psi at the nodes: columns of matrices that act
    on psi there are multiplied by R, and R is not differentiated.

    Raises
    ------
    ValueError : where K is below a ten-thousandth of its largest value: a line that rolls and does not bend is ill posed.
    """
    at, nodes = rod.at(given.there), rod.at(given.s)
    softest = int(np.argmin(nodes.bending_stiffness))
    if nodes.bending_stiffness.ndim and nodes.bending_stiffness[softest] < SOFTEST * nodes.bending_stiffness.max():
        raise ValueError(
            f"bending_stiffness must not fall below {SOFTEST:g} of its largest value for method='spectral', as functions do not "
            f"resolve motions there; got {nodes.bending_stiffness[softest]:.3g} at s = {given.s[softest]:.4g}: take a larger one, "
            "or method='richardson'"
        )
    first = int(np.count_nonzero(given.bending == 0))  # coefficients that do not bend
    finer = given.there.size
    bent = given.project[first:, :finer] * given.bending[first:, None]  # the second derivatives, times the shares
    heavy = bent * at.bending_stiffness
    back = np.linalg.inv(np.linalg.cholesky(heavy @ (bent / given.shares).T))
    project = given.project.copy()
    project[first:, :finer] = back @ heavy
    project[:, finer:] *= nodes.radius
    bends = given.bends.copy()
    bends[:, first:] = bends[:, first:] @ back.T
    twist = given.rates[finer : 2 * finer]

    def line(s: Float, m: int = 0) -> Float:
        values = given.line(s, m)
        values[:, first:] = values[:, first:] @ back.T
        return values

    return given._replace(
        bends=bends,
        rates=given.rates * nodes.radius,
        project=project,
        bending=np.where(given.bending == 0, 0.0, 1.0),
        torsion=(twist.T * (given.shares * at.torsion_stiffness)) @ twist,
        line=line,
    )
