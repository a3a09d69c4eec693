r"""Which limit first? Discs on ground with viscous slip epsilon, N -> infinity and epsilon -> 0.

With `discs.mechanics.sliding` and N discs three distances at the end of a scene, the largest over discs and over x, y, theta:

    of sliding from rolling discs, N fixed: epsilon -> 0 at that N;
    of sliding discs from the rolling field: both limits;
    the slip |r. - e omega| of the end discs, and inside (an eighth of the length away from free ends).

For a fixed N the first one is of first order in epsilon, as lambda of these discs is finite. In the rod it is not: at a free end
the ground holds a force and a couple (docs/ground-force.md), which viscous ground can only spread over a layer. There K r''''
balances r./epsilon, so the layer is (K epsilon T)**(1/4) long at times T; a couple c over a layer d takes lambda ~ c/d**2, so the
slip at the end falls like epsilon**(1/2) only, while that inside falls like epsilon. A ring has no ends and is the control.
"""

from pathlib import Path

import numpy as np
from tqdm import tqdm

from compare.lump import lump
from compare.outputs import fresh_files
from compare.results import Slips
from compare.study import apart
from compare.tables import aligned, write_csv
from continuum import Scene, breathing_ring, solve, untwisting_rod
from discs import Solution, simulate
from discs.mechanics.ground import inner
from discs.mechanics.sliding import slide

SIZES = (9, 17, 33, 65, 129, 257)
SLIPS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
DURATION = 2.0


COLUMNS = (
    "scene",
    "N",
    "epsilon",
    "from rolling discs",
    "from the field",
    "slip at ends",
    "slip inside",
    "order",
    "at ends",
    "inside",
)


def slips(scene: Scene, n: tuple[int, ...] = SIZES, epsilon: tuple[float, ...] = SLIPS, progress: bool = True) -> Slips:
    """The distances for all N and epsilon. Chains have plain springs, as those of free discs; a ring has one disc less.

    Raises
    ------
    ValueError : see `slide`.
    """
    sizes = tuple(size - scene.closed for size in n)
    field = solve(scene, 1e-7, frames=1, progress=False)
    found = np.empty((4, len(sizes), len(epsilon)))
    bar = tqdm(total=found[0].size, desc=f"sliding discs, {scene.name}", unit="run", delay=1, disable=not progress)
    with bar:
        for i, size in enumerate(sizes):
            problem = lump(scene, size, "springs")
            rolling = simulate(problem, "gauss8", scene.duration / 200, frames=1, progress=False)
            for j, value in enumerate(epsilon):
                run = slide(problem, value, frames=1)
                found[:, i, j] = _apart(run, rolling), apart(scene, run, field).max(), *_slip(run, value)
                bar.update()
    return Slips(scene, sizes, epsilon, *found)


def _apart(one: Solution, other: Solution) -> float:
    return max(float(np.abs(getattr(one, name) - getattr(other, name)).max()) for name in ("x", "y", "theta"))


def _slip(run: Solution, epsilon: float) -> tuple[float, float]:
    """The largest slip of end discs, and of those away from them."""
    assert run.contact_force is not None
    assert run.problem is not None
    speed, away = epsilon * np.hypot(*run.contact_force[-1]) / run.problem.chain.w, inner(run)
    ends = away if away.all() else [0, -1]
    return float(speed[ends].max()), float(speed[away].max())


def slip_limits(
    out: str | Path, progress: bool = True, n: tuple[int, ...] = SIZES, epsilon: tuple[float, ...] = SLIPS
) -> tuple[str, list[Slips]]:
    """The paper's twist and the breathing ring: slip.csv and slip.png in `out`; the table as text, and what was found."""
    from compare import figures

    with fresh_files(out) as folder:
        scenes = untwisting_rod(duration=DURATION), breathing_ring()
        found = [slips(scene, n, epsilon, progress) for scene in scenes]
        rows = [COLUMNS, *(row for each in found for row in each.rows())]
        write_csv(folder / "slip.csv", rows)
        figures.save(figures.slip(found)[0], folder / "slip.png")
    return aligned(rows), found
