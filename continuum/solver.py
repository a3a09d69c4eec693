"""Fields to a tolerance, or by the paper's scheme: `solve(scene, ...)`."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from tqdm import tqdm

from continuum.mesh import semidiscretise
from continuum.rod import Scene
from discs import Midpoint, Solution, Suzuki4, checks, simulate

FIELDS = ("x", "y", "theta", "omega")
COARSEST = 33
FINEST = 8193
METHODS = ("richardson", "leapfrog")


def solve(
    scene: Scene,
    tol: float = 1e-5,
    method: str = "richardson",
    n: int | None = None,
    dt: float | None = None,
    frames: int | ArrayLike = 2,
    progress: bool = True,
) -> Solution:
    """The fields of a scene.

    "richardson": second-order differences in s on meshes of spacing k, k/2, k/4, ...; two neighbours u_k, u_{k/2} give
    T = u_{k/2} + (u_{k/2} - u_k)/3, which removes the k^2 term, and two neighbouring T the estimate of what is left,
    |T_{k/2} - T_k|/3. (The estimate presumes that the rest falls no slower than k^2. The rod's ends are not smooth - the
    curvature grows a thin layer there - so it does fall like k^2 rather than k^4; measured in docs/accuracy.md.)
    The time step of "suzuki4" is halved on the coarsest mesh until its effect is below a quarter of the tolerance.

    "leapfrog": the paper's explicit scheme on n points with step dt, both as in the paper (32, k^2/8) by default: plain
    springs, end discs of full weight, no error estimate.

    Parameters
    ----------
    scene : what to solve.
    tol : largest error wanted in x, y (length) and theta (rad) over nodes and frames; "richardson" only.
    method : "richardson" or "leapfrog".
    n, dt : points and step of "leapfrog".
    frames : number of frames, equally spaced over the duration with both ends, or their times.
    progress : show progress on anything that takes over a second.

    Returns
    -------
    Solution on the nodes `s`, with `error_estimate` of x, y, theta and omega.

    Raises
    ------
    ValueError : for a bad tolerance, method or mesh, and when the tolerance is not reached on the finest mesh, 8193 nodes.
    SimulationError : when the motion cannot go on; see `discs.simulate`.
    """
    checks.choice("method", method, METHODS)
    if method == "leapfrog":
        problem = semidiscretise(scene, 32 if n is None else n, ends="paper")
        step = problem.chain.k**2 / 8 if dt is None else dt
        return simulate(problem, "leapfrog", dt=step, frames=frames, want=("modified_energy",), progress=progress)
    if n is not None or dt is not None:
        raise ValueError("n and dt belong to method='leapfrog'; 'richardson' chooses both from tol")
    return _richardson(scene, checks.number("tol", tol, positive=True), frames, progress)


def _richardson(scene: Scene, tol: float, frames: int | ArrayLike, progress: bool) -> Solution:
    # sweeps stop well below the tolerance: what each step leaves adds up over the steps
    method = Suzuki4(Midpoint(tolerance=min(1e-10, 1e-5 * tol)))

    def run(n: int, steps: int) -> Solution:
        nodes = n - 1 if scene.closed else n
        return simulate(semidiscretise(scene, nodes), method, scene.duration / steps, frames, progress=False)

    with tqdm(desc=f"field to {tol:g}", unit="mesh", delay=1, disable=not progress) as bar:
        steps, finer = 25, run(COARSEST, 25)
        while True:
            coarse, finer = finer, run(COARSEST, 2 * steps)
            bar.update()
            # the step's effect falls at least fourfold when it is halved
            error_time = {name: 4 / 3 * _largest(getattr(finer, name) - getattr(coarse, name)) for name in FIELDS}
            if _worst(error_time) <= tol / 4:
                break
            steps *= 2
        last: Solution | None = None
        n = COARSEST
        while n < FINEST:
            n = 2 * n - 1
            bar.set_postfix(nodes=n, refresh=False)
            fine = run(n, steps)
            bar.update()
            best = _extrapolate(scene, coarse, fine)
            if last is not None:
                left = {name: _largest(getattr(best, name)[:, ::2] - getattr(last, name)) / 3 for name in FIELDS}
                estimate = {name: left[name] + error_time[name] for name in FIELDS}
                if _worst(estimate) <= tol:
                    stats = fine.stats | {"method": "richardson", "order": 2, "nodes": fine.s.size}
                    return replace(best, error_estimate=estimate, stats=stats)
            last, coarse = best, fine
    raise ValueError(
        f"tol = {tol:g} is not reached on {n} nodes, where the estimated error is {_worst(estimate):.1e}; ask for a larger tol"
    )


def _extrapolate(scene: Scene, coarse: Solution, fine: Solution) -> Solution:
    """T = u_{k/2} + (u_{k/2} - u_k)/3 on the finer nodes, the correction between the coarser ones by a cubic spline."""
    changed = {}
    for name in (*FIELDS, "energy"):
        u, v = getattr(fine, name), getattr(coarse, name)
        if name == "energy":
            changed[name] = u + (u - v) / 3
            continue
        changed[name] = u + spline(scene, coarse.s, (u[:, ::2] - v) / 3)(fine.s).T
    return replace(fine, **changed)


def spline(scene: Scene, s: NDArray, values: NDArray) -> CubicSpline:
    """Cubic spline in s through values (F, n) that are periodic if the scene is closed; call it for (places, F)."""
    if not scene.closed:
        return CubicSpline(s, values.T)
    around = np.append(s, scene.rod.length)
    return CubicSpline(around, np.concatenate([values, values[:, :1]], axis=1).T, bc_type="periodic")


def _largest(difference: NDArray) -> float:
    return float(np.abs(difference).max())


def _worst(errors: dict[str, float]) -> float:
    return max(errors[name] for name in ("x", "y", "theta"))
