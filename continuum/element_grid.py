"""Gauss-Lobatto nodes on elements of a rod: weights, derivatives, sums over elements, values between nodes."""

from functools import cached_property

import numpy as np
from numpy.polynomial import legendre

from discs.arrays import Float, Int

DEGREE = 10


def lobatto(p: int) -> tuple[Float, Float, Float]:
    """Gauss-Lobatto nodes and weights on [-1, 1], (p+1,), and the derivative matrix of the polynomial of degree p through them."""
    basis = legendre.Legendre.basis(p)
    x = np.concatenate([[-1.0], np.sort(basis.deriv().roots().real), [1.0]])
    for _ in range(3):  # Newton steps on the inner roots of P_p', to round-off
        x[1:-1] -= basis.deriv()(x[1:-1]) / basis.deriv(2)(x[1:-1])
    values = basis(x)
    weights = 2 / (p * (p + 1) * values**2)
    gap = x[:, None] - x[None, :]
    np.fill_diagonal(gap, 1.0)
    d = values[:, None] / values[None, :] / gap
    np.fill_diagonal(d, 0.0)
    np.fill_diagonal(d, -d.sum(axis=1))
    return x, weights, d


class Grid:
    """The nodes of P elements of degree `DEGREE`. The last node of a closed rod is its first.

    Attributes
    ----------
    edges : (P + 1,), of the elements. half : (P, 1), half their widths. count : P. n : number of nodes.
    places, w, index : (P, DEGREE + 1), places, weights and numbers of the nodes of each element.
    d : (DEGREE + 1, DEGREE + 1), the derivative matrix of an element of width 2, transposed.
    steepest : (P, 1), the largest eigenvalue of -d^2/ds^2 on each element.
    """

    def __init__(self, edges: Float, closed: bool) -> None:
        x, w, d = lobatto(DEGREE)
        self.edges, self.closed, self.count = edges, closed, edges.size - 1
        self.half = np.diff(edges)[:, None] / 2
        self.w, self.d = self.half * w, np.ascontiguousarray(d.T)
        self.places: Float = np.minimum(edges[:-1, None] + self.half * (x + 1), edges[1:, None])
        self.n = DEGREE * self.count + (not closed)
        index = DEGREE * np.arange(self.count)[:, None] + np.arange(DEGREE + 1)
        self.index: Int = index % self.n if closed else index
        root = np.sqrt(w)
        square = ((d / root).T * w) @ (d / root)
        self.steepest: Float = np.linalg.eigvalsh(square)[-1] / self.half**2
        self._expand = np.linalg.inv(legendre.legvander(x, DEGREE)).astype(np.float64, copy=False)
        self._inner = self.n - (not closed)

    @cached_property
    def s(self) -> Float:
        """Places of the nodes, (n,)."""
        inner = self.places[:, :-1].ravel()
        return inner if self.closed else np.append(inner, self.edges[-1])

    @cached_property
    def weights(self) -> Float:
        """Share of the length of each node, (n,)."""
        return self.sum(self.w)

    def slope(self, local: Float) -> Float:
        """Derivatives by s of values on elements (..., P, DEGREE + 1)."""
        found: Float = (local @ self.d) / self.half
        return found

    def sum(self, local: Float) -> Float:
        """Sum of the values of elements (..., P, DEGREE + 1) at the nodes, (..., n)."""
        total = np.empty((*local.shape[:-2], self.n))
        inner = self._inner
        total[..., :inner] = local[..., :-1].reshape(*local.shape[:-2], -1)
        if self.closed:
            total[..., 0] += local[..., -1, -1]
        else:
            total[..., -1] = local[..., -1, -1]
        total[..., DEGREE:inner:DEGREE] += local[..., :-1, -1]
        return total

    def sample(self, local: Float, s: Float) -> Float:
        """Values on elements (..., P, DEGREE + 1) at places s (S,), (..., S)."""
        element = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, self.count - 1)
        x = (s - self.edges[element]) / self.half[element, 0] - 1
        basis = legendre.legvander(x, DEGREE) @ self._expand
        found = np.empty((*local.shape[:-2], s.size))
        for one in np.unique(element):
            inside = element == one
            found[..., inside] = local[..., one, :] @ basis[inside].T
        return found
