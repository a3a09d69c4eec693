r"""The tangent of a step, and its transpose: how a small change of the state before a step changes the state after it.

A Gauss method with coefficients a, b and times c solves Y_i = y + h sum_j a_ij F(Y_j) and returns y + h sum_j b_j F(Y_j). With the
matrices A_j of the linearised equations at its stages, the tangent T is exactly

    M dY = (dy, ..., dy),   T dy = dy + h sum_j b_j A_j dY_j,   M = 1 - h (a x 1) diag(A_1, ..., A_s),

and its transpose is T^T w = w + sum_j u_j with M^T u = h (b_1 A_1^T w, ..., b_s A_s^T w). M is sparse, with the bands of the step:
T dy and T^T w take O(n). One stage is the midpoint rule; where V is not quadratic, its A_1 is that of `discs.analysis.secants`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.analysis.linear import Linearised
from discs.arrays import Float, Matrix
from discs.integrators.tableaux import Tableau


@dataclass(frozen=True, eq=False)
class Tangent:
    """The tangent of one step.

    matrices : of the linearised equations at the stages, sparse (size, size). factors : of M.
    """

    table: Tableau
    h: float
    matrices: list[Matrix]
    factors: Any

    def forward(self, dy: Float) -> Float:
        """T dy, for dy (size,) or (size, m)."""
        s, size = len(self.matrices), len(dy)
        stages = self.factors.solve(np.concatenate([dy] * s))
        parts = [
            b * (a @ stages[j * size : (j + 1) * size]) for j, (a, b) in enumerate(zip(self.matrices, self.table.b, strict=True))
        ]
        found: Float = dy + self.h * np.sum(parts, axis=0)
        return found

    def back(self, w: Float) -> Float:
        """T^T w, for w (size,) or (size, m)."""
        found: Float = w + self.stages_back(w).sum(axis=0)
        return found

    def stages_back(self, w: Float) -> Float:
        """u, (s, size) or (s, size, m): what changes of the stages' positions in phase space would add to w . y after the step."""
        right = np.concatenate([self.h * b * (a.T @ w) for a, b in zip(self.matrices, self.table.b, strict=True)])
        found: Float = self.factors.solve(right, "T").reshape(-1, *w.shape)
        return found

    def rates_back(self, w: Float, u: Float) -> Float:
        """What changes of the stages' rates would add to w . y after the step: h (b_i w + sum_j a_ji u_j), of the shape of u."""
        found: Float = self.h * (np.multiply.outer(self.table.b, w) + np.tensordot(self.table.a.T, u, 1))
        return found


def tangent(table: Tableau, h: float, stages: Sequence[Linearised]) -> Tangent:
    """The tangent of a step with these equations at its stages."""
    matrices = [lin.matrix for lin in stages]
    blocks = [[-h * weight * matrix for weight, matrix in zip(row, matrices, strict=True)] for row in table.a]
    whole = scipy.sparse.block_array(blocks, format="csc")
    factors = scipy.sparse.linalg.splu(scipy.sparse.eye_array(whole.shape[0], format="csc") + whole)
    return Tangent(table, h, matrices, factors)
