"""Field equations and momentum maps from a Lagrangian with nonholonomic constraints (section 2 of the paper), with SymPy.

Fields y^a are functions of the coordinates x^mu, time first: (t, s) for a rod. L depends on their derivatives up to the second
order, constraints phi^alpha up to the first. Sums over second derivatives run over ordered pairs (nu, mu), so the paper's
dL/dy_{nu mu} is half of SymPy's derivative if nu and mu differ. With the momenta

    p_a^nu = dL/dy^a_nu - D_mu (dL/dy^a_{nu mu}),   D_mu = d/dx^mu along a section,

the Euler-Lagrange expression (2ndEL) is E_a = dL/dy^a - D_nu p_a^nu.

Constraint forces are Chetaev's, (constrforms): Phi^alpha = A^alpha_a dy^a, A^alpha_a = dphi^alpha/dy^a_0. The nonholonomic field
equations are E_a = lambda_alpha A^alpha_a and phi^alpha = 0 (eq:nh). The vakonomic equations, for comparison, are those of the
Lagrangian L + lambda_alpha phi^alpha. There the multipliers are fields, and their derivatives occur.

**Momentum map.** A generator xi = xi^mu d/dx^mu + xi^a d/dy^a moves a section by Q^a = xi^a - y^a_mu xi^mu. Sorted by contact
forms, the Cartan form (2ndcartan) reads

    Theta = L d^{n+1}x + p_a^nu (dy^a - y^a_sigma dx^sigma) ^ d^n x_nu
            + dL/dy^a_{nu mu} (dy^a_nu - y^a_{nu sigma} dx^sigma) ^ d^n x_mu.

Contact forms vanish along a section, and their contractions with the prolonged xi are Q^a and D_nu Q^a. The momentum map along a
section is

    J_xi = j^mu d^n x_mu,   j^mu = L xi^mu + p_a^mu Q^a + dL/dy^a_{nu mu} D_nu Q^a,

for a rod j^0 ds - j^1 dt. Integration by parts gives D_mu j^mu = pr xi(L) + L D_mu xi^mu - Q^a E_a. The first two terms vanish for
a symmetry of L. By the field equations the last one is -lambda_alpha A^alpha_a Q^a. Along a section, A^alpha_a Q^a d^n x_0 is the
contraction of xi with the form A^alpha_a (dy^a - y^a_mu dx^mu) ^ d^n x_0 of (bundleF). If it vanishes too, J_xi is conserved
(NHnoether). Otherwise this is the nonholonomic momentum equation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import sympy as sy
from sympy.core.function import AppliedUndef

Generator = Mapping[sy.Expr, sy.Expr]  # by coordinate and field


def _simple(expression: sy.Expr) -> sy.Expr:
    """A simplified expression. Most zeros only need expanding, which is much faster."""
    expanded = sy.expand(expression)
    return expanded if expanded == 0 else sy.simplify(expanded)


class Noether(NamedTuple):
    """Whether a generator gives a conservation law.

    Attributes
    ----------
    invariance : pr xi(L) + L D_mu xi^mu; 0 for a symmetry of the Lagrangian.
    work : for each constraint, xi contracted with its reaction force, A^alpha_a Q^a on the constraint manifold.
    """

    invariance: sy.Expr
    work: tuple[sy.Expr, ...]

    @property
    def conserved(self) -> bool:
        """Whether the momentum is conserved for all multipliers: neither L nor the constraint forces give a source."""
        return self.invariance == 0 and not any(self.work)


@dataclass(frozen=True)
class FieldTheory:
    """A Lagrangian field theory of second order with nonholonomic constraints of first order.

    Parameters
    ----------
    lagrangian : L, an expression in the fields and their first and second derivatives.
    fields : y^a, applied functions of the same coordinates, time first, such as Function("x")(t, s).
    constraints : phi^alpha, expressions in the fields and their first derivatives that are zero. Their derivatives with respect to
        the time derivatives of the fields must be independent. A constraint without time derivatives, such as inextensibility, has
        no Chetaev force. It belongs in L, with its multiplier among the fields.

    Raises
    ------
    ValueError : for fields of different coordinates, derivatives of too high an order, or dependent constraints.
    """

    lagrangian: sy.Expr
    fields: Sequence[AppliedUndef]
    constraints: Sequence[sy.Expr] = ()

    def __post_init__(self) -> None:
        for name in ("fields", "constraints"):
            value = getattr(self, name)
            object.__setattr__(self, name, tuple(value) if isinstance(value, (tuple, list)) else (value,))
        self._check_fields()
        object.__setattr__(self, "lagrangian", self._expression("the Lagrangian", self.lagrangian, 2))
        object.__setattr__(self, "constraints", tuple(self._expression("a constraint", phi, 1) for phi in self.constraints))
        forces = sy.Matrix(len(self.constraints), len(self.fields), [a for row in self.forces for a in row])
        if forces.rank() < len(self.constraints):
            raise ValueError(
                "constraints must be independent in the fields' time derivatives (one without them belongs in the Lagrangian, "
                f"with a multiplier among the fields); got {self.constraints}"
            )

    def _check_fields(self) -> None:
        for y in self.fields:
            if not isinstance(y, AppliedUndef) or not y.args or not all(a.is_Symbol for a in y.args):
                raise ValueError(f"fields must be functions of coordinates, such as Function('x')(t, s); got {y!r}")
        if not self.fields or any(y.args != self.fields[0].args for y in self.fields):
            raise ValueError(f"fields must depend on the same coordinates in the same order; got {self.fields}")

    def _expression(self, name: str, value: object, order: int) -> sy.Expr:
        try:
            expression = sy.sympify(value).doit()
        except (sy.SympifyError, AttributeError):
            raise ValueError(f"{name} must be a SymPy expression; got {value!r}") from None
        for derivative in expression.atoms(sy.Derivative):
            if derivative.expr in self.fields and derivative.derivative_count > order:
                raise ValueError(f"{name} must have derivatives of order {order} at most; got {derivative}")
        return expression

    @property
    def coordinates(self) -> tuple[sy.Symbol, ...]:
        """x^mu, time first."""
        coordinates: tuple[sy.Symbol, ...] = self.fields[0].args
        return coordinates

    @property
    def rates(self) -> tuple[sy.Expr, ...]:
        """y^a_0, the time derivatives of the fields."""
        return tuple(y.diff(self.coordinates[0]) for y in self.fields)

    @property
    def multipliers(self) -> tuple[sy.Expr, ...]:
        """lambda_alpha, one function of the coordinates for each constraint."""
        return tuple(sy.Function(f"lambda_{a}")(*self.coordinates) for a in range(1, len(self.constraints) + 1))

    @cached_property
    def forces(self) -> tuple[tuple[sy.Expr, ...], ...]:
        """A^alpha_a = dphi^alpha/dy^a_0, the Chetaev forces (constrforms): a row for each constraint, an entry for each field."""
        return tuple(tuple(phi.diff(rate) for rate in self.rates) for phi in self.constraints)

    # Coefficients of the Cartan form, without zeros

    @cached_property
    def _first(self) -> dict[tuple[sy.Expr, sy.Symbol], sy.Expr]:
        """dL/dy_nu by field and coordinate."""
        every = {(y, nu): self.lagrangian.diff(y.diff(nu)) for y in self.fields for nu in self.coordinates}
        return {key: value for key, value in every.items() if value != 0}

    @cached_property
    def _second(self) -> dict[tuple[sy.Expr, sy.Symbol, sy.Symbol], sy.Expr]:
        """dL/dy_{nu mu} by field and ordered pair of coordinates."""
        pairs = [(nu, mu) for nu in self.coordinates for mu in self.coordinates]
        every = {(y, *pair): self.lagrangian.diff(y.diff(*pair)) / len(set(pair)) for y in self.fields for pair in pairs}
        return {key: value for key, value in every.items() if value != 0}

    @cached_property
    def _momenta(self) -> dict[tuple[sy.Expr, sy.Symbol], sy.Expr]:
        """p^nu by field and coordinate."""
        momenta = {(y, nu): self._first.get((y, nu), sy.S.Zero) for y in self.fields for nu in self.coordinates}
        for (y, nu, mu), value in self._second.items():
            momenta[y, nu] -= value.diff(mu)
        return momenta

    # Field equations

    def euler_lagrange(self) -> tuple[sy.Expr, ...]:
        """E_a, one expression for each field (2ndEL), without constraint forces."""
        divergence = {y: sum(self._momenta[y, nu].diff(nu) for nu in self.coordinates) for y in self.fields}
        return tuple(sy.expand(self.lagrangian.diff(y) - divergence[y]) for y in self.fields)

    def equations(self, *, vakonomic: bool = False) -> tuple[sy.Expr, ...]:
        """The expressions that vanish along a solution, one for each field. With `constraints` they form a closed system.

        Parameters
        ----------
        vakonomic : False for E_a - lambda_alpha A^alpha_a (eq:nh), True for the Euler-Lagrange expressions of L + lambda_alpha
            phi^alpha.
        """
        if vakonomic:
            extended = sum((m * phi for m, phi in zip(self.multipliers, self.constraints, strict=True)), self.lagrangian)
            return FieldTheory(extended, self.fields).euler_lagrange()
        reaction = [sum(m * row[a] for m, row in zip(self.multipliers, self.forces, strict=True)) for a in range(len(self.fields))]
        return tuple(sy.expand(e - r) for e, r in zip(self.euler_lagrange(), reaction, strict=True))

    # Symmetries

    def _moves(self, xi: Generator) -> tuple[dict[sy.Symbol, sy.Expr], dict[sy.Expr, sy.Expr]]:
        """xi^mu by coordinate, and Q^a by field."""
        known = (*self.coordinates, *self.fields)
        given = {key: sy.sympify(value) for key, value in xi.items()}
        for key, value in given.items():
            if key not in known:
                raise ValueError(f"a generator's keys must be among {', '.join(map(str, known))}; got {key}")
            if value.has(sy.Derivative):
                raise ValueError(f"a generator must depend on coordinates and fields only; got {value} along {key}")
        base = {mu: given.get(mu, sy.S.Zero) for mu in self.coordinates}
        return base, {y: given.get(y, sy.S.Zero) - sum(y.diff(mu) * base[mu] for mu in base) for y in self.fields}

    def momentum(self, xi: Generator) -> tuple[sy.Expr, ...]:
        """The momentum map along a section: density and flux (j^0, j^1), with D_t j^0 + D_s j^1 = 0 if it is conserved.

        As a form it is j^0 ds - j^1 dt, with d^2 x = dt ^ ds (see the module). The density for {t: 1} is minus the energy density.

        Parameters
        ----------
        xi : the components of the generator by coordinate and field; components left out are 0. {t: 1} is d/dt, {x: y, y: -x} is
            y d/dx - x d/dy. Components are functions of coordinates and fields.

        Raises
        ------
        ValueError : for a key that is neither a coordinate nor a field, or a component with derivatives.
        """
        base, moves = self._moves(xi)
        current = {mu: self.lagrangian * base[mu] for mu in base}
        for (y, mu), p in self._momenta.items():
            current[mu] += p * moves[y]
        for (y, nu, mu), second in self._second.items():
            current[mu] += second * moves[y].diff(nu)
        return tuple(sy.expand(j) for j in current.values())

    def noether(self, xi: Generator) -> Noether:
        """Whether a generator, as for `momentum`, is a symmetry of the Lagrangian and is annihilated by the constraint forces.

        Along solutions D_mu j^mu = invariance - lambda_alpha work^alpha. L itself must be invariant, as in the paper. For a
        symmetry up to a divergence the invariance is that divergence.

        Raises
        ------
        ValueError : as for `momentum`, and for constraints that SymPy cannot solve for the time derivatives of the fields.
        """
        base, moves = self._moves(xi)
        # pr xi(L) = xi^mu D_mu L + Q^a dL/dy^a + D_mu Q^a dL/dy^a_mu + D_mu D_nu Q^a dL/dy^a_{mu nu}
        change = sum((self.lagrangian * along).diff(mu) for mu, along in base.items())
        change += sum(q * self.lagrangian.diff(y) for y, q in moves.items())
        change += sum(moves[y].diff(mu) * first for (y, mu), first in self._first.items())
        change += sum(moves[y].diff(mu, nu) * second for (y, mu, nu), second in self._second.items())
        work = [sum(a * q for a, q in zip(row, moves.values(), strict=True)) for row in self.forces]
        return Noether(_simple(change), tuple(self._on_constraints(w) for w in work))

    def _on_constraints(self, expression: sy.Expr) -> sy.Expr:
        """An expression in first derivatives, evaluated on the constraint manifold: on a branch where it is not 0, if any."""
        for branch in self._branches:
            value = _simple(expression.xreplace(branch))
            if value != 0:
                return value
        return sy.S.Zero

    @cached_property
    def _branches(self) -> list[dict[sy.Expr, sy.Expr]]:
        """All solutions of the constraints for as many time derivatives."""
        for chosen in combinations(range(len(self.fields)), len(self.constraints)):
            block = sy.Matrix(len(chosen), len(chosen), [row[a] for row in self.forces for a in chosen])
            if sy.simplify(block.det()) == 0:
                continue
            names = {self.rates[a]: sy.Dummy() for a in chosen}
            try:
                found = sy.solve([phi.xreplace(names) for phi in self.constraints], list(names.values()), dict=True)
            except NotImplementedError:
                continue
            if found:
                return [{rate: branch[name] for rate, name in names.items()} for branch in found]
        raise ValueError(f"constraints must be solvable for the fields' time derivatives; got {self.constraints}")
