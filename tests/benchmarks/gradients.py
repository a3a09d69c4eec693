"""`python -m tests.benchmarks.gradients`: gradients by the discrete adjoint, and by diffrax's checkpointed adjoint.

First what a gradient by all radii and initial angles costs beside a compiled run with the same steps. Then the derivatives of the
last y of the first disc by all initial angles, 128 discs of the paper's rod: processor times after a first call, which compiles,
and errors relative to the largest derivative, against "gauss8".
"""

import time as clock
from collections.abc import Callable
from typing import Any

import numpy as np

from compare import lump
from compare.peers.in_jax import _in_jax
from continuum import untwisting_rod
from discs import Problem, simulate
from discs.analysis import gradient
from discs.arrays import Float

STEP = 0.0045
OURS = [("midpoint", 0.0225), ("midpoint", 0.0045), ("gauss4", 0.045), ("gauss4", 0.0225), ("gauss6", 0.045)]


def by_us(problem: Problem, method: str, dt: float) -> Float:
    """By `gradient`."""
    found = gradient(problem, lambda run: run.y[-1, 0], "theta", method, dt, progress=False, engine="compiled")
    return found["theta"]


def by_diffrax(problem: Problem, tol: float, name: str) -> Callable[[], Float]:
    """By jax.grad through diffrax, whose adjoint keeps states at some steps and takes the steps between again."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    rate, z = _in_jax(problem), problem.start()
    places, momenta = jnp.asarray(z.hi), jnp.asarray(np.atleast_2d(z.pi))

    @jax.jit
    @jax.grad
    def slopes(theta: Any) -> Any:
        begin = jnp.concatenate([places.at[2].set(theta), momenta])
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, y, _: rate(t, y)),
            getattr(diffrax, name)(),
            0.0,
            problem.duration,
            None,
            begin,
            stepsize_controller=diffrax.PIDController(rtol=tol, atol=tol),
            saveat=diffrax.SaveAt(t1=True),
            adjoint=diffrax.RecursiveCheckpointAdjoint(),
            max_steps=32768,
        )
        return found.ys[0, 1, 0]

    return lambda: np.asarray(slopes(places[2]))


def timed(call: Callable[[], Float]) -> tuple[float, Float]:
    """The median processor time of three calls after a first one, and what they return."""
    call()
    seconds = []
    for _ in range(3):
        begun = clock.process_time()
        found = call()
        seconds.append(clock.process_time() - begun)
    return float(np.median(seconds)), found


def costs() -> None:
    """Print what a gradient costs, in microseconds of processor time a step and in runs."""
    print("   n  method     run, us  gradient, us  runs")
    for n in (32, 128, 512):
        problem = lump(untwisting_rod(), n=n)
        for method in ("midpoint", "gauss4"):

            def run(problem: Problem = problem, method: str = method) -> Float:
                return np.asarray(simulate(problem, method, STEP, 1, progress=False, engine="compiled").y)

            def slopes(problem: Problem = problem, method: str = method) -> Float:
                names = ("radius", "theta")
                found = gradient(problem, lambda run: run.y[-1, 0], names, method, STEP, progress=False, engine="compiled")
                return found["theta"]

            once, both = (timed(call)[0] * STEP / problem.duration * 1e6 for call in (run, slopes))
            print(f"{n:4}  {method:8}  {once:8.2f}  {both:12.1f}  {both / once:4.1f}", flush=True)


def main() -> None:
    """Print both tables."""
    costs()
    problem = lump(untwisting_rod(), n=128)
    exact = by_us(problem, "gauss8", 0.0225)
    print("method          setting    seconds      error")
    for method, dt in OURS:
        seconds, found = timed(lambda method=method, dt=dt: by_us(problem, method, dt))  # type: ignore[misc]
        print(f"{method:15} dt={dt:<6}  {seconds:9.4f}  {abs(found - exact).max() / abs(exact).max():9.1e}", flush=True)
    for name in ("Tsit5", "Dopri8"):
        for tol in (1e-6, 1e-8, 1e-10):
            seconds, found = timed(by_diffrax(problem, tol, name))
            print(f"diffrax {name:7} tol={tol:<6} {seconds:9.4f}  {abs(found - exact).max() / abs(exact).max():9.1e}", flush=True)


if __name__ == "__main__":
    main()
