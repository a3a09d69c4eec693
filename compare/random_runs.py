"""A test of tolerances: random problems by `simulate(..., "auto")`, compared with runs of much shorter steps.

A problem is a random scene (`compare.random_scenes`) as a chain of 3 to 200 discs with any ends, or with true curvature, and a
tolerance of 1e-2 to 1e-8; both are log-uniform. The reference is "gauss8" with steps REFINED times shorter than those of the
result, which is eight times shorter than any step of its search, or more. The error of the reference is its difference from a run
with half as many steps. A reference whose error is more than a fifth of the tolerance is not used.

A refusal must be justified. The search itself shows whether rounding is the limit. A lost heading is checked by "gauss8" with steps
three times shorter than those that lost it: a heading must be lost again, at the same time.
"""

import time as clock
import warnings
from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from compare.lump import lump
from compare.sweeps import Result, sweep
from compare.tables import markdown
from compare.trust import FRAMES, KNOWN, TimeUp, at_most, cases_of, scene_of
from compare.trust_table import LEAST, MOST, OUTCOMES, Row, Trust
from discs import Gauss8, Problem, SimulationError, Solution, checks, simulate
from discs.arrays import Float
from discs.running.estimates import differences, sizes

SIZES = 3, 200  # discs
TRUE = 0.25  # share of unit-law chains that have true curvature, within the following limits
TRUE_SIZE, TRUE_DURATION = 12, 2.0
REFINED = 24
HIGH = 5.0  # largest ratio of estimate to error wanted in nine of ten runs
EVALUATIONS = 12  # of a step of DOP853
FEWEST = 25  # least number of steps that REFINED multiplies
MOMENT = 1e-6  # a duration in which nothing moves
SAME = 0.01  # relative: headings lost at times as close as this are the same


def random_problem(seed: int, index: int, loads: bool = False) -> tuple[Problem, float, Row]:
    """Problem number `index` of a seed, its tolerance, and a row that describes it; the same on every machine.

    loads : whether the rod varies and has loads.
    """
    drawn, rng = scene_of([seed, index, 0.0, *[1.0] * loads]), np.random.default_rng([seed, index, 2])
    scene, n = drawn.scene, int(np.exp(rng.uniform(np.log(SIZES[0]), np.log(SIZES[1] + 1))))
    ends = "springs" if scene.steered else str(rng.choice(["springs", "consistent", "paper"]))
    law = "own" if scene.steered else scene.rolling
    if law == "unit" and rng.random() < TRUE:
        rod = replace(scene.rod, curvature="true", stretch_stiffness=float(rng.uniform(1.0, 20.0)))
        scene, n, law = replace(scene, rod=rod, duration=min(scene.duration, TRUE_DURATION)), min(n, TRUE_SIZE), "true"
        ends = "springs" if ends == "paper" else ends
    n, tol = max(n, 5 if scene.closed else 4 if ends == "consistent" else 3), float(f"{10 ** -rng.uniform(2, 8):.1e}")
    with warnings.catch_warnings(action="ignore"):  # few discs do not resolve every scene
        problem = lump(scene, n, ends)
    words = f"{drawn.words}, N = {n}, {problem.chain.ends}"
    return problem, tol, Row(f"{seed}:{index}", drawn.kind, law, words, scene.duration, "simulate", tol, "")


def examine(case: list[float]) -> list[Any]:
    """The row of a case (`compare.trust.cases_of`); called in other processes."""
    problem, tol, row = random_problem(int(case[0]), int(case[1]), len(case) > 3)
    seconds, found = float(case[2]), None
    with warnings.catch_warnings(action="ignore"):
        for method in ("midpoint", "gauss6", "gauss8", "DOP853"):  # compile or load kernels before time is measured
            simulate(replace(problem, duration=MOMENT), method, MOMENT, 1, progress=False)
        begun = clock.process_time()
        try:
            with at_most(seconds):
                found = simulate(problem, "auto", tol=tol, frames=FRAMES, progress=False)
        except TimeUp:
            row = row._replace(outcome="cut off")
        except (ValueError, SimulationError, ArithmeticError) as error:
            row = row._replace(outcome="refused", says=f"{type(error).__name__}: {error}", shown=_shown(problem, error, seconds))
        row = row._replace(seconds=clock.process_time() - begun)
        return list(row if found is None else _judged(problem, found, row, seconds))


def _judged(problem: Problem, found: Solution, row: Row, seconds: float) -> Row:
    """The row of a run with its error and its outcome."""
    names = problem.system.rows
    size = sizes(found, names)

    def relative(errors: dict[str, float]) -> float:
        return max(errors[name] / size[name] for name in names)

    row = row._replace(estimate=relative(found.error_estimate or {}), limited=found.stats.get("limited_by", ""), reference="gauss8")
    steps = max(found.stats["steps"], FEWEST)
    if found.stats["method"] == "DOP853":  # its steps are shorter than the longest one, which `steps` counts
        steps = max(steps, found.stats["gradients"] // EVALUATIONS)
    try:
        with at_most(4 * seconds):
            near, far = (
                simulate(problem, Gauss8(tolerance=1e-15, sweeps=20), problem.duration / (m * steps), FRAMES, progress=False)
                for m in (REFINED, REFINED // 2)
            )
    except (TimeUp, SimulationError, ArithmeticError) as error:
        return row._replace(outcome="no reference", says=shorten(f"reference: {type(error).__name__} {error}", 200))
    apart, off = relative(differences(found, near)), relative(differences(near, far))
    row = row._replace(error=apart, reference_error=off)
    if off > row.tol / LEAST:
        return row._replace(outcome="no reference")
    ratio = row.estimate / apart if apart > KNOWN * off else np.nan
    return row._replace(outcome="within" if apart <= row.tol + off else "ABOVE", ratio=ratio)


def _shown(problem: Problem, error: Exception, seconds: float) -> str:
    """Whether a refusal is justified, in words."""
    if any(words in str(error) for words in ("rounding is the limit", "can be held until")):
        return "rounding"
    if not isinstance(error, SimulationError) or not error.step:
        return ""
    try:
        with at_most(4 * seconds):
            simulate(problem, Gauss8(tolerance=1e-15, sweeps=20), error.time / (3 * error.step), FRAMES, progress=False)
    except TimeUp:
        return "shorter steps took too long"
    except (SimulationError, ArithmeticError) as other:
        same = abs(getattr(other, "time", np.inf) - error.time) <= SAME * error.time
        return "the heading is lost" if same and "lost its heading" in str(other) else f"shorter steps: {other}"
    return "NOT TRUE: shorter steps go on to the end"


class Runs(Trust):
    """The results. rows : one for each problem. failed : cases of the sweep that raised an error."""

    def summary(self) -> str:
        """Counts and quantiles by tolerance; exceeded tolerances, refusals and cautious estimates; in Markdown."""
        ratios = "estimate/error: least", "median", "90 %", "largest"
        head = ("tol", *OUTCOMES, *ratios, "limited", "tol/error: median", "s: median", "largest")
        decades = {f"1e{most} … 1e{most - 1}": (10.0 ** (most - 1), 10.0**most) for most in range(-2, -8, -1)}
        counted = [_line(name, [r for r in self.rows if low < r.tol <= high]) for name, (low, high) in decades.items()]
        lines = [markdown(head, [*counted, _line("all", self.rows)]), ""]
        share = np.mean(_ratios(self.rows) <= HIGH)
        lines.append(f"Of runs that only their tolerance limits {share:.1%} have estimates of at most {HIGH:g} times the error.\n")
        for r in self.rows:
            about = f"{r.scene} ({r.kind}, {r.law}, {r.words}, t = {r.duration:.3g}), tol {r.tol:.1e}"
            if r.outcome == "ABOVE":
                lines.append(f"* above: {about}: error {r.error:.1e}, estimate {r.estimate:.1e}")
            elif r.outcome in ("refused", "cut off", "no reference"):
                lines.append(f"* {r.outcome}: {about}: {shorten(r.says, 200, placeholder=' ...')} ({r.shown})")
            elif r.counts and r.ratio > MOST:
                lines.append(f"* cautious: {about}: estimate over error {r.ratio:.0f}")
        lines += [f"* broken: {r.case}: {r.error}" for r in self.failed]
        return "\n".join(lines)


def _line(name: str, rows: list[Row]) -> list[str]:
    """A line of the summary. Ratios are those of runs that only their tolerance limits."""
    counts = [str(sum(r.outcome == outcome for r in rows)) for outcome in OUTCOMES]
    ratios = _ratios(rows)
    limited = sum(r.limited not in ("", "tolerance") for r in rows)
    spare = np.array([r.tol / r.error for r in rows if r.error > 0] or [np.nan])
    seconds = np.array([r.seconds for r in rows] or [np.nan])
    quantiles = [f"{np.quantile(ratios, p):.2g}" for p in (0.0, 0.5, 0.9, 1.0)]
    more = [str(limited), f"{np.median(spare):.2g}", f"{np.median(seconds):.2g}", f"{seconds.max():.2g}"]
    return [name, *counts, *quantiles, *more]


def _ratios(rows: Iterable[Row]) -> Float:
    return np.array([r.ratio for r in rows if r.counts] or [np.nan])


def trust_runs(
    problems: int = 500,
    seed: int = 0,
    first: int = 0,
    seconds: float = 20.0,
    executor: Executor | None = None,
    archive: str | Path | None = None,
    progress: bool = True,
    loads: bool = False,
) -> Runs:
    """Run random problems of discs to random tolerances, 1e-2 to 1e-8, and measure the errors; arguments as for `trust`."""
    cases = cases_of(seed, first, checks.whole("problems", problems, 1), seconds, loads)
    return gathered(sweep(examine, cases, executor, archive, progress))


def gathered(results: Iterable[Result]) -> Runs:
    """The rows of the results of a sweep so far."""
    found = sorted(results, key=lambda result: result.case)
    return Runs([Row(*r.value) for r in found if not r.error], [r for r in found if r.error])
