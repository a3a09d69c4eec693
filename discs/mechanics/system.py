"""Mechanical systems: built from formulas or parts, extended by constraints, integrated in time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike

from discs import checks
from discs.arrays import Float
from discs.mechanics import motion, saddle
from discs.mechanics.bodies import Bodies
from discs.mechanics.derivatives import Formula, ShapeError
from discs.mechanics.equations import Equations, names_of
from discs.mechanics.inputs import Given, function_of
from discs.mechanics.trajectory import Trajectory

Drive: TypeAlias = ArrayLike | Callable[[float, Float], ArrayLike]


@dataclass(frozen=True, eq=False)
class MechanicalSystem(Equations):
    """A mechanical system with velocity constraints; m coordinates, c constraints.

    Make one with `discs.mechanics.lagrange.lagrange_dalembert` from discs, with `from_lagrangian` from formulas, or from its parts,
    the attributes of `discs.mechanics.equations.Equations`.
    """

    @classmethod
    def from_lagrangian(
        cls,
        names: Sequence[str],
        mass: Callable[[Float], ArrayLike] | ArrayLike,
        potential: Callable[[Float], Any],
        constraint: Callable[[Float], ArrayLike] | None = None,
        owners: Sequence[str] = (),
        drive: Drive = 0.0,
        symmetry: Callable[[Float], ArrayLike] | None = None,
        force: Callable[[float, Float, Float], ArrayLike] | None = None,
        phi: Callable[[Float, Float], ArrayLike] | None = None,
        bodies: Bodies | Callable[[Float], ArrayLike] | None = None,
    ) -> "MechanicalSystem":
        """A system from M (or M(q)), V(q) and A(q), formulas that take q (m,) and return numbers.

        Derivatives are exact to rounding where a formula also takes complex numbers, which is verified; elsewhere (`abs`,
        `np.linalg.norm`, `math.sin`, an array of zeros that is filled in) they are real differences with an error of about 1e-12:
        see `discs.mechanics.derivatives`. Formulas in `jax.numpy` are computed in double precision.

        Parameters
        ----------
        names : m names of coordinates.
        mass : M (m, m), symmetric, or q -> M.
        potential : q -> V.
        constraint : q -> A (c, m); without it, and without owners, there are no constraints.
        owners : c names, the owner of each row.
        drive : b of A v = b: c numbers, or a function t, q -> b (c,), smooth in t and q.
        symmetry : as the attribute.
        force : t, q, v -> Q (m,), generalised forces beside those of L, as of dampers and actuators; the attribute `applied`.
        phi : q, v -> phi (c,), instead of A, of constraints phi(q, v) = b that are not linear in v; the reaction is that of
            Chetaev's rule, see `discs.mechanics.equations`.
        bodies : as the attribute; movies and pages then show the motion.

        Raises
        ------
        ValueError : for arrays of a wrong shape, a formula that does not take q alone, or an M that is not symmetric.
        """
        names, owners = names_of("names", names), names_of("owners", owners)
        m, c = len(names), len(owners)
        if constraint is not None and phi is not None:
            raise ValueError("give the constraints as A(q) or as phi(q, v), not both: rows that are linear in v can be part of phi")
        if constraint is None:
            none = np.zeros((0 if phi is None else c, m))  # in the place of A
        rows = Formula("A", (lambda q: none) if constraint is None else function_of("q", "A", constraint), (c, m), m)
        height = Formula("V", function_of("q", "V", potential), (), m)
        inertia = Formula("M", function_of("q", "M", mass) if callable(mass) else lambda q: mass, (m, m), m)
        given = tuple(_shape_of(formula) for formula in (rows, inertia))
        if given != ((c, m), (m, m)):
            raise ValueError(
                f"A must be of shape {(c, m)} and M of shape {(m, m)}, for {m} names and {c} owners; got {given[0]} and {given[1]}"
            )
        constant = None if callable(mass) else inertia(np.zeros(m))
        if constant is not None:
            saddle.symmetric(constant, names)

        def of_l(q: Float, v: Float) -> Float:
            f = -height.slopes(q)
            if constant is None:
                slopes = inertia.slopes(q)  # dM_ij/dq_k
                f = f + 0.5 * np.einsum("i,ijk,j->k", v, slopes, v) - (slopes @ v) @ v
            return f

        return cls(
            names,
            owners,
            inertia if constant is None else lambda q: constant,
            lambda q: float(height(q)),
            of_l,
            rows,
            rows.along,
            drive if callable(drive) else np.asarray(drive),
            None if symmetry is None else lambda q: np.asarray(symmetry(q), dtype=float),
            (height, *(() if phi else (rows,)), *(() if constant is not None else (inertia,))),
            force,
            phi,
            bodies,
        )

    def also(self, rows: ArrayLike, owners: Sequence[str], drive: Drive = 0.0) -> "MechanicalSystem":
        """The system with more constraints, constant rows (k, m) with rows @ v = drive: a disc that is held, a motor.

        Parameters
        ----------
        rows : (k, m), coefficients of the m velocities in the k constraints.
        owners : k names for messages, as "motor of disc 3".
        drive : k numbers, or a function t, q -> k numbers.

        Raises
        ------
        ValueError : for arrays of a wrong shape, or what is not a finite number.
        """
        owners = names_of("owners", owners)
        extra = scipy.sparse.csr_array(np.atleast_2d(np.asarray(rows, dtype=float)))
        if extra.shape != (len(owners), len(self.names)):
            raise ValueError(f"rows must have shape ({len(owners)}, {len(self.names)}), one row per owner; got {extra.shape}")
        joined = _joined(self.drive, drive if callable(drive) else checks.field("drive", drive, len(owners)))
        both = (*self.owners, *owners)
        if isinstance(phi := self.phi, Given):
            return replace(self, owners=both, drive=joined, phi=lambda q, v: np.hstack([phi.call(q, v), extra @ v]))
        none = scipy.sparse.csr_array(extra.shape)
        return replace(
            self,
            owners=both,
            constraint=lambda q: scipy.sparse.vstack([scipy.sparse.csr_array(self.constraint(q)), extra], format="csr"),
            constraint_rate=lambda q, v: scipy.sparse.vstack(
                [scipy.sparse.csr_array(self.constraint_rate(q, v)), none], format="csr"
            ),
            drive=joined,
        )

    def integrate(
        self,
        q: ArrayLike,
        v: ArrayLike,
        times: ArrayLike,
        rtol: float = 1e-11,
        mu: ArrayLike | None = None,
        *,
        method: str = "auto",
        atol: ArrayLike | None = None,
        max_step: float | None = None,
        progress: bool = True,
    ) -> Trajectory:
        """The motion from q, v at times[0], integrated by SciPy's methods; for small systems.

        Explicit methods project v, and q for constraints on positions, back onto the constraints after each step. `residual` is
        the remaining error. If constraints become dependent at one moment and the motion is smooth, the integration continues:
        see `discs.mechanics.rank_drops`.

        Parameters
        ----------
        q, v : (m,), coordinates and velocities at times[0].
        times : (F,), increasing, or all decreasing.
        rtol : tolerance of a step's error, relative to each coordinate.
        mu : (c,), charges at times[0] of the vakonomic motion, see `discs.mechanics.vakonomic`; without them it is nonholonomic.
        method : "DOP853", "RK45", "RK23" (explicit), "Radau", "BDF", "LSODA" (for stiff problems), or "auto": DOP853, and
            Radau from where the problem is stiff. `Trajectory.stats` names the one used.
        atol : tolerance of a step's error, absolute: a number or one per entry of (q, v) or (q, v, mu). By default 1e-3 rtol of
            the size of each quantity.
        max_step : longest step. By default a hundredth of the time span if forces or drives depend on t; a signal that is much
            shorter than max_step may be stepped over.
        progress : show a bar after a second.

        Raises
        ------
        ValueError : if v does not obey the constraints, naming the worst owner, V is not finite, M not symmetric or not positive,
            and for arrays of a wrong shape; if forces or drives are not finite numbers of the right shape, with t.
        RuntimeError : if the motion cannot be continued, with the time and the cause.

        Warns
        -----
        UserWarning : if energy - work - reaction_work, which is constant, or a constraint, is off by over 1 %; if the formulas'
            precision is too low for rtol.
        """
        q, v = self._vectors(q, v)
        charges = None if mu is None else checks.vector("mu", mu, len(self.owners))
        return motion.integrate(self, q, v, charges, times, method, rtol, atol, progress, max_step)


def _joined(one: Any, other: Any) -> Any:
    """Both drives, arrays or functions, one after the other."""
    if not callable(one) and not callable(other):
        return np.concatenate([one, other])
    calls = [d.call if isinstance(d, Given) else d if callable(d) else lambda t, q, d=d: d for d in (one, other)]
    return lambda t, q: np.concatenate([np.atleast_1d(call(t, q)) for call in calls])


def _shape_of(formula: Formula) -> tuple[int, ...]:
    """Shape of a formula's value at q = 0; the declared one if it has no value there."""
    try:
        formula(np.zeros(formula.size))
    except ShapeError as error:
        return error.given
    except (
        ArithmeticError,
        IndexError,
        RuntimeWarning,
        ValueError,
        np.linalg.LinAlgError,
    ):  # not defined at 0: seen at the first q
        pass
    return formula.shape
