"""Fields to a tolerance, or by the paper's scheme: `solve(scene, ...)`."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from tqdm import tqdm

from continuum.elements import solve_elements
from continuum.mesh import semidiscretise
from continuum.rod import Scene
from continuum.spectral import solve_spectral
from continuum.told import tells_scene
from discs import Midpoint, Solution, Suzuki4, checks, simulate, suggest_dt
from discs.simulation import frame_times

FIELDS = ("x", "y", "theta", "omega")
COARSEST = 33
FINEST = 8193
MOST_STEPS = 25 * 2**12


@tells_scene
def solve(
    scene: Scene,
    tol: float = 1e-5,
    method: str | None = None,
    n: int | None = None,
    dt: float | None = None,
    frames: int | ArrayLike = 101,
    progress: bool = True,
) -> Solution:
    """The fields of a scene.

    "spectral": Galerkin's method with polynomials, or Fourier series if the scene is closed, refined until it no longer
    matters; see `continuum.galerkin` and `continuum.spectral`. For slaved headings and linear curvature.

    "richardson": second-order differences in s on meshes of spacing k, k/2, k/4, ...; two neighbours u_k, u_{k/2} give
    T = u_{k/2} + (u_{k/2} - u_k)/3, which removes the k^2 term, and two neighbouring T the estimate of what is left,
    |T_{k/2} - T_k|/3. (The estimate presumes that the rest falls no slower than k^2. The rod's ends are not smooth - the
    curvature grows a thin layer there - so it does fall like k^2 rather than k^4; measured in docs/accuracy.md.)
    The step of "suzuki4" is halved on the coarsest mesh until its effect is below a quarter of the tolerance; the effect is
    measured again on the finest mesh but one, and is part of the estimate.

    "elements": for headings of their own (`SteeredRod`): spectral elements, more of them until it no longer matters; see
    `continuum.elements`.

    "leapfrog": the paper's explicit scheme on n points with step dt, both as in the paper (32, k^2/8) by default: plain
    springs, end discs of full weight, no error estimate.

    Parameters
    ----------
    scene : what to solve.
    tol : largest error wanted in x, y (length), theta and phi (rad) over nodes and frames; not of "leapfrog".
    method : "spectral", "richardson" or "leapfrog"; "elements" for headings of their own. The first that fits by default.
    n, dt : points and step of "leapfrog"; the step is below k^2/8 where that would be unstable.
    frames : number of frames, equally spaced over the duration with both ends, or their times. The spectral field takes a step of
        its own for each: where only the end counts, frames=2 is several times faster.
    progress : show progress on anything that takes over a second.

    Returns
    -------
    Solution on the nodes `s`, with `error_estimate` of x, y, theta and omega.

    Raises
    ------
    ValueError : for a bad tolerance, method or mesh, and when the tolerance is not reached with the most functions or nodes and
        steps that the method tries.
    SimulationError : when the motion cannot go on; see `discs.simulate`.
    """
    fitting = ("elements",) if scene.steered else ("richardson", "leapfrog")
    if scene.rod.curvature == "linear" and not scene.steered:
        fitting = ("spectral", *fitting)
    method = fitting[0] if method is None else checks.choice("method", method, fitting)
    if method == "leapfrog":
        problem = semidiscretise(scene, 32 if n is None else n, ends="paper")
        step = min(problem.chain.k**2 / 8, suggest_dt(problem, "leapfrog")) if dt is None else dt
        want = ("modified_energy",) if problem.system.quadratic else ()
        return simulate(problem, "leapfrog", dt=step, frames=frames, want=want, progress=progress)
    if n is not None or dt is not None:
        raise ValueError(f"n and dt belong to method='leapfrog'; {method!r} chooses both from tol")
    tol = checks.number("tol", tol, positive=True)
    if method in ("elements", "spectral"):
        solver = solve_elements if method == "elements" else solve_spectral
        return solver(scene, tol, frame_times(frames, scene.duration), progress)
    return _richardson(scene, tol, frames, progress)


def _richardson(scene: Scene, tol: float, frames: int | ArrayLike, progress: bool) -> Solution:
    # sweeps stop well below the tolerance: what each step leaves adds up over the steps
    method = Suzuki4(Midpoint(tolerance=min(1e-10, 1e-5 * tol)))

    def run(n: int, steps: int) -> Solution:
        nodes = n - 1 if scene.closed else n
        return simulate(semidiscretise(scene, nodes, "consistent"), method, scene.duration / steps, frames, progress=False)

    def largest(a: Solution, b: Solution, factor: float) -> dict[str, float]:
        every = (b.s.size - 1) // (a.s.size - 1) if not scene.closed else b.s.size // a.s.size
        return {f: factor * float(np.abs(getattr(b, f)[:, ::every] - getattr(a, f)).max()) for f in FIELDS}

    def effect(whole: Solution, halved: Solution) -> dict[str, float]:
        """Of a time step, when half of it has at most a quarter of the effect."""
        return largest(halved, whole, 4 / 3)

    with tqdm(desc=f"field to {tol:g}", unit="run", delay=1, disable=not progress) as bar:

        def shown(n: int, steps: int) -> Solution:
            if steps > MOST_STEPS:
                raise ValueError(
                    f"tol = {tol:g} is not reached in {MOST_STEPS} time steps: the motion is too sensitive or too fast; "
                    "ask for a larger tol or a shorter duration"
                )
            bar.set_postfix(nodes=n, steps=steps, refresh=False)
            bar.update()
            return run(n, steps)

        steps = 25
        coarse = shown(COARSEST, steps)
        while _worst(effect(coarse, halved := shown(COARSEST, 2 * steps))) > tol / 4:
            steps, coarse = 2 * steps, halved
        n, last = COARSEST, None
        while n < FINEST:
            fine = shown(2 * n - 1, steps)
            best = _extrapolate(scene, coarse, fine)
            space = largest(last, best, 1 / 3) if last is not None else dict.fromkeys(FIELDS, np.inf)
            if _worst(space) <= 0.75 * tol:
                # the step again, on the coarser of the two meshes that count: waves may be there that COARSEST does not hold
                time = effect(coarse, shown(n, 2 * steps))
                estimate = {name: space[name] + time[name] for name in FIELDS}
                if _worst(estimate) <= tol:
                    stats = fine.stats | {"method": "richardson", "order": 2, "nodes": fine.s.size}
                    return replace(best, error_estimate=estimate, rolling_residual=None, stats=stats)
                # a smaller step, to fall like its third power if not its fourth, and again from two meshes back
                steps *= max(2, 2 ** int(np.ceil(np.log(4 * _worst(time) / tol) / np.log(8))))
                n = max(COARSEST, (n - 1) // 4 + 1)
                coarse, last = shown(n, steps), None
                continue
            n, coarse, last = 2 * n - 1, fine, best
    raise ValueError(
        f"tol = {tol:g} is not reached on {n} nodes, where the estimated error is {_worst(space):.1e}; ask for a larger tol"
    )


def _extrapolate(scene: Scene, coarse: Solution, fine: Solution) -> Solution:
    """T = u_{k/2} + (u_{k/2} - u_k)/3 on the finer nodes, the correction between the coarser ones by a cubic spline."""
    changed = {}
    for name in FIELDS:
        u, v = getattr(fine, name), getattr(coarse, name)
        changed[name] = u + spline(scene, coarse.s, (u[:, ::2] - v) / 3)(fine.s).T
    return replace(fine, energy=fine.energy + (fine.energy - coarse.energy) / 3, **changed)


def spline(scene: Scene, s: NDArray, values: NDArray) -> CubicSpline:
    """Cubic spline in s through values (F, n) that are periodic if the scene is closed; call it for (places, F)."""
    if not scene.closed:
        return CubicSpline(s, values.T)
    around = np.append(s, scene.rod.length)
    return CubicSpline(around, np.concatenate([values, values[:, :1]], axis=1).T, bc_type="periodic")


def _worst(errors: dict[str, float]) -> float:
    return max(errors[name] for name in ("x", "y", "theta"))
