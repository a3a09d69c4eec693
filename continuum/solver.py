"""The solver for fields: `solve(scene, ...)`, to a tolerance or by the paper's scheme."""

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
import scipy  # its parts, slow to import, when they are used
from numpy.typing import ArrayLike
from tqdm import tqdm

from continuum.bounds import FIELDS, bounds, missed, over
from continuum.initial import resolve
from continuum.load_places import check_densities
from continuum.mesh import semidiscretise, unseen, viscous
from continuum.refinement import solve_elements
from continuum.rod import Scene
from continuum.spectral import solve_spectral
from continuum.timing import Timing
from continuum.wants import arrays, check_want, estimated
from discs import Midpoint, Problem, Solution, Suzuki4, checks, simulate, suggest_dt
from discs.arrays import Float, Spline
from discs.running.frames import frame_times
from discs.warn import warn

COARSEST = 33
FINEST = 8193
MOST_STEPS = 25 * 2**12
SLOWEST = 0.9  # largest ratio of changes from mesh to mesh


def solve(
    scene: Scene,
    tol: float | Mapping[str, float] = 1e-5,
    method: str | None = None,
    n: int | None = None,
    dt: float | None = None,
    frames: int | ArrayLike = 101,
    progress: bool = True,
    want: Iterable[str] = (),
) -> Solution:
    """The fields of a scene.

    Methods:

    "spectral": Galerkin's method with polynomials, or with Fourier series if the scene is closed, refined to the tolerance; see
    `continuum.galerkin` and `continuum.spectral`. For slaved headings and linear curvature.

    "richardson": second-order differences in s on meshes of spacing k, k/2, k/4, ... Two neighbouring meshes u_k, u_{k/2} give
    T = u_{k/2} + (u_{k/2} - u_k)/3, which removes the k^2 term. Three neighbouring T give the error estimate: if the changes
    d = |T_{k/2} - T_k| fall by a factor rho from mesh to mesh, it is d rho/(1 - rho). rho is measured, and limited to 1/4 ... 9/10.
    The rod's ends are not smooth (the curvature has a growing thin layer there), so the error of T falls like k^2 rather than k^4
    (docs/accuracy.md). If the initial fields have corners it falls more slowly, and rho is at least 1/2. The coarsest mesh resolves
    the initial fields (`continuum.mesh.unseen`). The step of "suzuki4" ("midpoint" with viscous bending) is halved on the coarsest
    mesh until its effect is below a quarter of the tolerance. The effect is measured again on the finest mesh but one, and is part
    of the estimate.

    "elements": spectral elements for a `SteeredRod`, refined to the tolerance; see `continuum.elements`.

    "leapfrog": the paper's explicit scheme on n points with step dt, by default as in the paper (32, k^2/8): plain springs, end
    discs of full weight, no error estimate.

    Parameters of the rod that are functions of s are taken by every method, if they are continuous ("spectral": and if K does not
    fall below 1e-4 of its largest value).

    Loads of a scene with slaved headings: "spectral" takes those of `continuum.load_terms` (see `continuum.weak`), "richardson" all
    that discs take, `Potential` and `Custom` among them, "leapfrog" those with a potential. Those of a `SteeredRod`:
    `continuum.element_loads`. A `Custom` must be per length. Steps do not jump over signals (`continuum.timing`).

    Parameters
    ----------
    scene : the scene.
    tol : largest error allowed in x, y (length), theta and phi (rad) over nodes and frames; "leapfrog" ignores it. A mapping sets
        bounds for the quantities it names, rates too: {"omega": 1e-4, "theta": 1e-5}.
    method : "spectral", "richardson" or "leapfrog"; "elements" for a `SteeredRod`. The first that fits by default.
    n, dt : nodes and time step of "leapfrog". The default step is below k^2/8 if that would be unstable.
    frames : number of frames, equally spaced over the duration with both ends, or their times. They cost little: frames within a
        step of the spectral field are evaluated on its collocation polynomial.
    progress : show progress on anything that takes over a second.
    want : further quantities (docs/ground-force.md): "velocity", "slope", and, of "spectral" and "elements", "contact_force" (per
        length, with end_force and end_couple at free ends, and contact_moments), "energy_density" and "energy_flux". `tol` may
        bind their arrays, too: {"theta": 1e-5, "end_couple": 1e-3}.

    Returns
    -------
    Solution on the nodes `s`. `error_estimate` has the errors of x, y, theta, omega, for a `SteeredRod` of phi and phi_rate, of the
    arrays of wanted quantities (the largest over nodes, frames and components; "contact_force_inside", "energy_density_inside": an
    eighth of the length or more from free ends), and of the energy: its largest distance over all frames from the energy of the
    initial fields, by quadrature (with loads, that of energy - work + dissipated). The steps of the spectral field conserve the
    energy to rounding (and to the tolerance of sweeps). At frames within steps it is the energy of the interpolated fields, and has
    their error.

    Raises
    ------
    ValueError : for a bad tolerance, method or mesh; for a wanted quantity that the method or the scene does not have; for initial
        fields that jump or cannot be resolved (`continuum.initial`); if the tolerance is not reached with the largest number of
        functions, nodes or steps of the method.
    SimulationError : if the motion cannot continue; see `discs.simulate`.
    """
    if not isinstance(scene, Scene):
        raise ValueError(
            f"solve takes a Scene, such as untwisting_rod(); got {type(scene).__name__}"
            + "; simulate(problem) runs discs" * isinstance(scene, Problem)
        )
    fitting = ("elements",) if scene.steered else ("richardson", "leapfrog")
    if scene.rod.curvature == "linear" and not scene.steered:
        fitting = ("spectral", *fitting)
    method = fitting[0] if method is None else checks.choice("method", method, fitting)
    names = check_want(want, method, scene)
    check_densities(scene.loads)
    energy = resolve(scene).energy
    if method == "leapfrog":
        problem = semidiscretise(scene, 32 if n is None else n, ends="paper")
        step = min(problem.chain.k**2 / 8, suggest_dt(problem, "leapfrog")) if dt is None else dt
        names += ("modified_energy",) if problem.system.quadratic else ()
        if warning := unseen(scene, problem):
            warn(warning)
        run = simulate(problem, "leapfrog", dt=step, frames=frames, want=names, progress=progress)
        return replace(run, stats=run.stats | {"scene": scene.description()})
    if n is not None or dt is not None:
        raise ValueError(f"n and dt belong to method='leapfrog'; {method!r} chooses both from tol")
    bound = bounds(tol, scene.steered, estimated(names, scene.closed))
    times = frame_times(frames, scene.duration)
    solver = {"elements": solve_elements, "spectral": solve_spectral, "richardson": _richardson}[method]
    found = solver(scene, bound, times, progress, names)
    balance = found.energy - found.work + found.dissipated
    drift = float(np.abs(balance - (balance[0] if scene.loads else energy)).max())
    stats = found.stats | {"scene": scene.description()}
    estimate = found.error_estimate or {}
    return replace(found, error_estimate=estimate | {"energy": estimate.get("energy", drift)}, stats=stats)


def _richardson(scene: Scene, bound: Mapping[str, float], frames: Float, progress: bool, want: tuple[str, ...] = ()) -> Solution:
    tol, fields = min(bound.values()), (*FIELDS, *arrays(want, scene.closed))
    # the tolerance of sweeps is far below tol, as their errors add up over the steps
    middle = Midpoint(tolerance=min(1e-10, 1e-5 * tol))
    method = middle if viscous(scene, "bending") else Suzuki4(middle)

    def mesh(n: int) -> Problem:
        return semidiscretise(scene, n - 1 if scene.closed else n, "consistent")

    def run(n: int, steps: int) -> Solution:
        with warnings.catch_warnings(action="ignore"):  # too long steps show in the comparison with half as long ones
            return simulate(mesh(n), method, scene.duration / steps, frames, want, progress=False)

    def largest(a: Solution, b: Solution, factor: float) -> dict[str, float]:
        every = (b.s.size - 1) // (a.s.size - 1) if not scene.closed else b.s.size // a.s.size
        return {f: factor * float(np.abs(getattr(b, f)[:, ::every] - getattr(a, f)).max()) for f in fields}

    def effect(whole: Solution, halved: Solution) -> dict[str, float]:
        """The error of a time step, as the half step has at most a quarter of it; infinite if sweeps did not converge."""
        return largest(halved, whole, np.inf if halved.stats["unconverged"] else 4 / 3)

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

        steps, coarsest = 25, COARSEST
        if scene.loads:
            steps *= 2 ** max(0, int(np.ceil(np.log2(scene.duration / steps / Timing(scene).shortest))))
        while coarsest < FINEST and unseen(scene, mesh(coarsest)):
            coarsest = 2 * coarsest - 1
        coarse = shown(coarsest, steps)
        while over(effect(coarse, halved := shown(coarsest, 2 * steps)), bound) > 1 / 4:
            steps, coarse = 2 * steps, halved
        n, last, fastest = coarsest, None, 1 / 2 if resolve(scene).kinks else 1 / 4
        change = space = unknown = dict.fromkeys(fields, np.inf)
        while n < FINEST:
            fine = shown(2 * n - 1, steps)
            best = _extrapolate(scene, fields, coarse, fine)
            before, change = change, largest(last, best, 1.0) if last is not None else unknown
            space = {name: change[name] * _rest(change[name], before[name], fastest) for name in fields}
            if over(space, bound) <= 0.75:
                # measure the step again on the coarser of the last two meshes: it has waves that the coarsest mesh has not
                time = effect(coarse, shown(n, 2 * steps))
                estimate = {name: space[name] + time[name] for name in fields}
                if over(estimate, bound) <= 1:
                    stats = fine.stats | {"method": "richardson", "order": 2, "nodes": fine.s.size}
                    return replace(best, error_estimate=estimate, rolling_residual=None, stats=stats)
                # a smaller step, assuming an error of at least third order, and again from two meshes back
                steps *= max(2, 2 ** int(np.ceil(np.log(4 * over(time, bound)) / np.log(8))))
                n = max(coarsest, (n - 1) // 8 + 1)
                coarse, last, change = shown(n, steps), None, unknown
                continue
            n, coarse, last = 2 * n - 1, fine, best
    raise ValueError(missed(space, bound, f"on {n} nodes"))


def _rest(change: float, before: float, fastest: float) -> float:
    """The remaining error over the last change, if changes fall geometrically; infinite after the first change."""
    if not np.isfinite(before):
        return np.inf
    rho = min(max(change / before, fastest), SLOWEST) if change else fastest
    return rho / (1 - rho)


def _extrapolate(scene: Scene, fields: tuple[str, ...], coarse: Solution, fine: Solution) -> Solution:
    """T = u_{k/2} + (u_{k/2} - u_k)/3 on the finer nodes; a cubic spline interpolates the correction between the coarser ones."""
    changed = {}
    for name in fields:
        u, v = getattr(fine, name), getattr(coarse, name)
        changed[name] = u + spline(scene, coarse.s, (u[:, ::2] - v) / 3)(fine.s).T
    balance = None if fine.balance is None or coarse.balance is None else fine.balance + (fine.balance - coarse.balance) / 3
    return replace(fine, energy=fine.energy + (fine.energy - coarse.energy) / 3, balance=balance, **changed)


def spline(scene: Scene, s: Float, values: Float) -> Spline:
    """Cubic spline in s through values (F, n), periodic if the scene is closed; it returns (places, F)."""
    ends = "not-a-knot"
    if scene.closed:
        s, values, ends = np.append(s, scene.rod.length), np.concatenate([values, values[:, :1]], axis=1), "periodic"
    through: Spline = scipy.interpolate.CubicSpline(s, values.T, bc_type=ends)
    return through
