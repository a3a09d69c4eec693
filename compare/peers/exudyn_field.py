r"""The chain with slaved headings in Exudyn, with its multipliers: a peer of order 2 with equal steps.

The motion uses nothing of the reduced equations of `discs.chains.slaved`. Exudyn gets

    M v. + D v + K q = f + A(q)^T lambda,   A(q) v = 0,   q. = v,

with q = (x_i, y_i, theta_i) disc by disc:

* M, D and K : an `ObjectGenericODE2` over all discs. M, diagonal, holds the discs' inertia, K is the constant Hessian of V with the
  springs of loads, D has their dampers; all are sparse and compiled. f, constant but for the signals of loads, which are a user
  function in NumPy, is zero without loads unless a ring is closed up to a shift only.
* A(q) : the rows x_i. - e_x,i theta_i. and y_i. - e_y,i theta_i., two for each disc. An `ObjectConnectorCoordinateVector` with
  velocityLevel=True takes the left side A(q) v and its derivative by v, which is A(q), from user functions. Its constant
  matrices are not enough: they multiply v and the squares of v, but not a position with a velocity.

The contact directions e of both laws of rolling come from the slopes r', a fixed combination of positions. A disc's rows of A have
entries in the disc's own columns only, so discs are taken in blocks, each with a node and a connector: a user function's matrix
must be dense, and one for the whole chain costs n**2. A block reads the positions of its neighbours from the system's state.

Exudyn's implicit trapezoidal rule, index 2, satisfies A(q) v = 0 at the end of every step. Its Newton matrix has no derivatives of
A, which the user functions cannot provide, so the iteration converges linearly. Its tolerance is not below the rounding of K q,
which grows like n**3; otherwise it fails from n = 256 on.
"""

import time as clock
from typing import Any

import exudyn as exu
import numpy as np
import scipy.sparse as sp
from exudyn import itemInterface as items

from compare.peers.peer import Cutoff, Outcome, Peer
from discs import Chain, Problem
from discs.arrays import Float
from discs.chains import stencils
from discs.chains.rolling import RollingLaw

STEPS = (45.0, 90.0, 180.0, 360.0, 720.0)
BLOCK = 16  # discs that share a node and a connector: fewer mean more calls of Python, more mean larger dense matrices


def exudyn_field_peer(problem: Problem) -> Peer:
    """Exudyn on a chain with slaved headings, of either law of rolling and any ends.

    Parameters
    ----------
    problem : a `Chain` with linear curvature.

    Returns
    -------
    Peer whose settings are numbers of steps, and whose solves are iterations of Newton's method. Its run raises `Cutoff` if its
    time is up, ArithmeticError if Newton's method fails.

    Raises
    ------
    ValueError : if V is not quadratic, or the discs have their own headings.
    """
    if not isinstance(problem.chain, Chain) or not problem.system.quadratic:
        raise ValueError("exudyn_field_peer takes a Chain with curvature='linear'")

    def run(setting: float, seconds: float) -> Outcome:
        steps = round(setting)
        container = exu.SystemContainer()
        mbs = container.AddSystem()
        rounding = _build(mbs, problem)
        # Any, as the stub of SolveSystem lacks self
        solver: Any = exu.MainSolverImplicitSecondOrder()
        settings = _settings(problem.duration, steps, rounding)
        begun = clock.process_time()
        mbs.SetPreStepUserFunction(lambda mbs, t: clock.process_time() - begun < seconds)
        success = solver.SolveSystem(mbs, settings)
        spent = clock.process_time() - begun
        if spent > seconds:
            raise Cutoff
        if not success:
            raise ArithmeticError(f"Exudyn's Newton method failed at time {solver.it.currentTime:g}")
        q = np.array(mbs.systemData.GetODE2Coordinates()).reshape(-1, 3).T
        return Outcome(np.ascontiguousarray(q), steps, 0, int(solver.it.newtonStepsCount), spent)

    tells = "trapezoidal rule, index 2, with multipliers; rolling by user functions in NumPy, not in the Newton matrix by positions"
    return Peer("Exudyn, generic", STEPS, run, tells)


def _build(mbs: Any, problem: Problem) -> float:
    """Put the chain into a system and assemble it; returns the rounding errors to expect of forces."""
    chain: Any = problem.chain
    system: Any = problem.system
    z = problem.start()
    n, q0 = system.n, z.hi
    v0 = system.forward(system.basis(system.shape(q0)), z.pi)
    at_origin = system.shape(np.zeros_like(q0))  # not zero if the chain closes up to a shift
    along, roll = system._springs.hessians()
    by_disc = np.arange(3 * n).reshape(3, n).T.ravel()

    def ordered(matrix: Any) -> Any:
        return sp.csr_array(matrix)[by_disc][:, by_disc]

    load: Any = system.load
    stiffness, push = sp.block_diag([along, along, roll]), -system.gradient(at_origin)
    more: dict[str, Any] = {}
    if load is not None:
        stiffness, push = stiffness + sp.diags_array(load.stiffness.ravel()), push + load.constant
        more["dampingMatrix"] = _container(ordered(_damping(load)))
    if load is not None and load.drives:
        more["forceUserFunction"] = lambda mbs, t, item, q, v: sum(
            float(drive.signal(t)) * drive.pattern.T.ravel() for drive in load.drives
        )
        nothing = _container(sp.csr_array((3 * n, 3 * n)))  # derivatives by positions and velocities
        more["jacobianUserFunction"] = lambda *_: nothing
    stiffness = ordered(stiffness)
    # dense first: 33 MB at N = 2048
    slope = sp.csr_array(stencils.slopes(stencils.links(np.eye(n), chain.ends), chain.k, chain.ends).T)
    offset = system.slope(at_origin)

    blocks = np.array_split(np.arange(n), max(1, round(n / BLOCK)))
    nodes = [
        mbs.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=np.zeros(3 * len(own)),
                initialCoordinates=q0[:, own].T.ravel(),
                initialCoordinates_t=v0[:, own].T.ravel(),
                numberOfODE2Coordinates=3 * len(own),
            )
        )
        for own in blocks
    ]
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=_container(sp.diags_array(system.weights.T.ravel())),
            stiffnessMatrix=_container(stiffness),
            forceVector=push.T.ravel(),
            **more,
        )
    )
    ground = mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=mbs.AddNode(items.NodePointGround())))
    radius = np.broadcast_to(np.asarray(chain.radius, float), n)
    for own, node in zip(blocks, nodes, strict=True):
        near = np.unique(slope[own].nonzero()[1])  # discs whose positions the block's headings depend on
        rolling: Any = _Rolling(mbs, slope[own][:, near].toarray(), offset[:, own], radius[own], near, chain.rolling_law)
        marker = mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=node))
        mbs.AddObject(
            items.ObjectConnectorCoordinateVector(
                markerNumbers=[ground, marker],
                scalingMarker0=np.zeros((2 * len(own), 1)),  # sets the number of rows only
                velocityLevel=True,
                constraintUserFunction=rolling.value,
                jacobianUserFunction=rolling.matrix,
            )
        )
    mbs.Assemble()
    return float(4 * np.finfo(float).eps * abs(stiffness).sum(axis=1).max() * abs(q0).max())


def _damping(load: Any) -> Any:
    """The matrix of dampers, rows x, y, theta one after the other."""
    matrix, n = sp.diags_array(load.damping.ravel()).tolil(), load.damping.shape[1]
    for j in range(1, n + 1 if load.viscosity is not None else 0):  # the link before disc j
        at = 2 * n + np.array([j - 1, j % n])
        matrix[np.ix_(at, at)] += load.viscosity[0, j] * np.array([[1, -1], [-1, 1]])
    return matrix


class _Rolling:
    """The rows of A(q) of a block of discs.

    slope, offset : r' of the block's discs from the positions of the discs `near`, (block, near), and for positions 0, (2, block).
    """

    def __init__(self, mbs: Any, slope: Float, offset: Float, radius: Float, near: Float, law: RollingLaw) -> None:
        self._state = mbs.systemData.GetODE2Coordinates  # of the present iterate, which is the current configuration
        self._slope, self._offset, self._radius, self._law = slope.T.copy(), offset, radius, law
        self._near = 3 * near + np.arange(2)[:, None]
        size, disc = len(radius), np.arange(len(radius))
        self._rows = np.zeros((2 * size, 3 * size))
        for side in range(2):
            self._rows[2 * disc + side, 3 * disc + side] = 1.0
        self._flat = self._rows.reshape(-1)  # shares the memory
        self._places = [np.ravel_multi_index((2 * disc + side, 3 * disc + 2), self._rows.shape) for side in range(2)]

    def _contact(self) -> tuple[Float, Float]:
        """e, by components."""
        slope = self._state()[self._near] @ self._slope + self._offset
        arm = self._law.arm(self._radius, slope)
        return -arm * slope[1], arm * slope[0]

    def value(self, mbs: Any, t: float, item: int, q: Float, v: Float, velocity_level: bool) -> Float:
        """A(q) v of the block."""
        ex, ey = self._contact()
        rates = np.asarray(v).reshape(-1, 3)
        rows = rates[:, :2].copy()
        rows[:, 0] -= ex * rates[:, 2]
        rows[:, 1] -= ey * rates[:, 2]
        return rows.ravel()

    def matrix(self, mbs: Any, t: float, item: int, q: Float, v: Float, velocity_level: bool) -> Float:
        """A(q) of the block, dense."""
        ex, ey = self._contact()
        self._flat[self._places[0]] = -ex
        self._flat[self._places[1]] = -ey
        return self._rows


def _container(matrix: Any) -> Any:
    """A sparse matrix in Exudyn's form, which allows no stored zeros."""
    rows = sp.csr_matrix(matrix)
    rows.eliminate_zeros()
    container = exu.MatrixContainer()
    container.SetWithSparseMatrix(rows)
    return container


def _settings(duration: float, steps: int, rounding: float) -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True  # the sparsity is constant
    integration = settings.timeIntegration
    integration.verboseMode = 0
    integration.endTime = duration
    integration.numberOfSteps = steps
    integration.newton.absoluteTolerance = max(rounding, integration.newton.absoluteTolerance)
    integration.adaptiveStep = False
    integration.automaticStepSize = False
    integration.solverType = exu.DynamicSolverType.TrapezoidalIndex2
    integration.generalizedAlpha.useNewmark = True
    integration.generalizedAlpha.useIndex2Constraints = True
    return settings
