"""Speed against error of our methods and of the alternatives, on the same problem and machine, in one run.

Times are processor time, which other work on the machine changes little.
"""

import time as clock
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from tqdm import tqdm

from compare.entrants import ours, peers
from compare.lump import lump
from compare.peers.peer import Cutoff, Peer
from compare.reference import distance, reference, rms_distance
from compare.work_precision import Row, WorkPrecision
from continuum import Scene, steered_rod, untwisting_rod
from discs import Problem, SimulationError, checks
from discs.arrays import Float
from discs.chains.rolling import ROLLING
from discs.loads import Damping, Slope, Spring, Torque, signals

SIZES = (32, 128, 512, 2048)
WRONG = 100.0  # a run whose error is this many times its tolerance is marked
FAILURES = (ArithmeticError, SimulationError, RuntimeError, ValueError)  # errors of a run that are shown in the table


def tilted() -> Scene:
    """The paper's twist on a slope across the rod, with rolling resistance and a torque on all of it that starts smoothly."""
    loads = Slope(gy=-0.2), Damping(rolling=0.1), Torque(0.1, signals.smooth(0.0, 2.0))
    return replace(untwisting_rod(), loads=loads, name="tilted rod")


def driven() -> Scene:
    """The paper's twist with viscous torsion and rolling resistance, turned to and fro at one end, the other end on a spring."""
    start = Torque(0.3, signals.sine(1.0, 2.0), at=0.0), Spring(4.0, 0.0, stiffness=0.5, at=4.0)
    return replace(untwisting_rod(), loads=(*start, Damping(rolling=0.1, torsion=0.05)), name="driven rod")


UNLOADED: dict[str, Callable[[], Scene]] = {
    **{law: partial(untwisting_rod, law) for law in ROLLING},
    "own": lambda: steered_rod(stretch_stiffness=10, shear_stiffness=10, heading_inertia=0.25),
}
SCENES = UNLOADED | {"tilted": tilted, "driven": driven}


def work_precision(
    scenes: Scene | dict[str, Scene],
    n: Sequence[int] = SIZES,
    methods: Callable[[Problem], list[Peer]] | None = None,
    repeats: int = 5,
    seconds: float = 10.0,
    progress: bool = True,
    into: WorkPrecision | None = None,
    own: Callable[[Problem], list[Peer]] = ours,
) -> WorkPrecision:
    """Measure speed against error at the end of scenes.

    Every method runs from loose to tight settings, once. A run is cut off after `seconds`; after two such runs, or once a method
    has taken three times that, its tighter settings are left out, and the table says so. (CVODE may be slow at one tolerance and
    not at the next.) Runs that took less than `seconds`/(4 `repeats`) are then timed in `repeats` rounds, and the median counts. A
    round runs all methods and settings, each first to warm up and then timed, so that a slow minute of the machine affects all of
    them. Longer runs are repeated once, in the first round, and the mean of both times counts.

    Parameters
    ----------
    scenes : a scene, or several by name.
    n : numbers of discs, with plain springs at free ends.
    methods : problem -> peers to run; None takes those that are installed.
    repeats : number of rounds.
    seconds : the longest processor time for one run; three times that for all runs of a method on a problem.
    progress : show a progress bar.
    own : problem -> our methods to run.
    into : filled and returned, problem by problem, so that an interrupted run keeps the finished ones; a new one by default.

    Raises
    ------
    ValueError : for sizes, repeats or times that are not positive.
    """
    checks.whole("repeats", repeats, 1)
    checks.number("seconds", seconds, positive=True)
    named = scenes if isinstance(scenes, dict) else {scenes.name: scenes}
    into = WorkPrecision([], {}, {}) if into is None else into
    for name, scene in named.items():
        for size in n:
            problem = lump(scene, size)
            exact, floor = reference(problem)
            mine = own(problem)
            others = peers(problem) if methods is None else methods(problem)
            entries: list[_Entry] = []
            for peer in tqdm([*mine, *others], desc=f"{name}, N = {size}", disable=not progress, leave=False):
                entries += _first_runs(peer, Row(name, size, peer.name, peer in mine), exact, seconds)
            timed = [entry for entry in entries if not np.isnan(entry.row.error)]
            for turn in tqdm(range(repeats), desc=f"{name}, N = {size}, rounds", disable=not progress, leave=False):
                for entry in timed:
                    if entry.row.seconds < seconds / (4 * repeats):
                        entry.run_again(seconds)
                    elif not turn:
                        entry.run_once_more(seconds)
            into.rows.extend(entry.result() for entry in entries)
            into.references[name, size] = floor
            into.differences.update({peer.name: peer.tells for peer in [*mine, *others] if peer.tells})
    return into


@dataclass(eq=False)
class _Entry:
    """A row with the time of its first run, how to run it again, and the times that count, s."""

    row: Row
    peer: Peer
    times: list[float] = field(default_factory=list)

    def run_again(self, limit: float) -> None:
        """Run twice: to warm up, and timed."""
        with suppress(Cutoff, *FAILURES), warnings.catch_warnings(action="ignore"):
            self.peer.run(self.row.setting, limit)
            self.times.append(self.peer.run(self.row.setting, limit).seconds)

    def run_once_more(self, limit: float) -> None:
        """Run once, timed; the first run counts too."""
        self.times.append(self.row.seconds)
        with suppress(Cutoff, *FAILURES), warnings.catch_warnings(action="ignore"):
            self.times.append(self.peer.run(self.row.setting, limit).seconds)

    def result(self) -> Row:
        return self.row._replace(seconds=float(np.median(self.times))) if self.times else self.row


def _first_runs(peer: Peer, blank: Row, exact: Float, limit: float) -> list[_Entry]:
    """A method's runs from loose to tight."""
    entries: list[_Entry] = []
    started, cut = clock.process_time(), 0

    def add(row: Row) -> None:
        entries.append(_Entry(row, peer))

    for setting in peer.settings:
        begun = clock.process_time()
        row, more = blank._replace(setting=setting), setting != peer.settings[-1]
        try:
            with warnings.catch_warnings(action="ignore"):
                found = peer.run(setting, limit)
                if not entries:  # loading and compiling are not part of a method's time
                    started = clock.process_time()
                    found = peer.run(setting, limit)
        except Cutoff:
            cut += 1
            remark = f"cut off after {limit:g} s" + "; tighter left out" * (cut == 2 and more)
            add(row._replace(seconds=clock.process_time() - begun, remark=remark))
            if cut == 2:
                break
            continue
        except FAILURES as error:
            add(row._replace(seconds=clock.process_time() - begun, remark=f"failed: {error}".replace("\n", " ")[:100]))
            continue
        off = distance(found.q, exact)
        tolerance = setting if setting < 1 else np.nan
        remark = "says it succeeded, and is wrong" if off > max(WRONG * tolerance, 0.01) else ""
        row = row._replace(
            error=off, rms=rms_distance(found.q, exact), seconds=found.seconds, steps=found.steps or None, gradients=found.gradients
        )
        add(row._replace(gradients=found.gradients, solves=found.solves, remark=remark))
        if clock.process_time() - started > 3 * limit and more:
            add(blank._replace(setting=setting, remark=f"tighter left out after {3 * limit:g} s"))
            break
    return entries
