"""A `CellTheory` on a lattice of nodes: residuals, their derivatives, and steps in time.

Each part of the discrete Lagrangian is evaluated in all its cells at once. Its derivative with respect to each point of a cell is
added to the node of that point. This is the sum D_1 + ... + D_6 of (discEL). At free ends, where cells are missing, it gives the
natural conditions. A step from two levels q_{n-1}, q_n solves (discNH) and phi_d = 0 for q_{n+1} and the multipliers, by Newton's
method with exact derivatives in sparse matrices; if both are linear in the unknowns, one linear solve is enough.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.sparse as sp
import sympy as sy
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from continuum.cells import CellTheory, Part, Point, i, points
from discs import checks
from discs.arrays import Float, Int

_Compiled: TypeAlias = Callable[..., list[Float | float]]  # of the arguments (cells,), each expression


class Path(NamedTuple):
    """The result of a run.

    Attributes
    ----------
    values : (F, fields, nodes), levels 0, ..., F-1.
    multipliers : (F-2, C), lambda at levels 1, ..., F-2; constraint after constraint, each over its nodes.
    """

    values: Float
    multipliers: Float


class _Place(NamedTuple):
    """Where an argument is in u = (q_{n-1}, q_n, q_{n+1}, lambda), flat, for each cell; and its advance on further turns."""

    at: Int
    jump: Float | float = 0.0


class _Term:
    """Expressions evaluated in several cells at once and added to rows of the residual.

    Parameters
    ----------
    cells : the nodes i, (cells,).
    expressions : pairs of an expression and the rows (cells,) that it is added to.
    arguments : places of the symbols in u.
    known : index in u of the first unknown.
    """

    def __init__(
        self, cells: Int, expressions: Sequence[tuple[sy.Expr, Int]], arguments: Mapping[sy.Expr, _Place], known: int
    ) -> None:
        self._cells = cells
        self._index = np.array([place.at for place in arguments.values()], dtype=int)
        self._jump = np.array([np.broadcast_to(place.jump, cells.shape) for place in arguments.values()])
        unknown = {a: place.at - known for a, place in arguments.items() if (place.at >= known).all()}
        self.rows = np.array([rows for _, rows in expressions])
        slopes = [(e.diff(a), rows, columns) for e, rows in expressions for a, columns in unknown.items()]
        slopes = [entry for entry in slopes if entry[0] != 0]
        self.pattern = np.array([entry[1:] for entry in slopes], dtype=int).reshape(-1, 2, cells.size)
        self.linear = not any(entry[0].has(*unknown) for entry in slopes)
        self._values = self._compiled([e for e, _ in expressions], arguments)
        self._slopes = self._compiled([entry[0] for entry in slopes], arguments)

    @staticmethod
    def _compiled(expressions: Sequence[sy.Expr], arguments: Mapping[sy.Expr, _Place]) -> _Compiled:
        names = {a: sy.Dummy() for a in arguments}
        compiled: _Compiled = sy.lambdify([*names.values(), i], [e.xreplace(names) for e in expressions], "numpy", cse=True)
        return compiled

    def _evaluate(self, function: _Compiled, u: Float, count: int) -> Float:
        result = np.empty((count, self._cells.size))
        for row, value in zip(result, function(*(u[self._index] + self._jump), self._cells), strict=True):
            row[:] = value
        return result

    def values(self, u: Float) -> Float:
        """The expressions, (expressions, cells)."""
        return self._evaluate(self._values, u, len(self.rows))

    def slopes(self, u: Float) -> Float:
        """The derivatives with respect to unknowns that are not identically 0, (slopes, cells)."""
        return self._evaluate(self._slopes, u, len(self.pattern))


class Lattice:
    """A cell theory on nodes i = 0, ..., nodes - 1 with numbers for its symbols.

    Parameters
    ----------
    theory : the discrete Lagrangian and constraints.
    nodes : number of nodes.
    values : a number for every symbol of the theory, h and k included.
    closed : whether node `nodes` is node 0 again, up to `shift`; otherwise the ends are free.
    shift : advance of each field over one turn of a closed lattice, (fields,).

    Attributes
    ----------
    n_multipliers : C, the number of multipliers.
    linear : whether a step is one linear solve.

    Raises
    ------
    ValueError : for a symbol without a number, cells that leave the lattice, too few nodes for a cell, or a shift of a lattice with
        free ends.
    """

    def __init__(
        self, theory: CellTheory, nodes: int, values: Mapping[sy.Symbol, float], *, closed: bool = False, shift: ArrayLike = 0.0
    ) -> None:
        self.theory, self.closed = theory, closed
        self.nodes = checks.whole("nodes", nodes, 1)
        self._numbers = {symbol: sy.Float(checks.number(str(symbol), value)) for symbol, value in values.items()}
        self._shift = checks.field("shift", shift, len(theory.fields))
        if self._shift.any() and not closed:
            raise ValueError(f"shift belongs to a closed lattice; got shift={shift!r} with closed=False")
        self._size = len(theory.fields) * self.nodes
        self.n_multipliers = 0
        self._terms = [term for part in theory.lagrangian for term in self._stationary(part)]
        triples = zip(theory.constraints, theory.forces, theory.discrete_constraints, theory.multipliers, strict=True)
        self._terms += [self._reaction(*triple) for triple in triples]
        self.linear = all(term.linear for term in self._terms)
        self._rows = np.concatenate([term.rows.ravel() for term in self._terms])
        self._pattern = np.concatenate([term.pattern.transpose(1, 0, 2).reshape(2, -1) for term in self._terms], axis=1)

    # Assembly

    def _numeric(self, expression: sy.Expr) -> sy.Expr:
        """An expression with its symbols replaced by numbers."""
        plain = sy.sympify(expression).xreplace(self._numbers)
        names = {value: sy.Dummy() for value in plain.atoms(sy.Indexed)}
        missing = plain.xreplace(names).free_symbols - {i, *names.values()}
        if missing:
            raise ValueError(f"values must have a number for every symbol; missing: {', '.join(sorted(map(str, missing)))}")
        return plain

    def _cells(self, part: Part, reached: Sequence[Point]) -> Int:
        """The nodes i of the cells of a part, given the points it contains."""
        every = np.arange(self.nodes)
        offsets = [0] if self.closed else [0, *(p.offset for p in reached)]
        if part.cells is None:
            least = 1 + max(offsets) - min(offsets)
            checks.whole("nodes", self.nodes, least, f"a cell of {part.expression} takes as many")
            return every[-min(offsets) : self.nodes - max(offsets)]
        try:
            chosen = np.atleast_1d(every[part.cells])
        except IndexError:
            raise ValueError(f"cells must be among the {self.nodes} nodes of the lattice; got {part.cells}") from None
        if chosen.size and (chosen.min() + min(offsets) < 0 or chosen.max() + max(offsets) >= self.nodes):
            raise ValueError(f"cells must lie on the lattice of {self.nodes} nodes; {part.expression} at {part.cells} leaves it")
        return chosen

    def _place(self, point: Point, cells: Int) -> _Place:
        """Where a point of the cells is in u."""
        field = self.theory.fields.index(point.field)
        turns, nodes = np.divmod(cells + point.offset, self.nodes)
        return _Place((point.level + 1) * self._size + field * self.nodes + nodes, self._shift[field] * turns)

    def _stationary(self, part: Part) -> list[_Term]:
        """Derivatives of a part of L_d with respect to points of level n in cells (n, i), and of level n+1 in cells (n-1, i)."""
        expression, values = self._numeric(part.expression), points(part.expression)
        cells = self._cells(part, list(values.values()))
        terms = []
        for level in (0, 1):
            arguments = {value: self._place(p._replace(level=p.level - level), cells) for value, p in values.items()}
            slopes = [(expression.diff(v), arguments[v].at - self._size) for v, p in values.items() if p.level == level]
            terms += [_Term(cells, slopes, arguments, 2 * self._size)] if slopes else []
        return terms

    def _reaction(self, constraint: Part, row: Sequence[sy.Expr], phi: sy.Expr, multiplier: sy.Expr) -> _Term:
        """-lambda Phi_a in the equations and phi_d in the constraints."""
        phi, *forces = (self._numeric(e) for e in (phi, *row))
        values = points(sy.Tuple(phi, *forces))
        cells = self._cells(constraint, list(values.values()))
        rows_phi = self._size + self.n_multipliers + np.arange(cells.size)
        self.n_multipliers += cells.size
        arguments = {value: self._place(p, cells) for value, p in values.items()} | {multiplier: _Place(2 * self._size + rows_phi)}
        rows = [(-multiplier * force, a * self.nodes + cells) for a, force in enumerate(forces) if force != 0]
        return _Term(cells, [*rows, (phi, rows_phi)], arguments, 2 * self._size)

    @cached_property
    def _densities(self) -> list[_Term]:
        """The parts of L_d."""
        terms = []
        for part in self.theory.lagrangian:
            values = points(part.expression)
            cells = self._cells(part, list(values.values()))
            arguments = {value: self._place(p, cells) for value, p in values.items()}
            terms.append(_Term(cells, [(self._numeric(part.expression), cells)], arguments, 3 * self._size))
        return terms

    # Equations

    def action(self, values: ArrayLike) -> float:
        """The action sum (actionsum) of levels (F, fields, nodes), in units of h k."""
        levels = [self._level("a level", level).ravel() for level in np.asarray(values, dtype=float)]
        pairs = list(pairwise(levels))
        return float(sum(term.values(np.concatenate([now, now, after])).sum() for now, after in pairs for term in self._densities))

    def _residual(self, u: Float) -> Float:
        weights = np.concatenate([term.values(u).ravel() for term in self._terms])
        return np.bincount(self._rows, weights, self._size + self.n_multipliers).astype(np.float64, copy=False)

    def _jacobian(self, u: Float) -> sp.csc_array:
        """Derivatives of the residual with respect to q_{n+1} and the multipliers."""
        entries = np.concatenate([term.slopes(u).ravel() for term in self._terms])
        return sp.csc_array((entries, tuple(self._pattern)), shape=(self._size + self.n_multipliers,) * 2)

    def residual(self, before: ArrayLike, now: ArrayLike, after: ArrayLike, multipliers: ArrayLike = 0.0) -> tuple[Float, Float]:
        """The residual, zero for a solution of (discNH): E_a - lambda_alpha Phi^alpha_a (fields, nodes) and phi_d (C,).

        Parameters
        ----------
        before, now, after : levels n-1, n, n+1, (fields, nodes).
        multipliers : (C,), in the order of `Path`.
        """
        whole = self._residual(self._stacked(before, now, after, multipliers))
        return whole[: self._size].reshape(-1, self.nodes), whole[self._size :]

    def _stacked(self, before: ArrayLike, now: ArrayLike, after: ArrayLike, multipliers: ArrayLike) -> Float:
        given = (("before", before), ("now", now), ("after", after))
        levels = [self._level(name, level).ravel() for name, level in given]
        return np.concatenate([*levels, checks.field("multipliers", multipliers, self.n_multipliers)])

    def _level(self, name: str, given: ArrayLike) -> Float:
        level, shape = checks.array(name, given), (len(self.theory.fields), self.nodes)
        if level.shape != shape or not np.isfinite(level).all():
            raise ValueError(f"{name} must be finite and of shape {shape}, fields and nodes; got shape {level.shape}")
        return level

    def step(
        self, before: ArrayLike, now: ArrayLike, multipliers: ArrayLike = 0.0, *, tolerance: float = 1e-12, sweeps: int = 20
    ) -> tuple[Float, Float]:
        """The next level: q_{n+1} (fields, nodes), and the multipliers (C,) at level n.

        Parameters
        ----------
        before, now : levels n-1 and n, (fields, nodes).
        multipliers : initial guess for Newton's method.
        tolerance : Newton's method ends when no value changes by more than this, relative to the largest value.
        sweeps : largest number of Newton steps.

        Raises
        ------
        ValueError : for levels of another shape.
        RuntimeError : if the equations do not determine the next level, or Newton's method does not converge.
        """
        checks.iteration(sweeps, tolerance)
        u = self._stacked(before, now, 2 * np.asarray(now) - np.asarray(before), multipliers)
        unknown = u[2 * self._size :]
        change = np.inf
        for _ in range(sweeps):
            try:
                move = splu(self._jacobian(u)).solve(self._residual(u))
            except RuntimeError as reason:
                raise RuntimeError(f"the discrete field equations do not determine the next level: {reason}") from None
            unknown -= move
            change = np.abs(move[: self._size]).max()
            if not np.isfinite(change):
                break
            if self.linear or change <= tolerance * np.abs(unknown[: self._size]).max():
                return unknown[: self._size].reshape(-1, self.nodes).copy(), unknown[self._size :].copy()
        raise RuntimeError(f"Newton's method does not converge in {sweeps} sweeps (last change {change:.2g}): take a smaller h")

    def run(self, first: ArrayLike, second: ArrayLike, steps: int, *, tolerance: float = 1e-12, sweeps: int = 20) -> Path:
        """A run of `steps` steps from levels 0 and 1; parameters and errors are as for `step`."""
        steps = checks.whole("steps", steps, 1)
        values = np.empty((steps + 2, len(self.theory.fields), self.nodes))
        multipliers = np.zeros((steps, self.n_multipliers))
        values[0], values[1] = self._level("first", first), self._level("second", second)
        for m in range(steps):
            guess = multipliers[max(m - 1, 0)]
            values[m + 2], multipliers[m] = self.step(values[m], values[m + 1], guess, tolerance=tolerance, sweeps=sweeps)
        return Path(values, multipliers)
