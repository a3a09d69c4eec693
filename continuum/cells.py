"""Discrete field theory on cells (sections 4.1 and 4.2 of the paper), with SymPy.

A discrete field has values y_{n,i} at time level n and node i, written y[n, i] with a SymPy IndexedBase y. The discrete Lagrangian
L_d is a function of the values in a cell (6cell): levels n and n+1, any nodes about i. The action sum is the sum of L_d over all
cells (actionsum). A value y_{n,i} belongs to several cells, and is a different point p of each. The action sum is stationary where

    E = sum_p D_p L_d (cell that has (n, i) as its point p) = 0.

These are the discrete Euler-Lagrange field equations (discEL), with D_1 + ... + D_6 for the six points of (6cell).

A constraint is first discretised in s only: phi_half, a function of the values at level n and of the velocities at (n, i), written
`velocity(y)`. Its reaction force is Phi = S*(d phi_half) = (dphi_half/dy.^a) dy^a, at node i. Replacing the velocities by
differences turns Phi into a form in the values, and phi_half into the constraint phi_d. By the discrete d'Alembert principle
(discNH)

    E_a = lambda_alpha Phi^alpha_a,   phi_d^alpha = 0.

The paper's 6-cell has no level n-1. Its section 4.3 uses level n-1 in phi_d (central differences), so constraints may use it here.

`continuum.lattice` turns a `CellTheory` into residuals and steps. Symbols of this module: n, i; the steps h in time and k in s.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import sympy as sy
from sympy.core.function import AppliedUndef

from discs import checks

n, i = sy.symbols("n i", integer=True)
h, k = sy.symbols("h k", positive=True)


class Point(NamedTuple):
    """A point of a cell: the field, its level relative to n, its node relative to i."""

    field: sy.IndexedBase
    level: int
    offset: int

    def __str__(self) -> str:
        return str(self.field[n + self.level, i + self.offset])


def points(expression: sy.Expr) -> dict[sy.Indexed, Point]:
    """The points of the cell whose values occur in an expression.

    Raises
    ------
    ValueError : for a value that is not at whole steps from [n, i].
    """
    found = {}
    for value in sorted(expression.atoms(sy.Indexed), key=str):
        steps = [index - centre for index, centre in zip(value.indices, (n, i), strict=False)]
        if len(value.indices) != 2 or not all(step.is_Integer for step in steps):
            raise ValueError(f"values of a cell must be at whole steps from [n, i], such as x[n + 1, i - 1]; got {value}")
        found[value] = Point(value.base, *map(int, steps))
    return found


def velocity(field: sy.IndexedBase) -> sy.Symbol:
    """The symbol for the velocity of a field at (n, i) in semi-discrete constraints."""
    return sy.Symbol(f"d{field.label}/dt")


def in_space(expression: sy.Expr, coordinates: tuple[sy.Symbol, sy.Symbol], forward: Iterable[AppliedUndef] = ()) -> sy.Expr:
    """Replace fields by values at (n, i), time derivatives by velocities, derivatives in s by differences: (FDeta), (FDtheta).

    y' becomes (y_{n,i+1} - y_{n,i-1})/2k, for fields in `forward` (y_{n,i+1} - y_{n,i})/k. y'' becomes the second difference.

    Parameters
    ----------
    expression : in functions of (t, s) and their derivatives y., y', y'', as for `continuum.lagrangian`.
    coordinates : (t, s).
    forward : functions whose y' becomes the forward difference.

    Raises
    ------
    ValueError : for any other derivative.
    """
    t, s = coordinates
    expression = sy.sympify(expression).doit()
    rules: dict[sy.Expr, sy.Expr] = {}
    for y in (f for f in expression.atoms(AppliedUndef) if f.args == (t, s)):
        base = sy.IndexedBase(y.func.__name__)
        before, here, after = (base[n, i + step] for step in (-1, 0, 1))
        rules |= {
            y: here,
            y.diff(t): velocity(base),
            y.diff(s): (after - here) / k if y in tuple(forward) else (after - before) / (2 * k),
            y.diff(s, 2): (before - 2 * here + after) / k**2,
        }
    unknown = sorted((d for d in expression.atoms(sy.Derivative) if d not in rules), key=str)
    if unknown:
        raise ValueError(f"derivatives must be d/d{t}, d/d{s} or d^2/d{s}^2 of fields; got {unknown[0]}")
    return expression.xreplace(rules)


def in_time(expression: sy.Expr, fields: Iterable[sy.IndexedBase], difference: str) -> sy.Expr:
    """Replace velocities by "forward", (y_{n+1,i} - y_{n,i})/h, or "central" differences, (y_{n+1,i} - y_{n-1,i})/2h."""
    back = {"forward": 0, "central": 1}[checks.choice("difference", difference, ("forward", "central"))]
    rules = {velocity(y): (y[n + 1, i] - y[n - back, i]) / ((1 + back) * h) for y in fields}
    return sy.sympify(expression).xreplace(rules)


@dataclass(frozen=True)
class Part:
    """A part of the discrete Lagrangian, summed over the cells (n, i) of some nodes i.

    Parameters
    ----------
    expression : in values of a cell, the symbols h, k and i of this module, and any other symbols.
    cells : the nodes i. None for all nodes whose cells lie on the lattice, a slice of these nodes, or a whole number for one cell
        at an end.
    """

    expression: sy.Expr
    cells: slice | int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "expression", sy.sympify(self.expression))
        if isinstance(self.cells, bool) or not isinstance(self.cells, (slice, int, type(None))):
            raise ValueError(f"cells must be None, a slice or a whole number; got {self.cells!r}")


@dataclass(frozen=True)
class Constraint(Part):
    """A constraint phi_half = 0 in values at level n and velocities at (n, i), imposed at some nodes i.

    Parameters
    ----------
    expression, cells : as for `Part`.
    discrete : phi_d, in values of the levels n-1, n, n+1; None for phi_half with differences in place of the velocities.
    """

    discrete: sy.Expr | None = None


@dataclass(frozen=True)
class CellTheory:
    """A discrete Lagrangian field theory with nonholonomic constraints.

    Parameters
    ----------
    lagrangian : L_d, per unit of s and t: an expression or a `Part`, or several that add up to L_d. At free ends a part is summed
        over the cells that have all its points on the lattice, so kinetic energy, torsion and bending must be separate parts.
    fields : the IndexedBase symbols.
    constraints : phi_half, each an expression or a `Constraint`.
    difference : the differences that replace velocities in Phi and phi_d, "central" or "forward"; see `in_time`.

    Raises
    ------
    ValueError : for unknown fields, values outside the levels allowed, and a constraint without velocities.
    """

    lagrangian: Sequence[Part]
    fields: Sequence[sy.IndexedBase]
    constraints: Sequence[Constraint] = ()
    difference: str = "central"

    def __post_init__(self) -> None:
        fields = self.fields if isinstance(self.fields, (tuple, list)) else (self.fields,)
        object.__setattr__(self, "fields", tuple(fields))
        for name, kind in (("lagrangian", Part), ("constraints", Constraint)):
            value = getattr(self, name)
            given = value if isinstance(value, (tuple, list)) else (value,)
            object.__setattr__(self, name, tuple(part if isinstance(part, kind) else kind(part) for part in given))
        checks.choice("difference", self.difference, ("forward", "central"))
        for part in self.lagrangian:
            self._check("L_d", part.expression, (0, 1))
        reached = {(p.field, p.level) for part in self.lagrangian for p in points(part.expression).values()}
        if reached != {(y, level) for y in self.fields for level in (0, 1)}:
            whole = " + ".join(str(part.expression) for part in self.lagrangian)
            raise ValueError(f"L_d must contain values of each field at levels n and n + 1; got {whole}")
        for constraint, phi, row in zip(self.constraints, self.discrete_constraints, self.forces, strict=True):
            self._check("phi_half", constraint.expression, (0,))
            self._check("phi_d", phi, (-1, 0, 1))
            if not any(row):
                raise ValueError(
                    f"a constraint must contain velocities (`velocity`), or it has no force; got {constraint.expression}"
                )

    def _check(self, name: str, expression: sy.Expr, levels: tuple[int, ...]) -> None:
        for point in points(expression).values():
            if point.field not in self.fields:
                raise ValueError(f"{name} must depend on values of {', '.join(map(str, self.fields))} only; got {point}")
            if point.level not in levels:
                allowed = ", ".join(str(n + level) for level in levels)
                raise ValueError(f"{name} must depend on values at the levels {allowed} only; got {point}")

    @property
    def multipliers(self) -> tuple[sy.Expr, ...]:
        """lambda_alpha at (n, i)."""
        return tuple(sy.IndexedBase(f"lambda_{a}")[n, i] for a in range(1, len(self.constraints) + 1))

    @cached_property
    def discrete_constraints(self) -> tuple[sy.Expr, ...]:
        """phi_d for each constraint; the paper's C_d is where they vanish."""
        return tuple(
            in_time(c.expression, self.fields, self.difference) if c.discrete is None else sy.sympify(c.discrete)
            for c in self.constraints
        )

    @cached_property
    def forces(self) -> tuple[tuple[sy.Expr, ...], ...]:
        """Phi^alpha_a, a row for each constraint and an entry for each field, with differences in place of the velocities."""
        rows = [[c.expression.diff(velocity(y)) for y in self.fields] for c in self.constraints]
        return tuple(tuple(in_time(entry, self.fields, self.difference) for entry in row) for row in rows)

    def euler_lagrange(self) -> tuple[sy.Expr, ...]:
        """E, the left side of (discEL), for each field at (n, i) away from ends; parts of a single cell are left out."""
        total = dict.fromkeys(self.fields, sy.S.Zero)
        for part in self.lagrangian:
            if not isinstance(part.cells, int):
                for value, p in points(part.expression).items():
                    total[p.field] += part.expression.diff(value).subs({n: n - p.level, i: i - p.offset}, simultaneous=True)
        return tuple(sy.expand(e) for e in total.values())

    def equations(self) -> tuple[sy.Expr, ...]:
        """E_a - lambda_alpha Phi^alpha_a (discNH) at (n, i) away from ends. `discrete_constraints` close the system."""
        inner = [a for a, c in enumerate(self.constraints) if not isinstance(c.cells, int)]
        reaction = [sum(self.multipliers[a] * self.forces[a][f] for a in inner) for f in range(len(self.fields))]
        return tuple(sy.expand(e - r) for e, r in zip(self.euler_lagrange(), reaction, strict=True))
