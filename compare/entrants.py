"""The methods compared in speed against error: ours, and the peers that are installed."""

import time as clock
from collections.abc import Callable, Sequence
from importlib.util import find_spec

import numpy as np

from compare.peers import loads, multipliers, reduced
from compare.peers.peer import Outcome, Peer
from discs import Chain, Gauss4, Gauss6, Gauss8, Integrator, Midpoint, Problem, Radau3, Radau5, Solution, Suzuki4, simulate
from discs.integrators import DOP853
from discs.loads import Linear
from discs.loads.motor import Held

EXPLICIT = 128  # discs: with more, explicit methods take steps that are far too short


def ours(problem: Problem) -> list[Peer]:
    """Our methods, with tolerances of the sweeps that fall with the step.

    The error after the last change is smaller than that change by the gain of one more sweep. The tolerances were chosen for these
    scenes, for the shortest time at a given error; "auto" has no such tolerances.
    """
    t = problem.duration

    def at_the_end(method: str | Integrator, dt: float | None = None, tol: float | None = None) -> Outcome:
        return _outcome(problem, lambda: simulate(problem, method, dt, 1, progress=False, engine="compiled", tol=tol))

    def fixed(name: str, steps: Sequence[int], method: Callable[[int], Integrator]) -> Peer:
        def run(setting: float, seconds: float) -> Outcome:
            return at_the_end(method(int(setting)), dt=t / setting)

        return Peer(name, tuple(map(float, steps)), run)

    def to_tolerance(setting: float, seconds: float) -> Outcome:
        return at_the_end("auto", tol=setting)

    def explicit(setting: float, seconds: float) -> Outcome:
        return at_the_end(DOP853(setting, 0.1 * setting))

    takes = problem.chain.n <= EXPLICIT and not isinstance(problem.system.load, Held)
    many = [round(6 * 2 ** (j / 2)) for j in range(17)]
    return [
        fixed("midpoint", many[2:], lambda m: Midpoint(tolerance=0.03 / m**2)),
        fixed("suzuki4", many[2:13], lambda m: Suzuki4(Midpoint(tolerance=max(0.01 / m**3, 1e-13)))),
        fixed("gauss4", many[:11], lambda m: Gauss4(tolerance=max(0.01 / m**3, 1e-13))),
        fixed("gauss6", many[:15], lambda m: Gauss6(tolerance=max(0.003 / m**3, 1e-13))),
        fixed("gauss8", many[2:13], lambda m: Gauss8(tolerance=max(3e-4 / m**3, 1e-13))),
        fixed("radau3", many[2:13:2], lambda m: Radau3(tolerance=max(0.01 / m**3, 1e-13))),
        fixed("radau5", many[:13:2], lambda m: Radau5(tolerance=max(0.003 / m**3, 1e-13))),
        *([Peer("DOP853", (1e-3, *(10.0 ** (-k / 2) for k in range(8, 21))), explicit)] if takes else []),
        Peer("auto", (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), to_tolerance, "all attempts count; the setting is tol"),
    ]


def _outcome(problem: Problem, run: Callable[[], Solution]) -> Outcome:
    begun = clock.process_time()
    found = run()
    spent = clock.process_time() - begun
    if found.stats["unconverged"]:
        raise ArithmeticError(f"{found.stats['unconverged']} steps did not converge")
    q = np.array([getattr(found, row)[-1] for row in problem.system.rows])
    return Outcome(q, found.stats["steps"], found.stats["gradients"], found.stats["solves"], spent)


def peers(problem: Problem) -> list[Peer]:
    """The peers that are installed and can express the problem, at sizes they can handle.

    Chains with true curvature, and loads that are not forces, springs and dampers on discs and links, run with peers that take the
    right-hand side or the saddle point from us: SciPy, CVODE, the saddle point. Exudyn takes loads on slaved headings, MuJoCo none.

    Raises
    ------
    ValueError : for motors and, where equations are compiled, signals that are not those of `discs.loads.signals`.
    """
    loads.check(problem)
    f = reduced.Bound(problem)
    n, slaved = problem.chain.n, isinstance(problem.chain, Chain)
    law, curvature = (problem.chain.rolling, problem.chain.curvature) if isinstance(problem.chain, Chain) else ("own", "linear")
    found = reduced.scipy_peers(problem, f)
    if find_spec("sksundae"):
        found += reduced.sundials_peers(problem, f)
    if n <= 128:
        found.append(multipliers.saddle_peer(problem))
    load = problem.system.load
    bent = isinstance(load, Linear) and load.bends is not None
    if problem.system.parameters is None or curvature != "linear" or problem.chain.degree != 1 or bent:
        return found
    if find_spec("sksundae"):
        found.append(multipliers.multiplier_peer(problem))
    if find_spec("pydiffsol") and problem.chain.ends == "springs" and law in ("field", "unit", "own") and load is None:
        from compare.peers.in_diffsl import diffsol_peers

        found += diffsol_peers(problem)
    if find_spec("diffrax") and problem.chain.ends == "springs" and law in ("field", "unit", "own"):
        from compare.peers.in_jax import diffrax_peers

        found += diffrax_peers(problem)
    if find_spec("exudyn") and (slaved or load is None):
        from compare.peers.exudyn_chain import exudyn_steered_peer
        from compare.peers.exudyn_field import exudyn_field_peer

        found.append(exudyn_field_peer(problem) if slaved else exudyn_steered_peer(problem))
    if find_spec("mujoco") and load is None and n <= 512 and law in ("unit", "own"):
        from compare.peers.mujoco_discs import mujoco_peer

        found += [mujoco_peer(problem), mujoco_peer(problem, second_order=False)]
    return found
