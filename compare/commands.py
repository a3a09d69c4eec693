"""The commands of `python -m compare`: for each its options, and what it runs."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from compare import load_limits, precision, report, slip
from compare.crosschecks import command as crosschecks
from compare.hardcases.table import Stability, kept, stability
from compare.lab import command as lab_command
from compare.outputs import fresh_files
from compare.random_runs import gathered as runs_of
from compare.random_runs import trust_runs
from compare.sweeps import read
from compare.trust import gathered, trust
from compare.trust_table import Trust
from compare.work_precision import WorkPrecision
from continuum.files import read_scene
from discs.kernels.background import wait_for_kernels

Found = TypeVar("Found")


def measured(measure: Callable[[], Found], collect: Callable[[], Found], write: Callable[[Found], None], archive: Path) -> Found:
    """What `measure` finds, written; its archive is deleted then, so that a later run starts anew.

    If interrupted, what the archive has so far is collected and written; the same command then continues the run.
    """
    try:
        found = measure()
    except KeyboardInterrupt:
        if archive.exists():
            write(collect())
            print(f"interrupted: {archive.parent} has the results so far; the same command continues the run", file=sys.stderr)
        raise
    write(found)
    archive.unlink()
    return found


def add_trust(p: argparse.ArgumentParser) -> None:
    """The options of `trust`."""
    p.add_argument("--out", metavar="DIR", default="out", help="folder for trust.md and trust.csv (default: out)")
    p.add_argument("--scenes", metavar="M", type=int, default=200, help="number of scenes, of alternating kinds (default: 200)")
    p.add_argument(
        "--problems", metavar="M", type=int, help="so many random problems of discs, to tolerances by simulate, instead of scenes"
    )
    p.add_argument("--seed", metavar="SEED", type=int, default=0, help="seed of scenes and tolerances (default: 0)")
    p.add_argument("--first", metavar="I", type=int, default=0, help="number of the first scene (default: 0)")
    p.add_argument(
        "--seconds",
        metavar="S",
        type=float,
        default=60.0,
        help="processor time for one run, s; references four times (default: 60)",
    )
    p.add_argument("--loads", action="store_true", help="rods that vary, with loads")
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_trust)


def run_trust(options: argparse.Namespace) -> None:
    """Run random scenes and write the table; see `measured`."""
    wait_for_kernels()
    runs = options.problems is not None
    archive = Path(options.out) / ("trust-runs.jsonl" if runs else "trust.jsonl")
    measure, collect, count = (trust_runs, runs_of, options.problems) if runs else (trust, gathered, options.scenes)
    given = options.seed, options.first, options.seconds
    found = measured(
        lambda: measure(count, *given, archive=archive, progress=not options.quiet, loads=options.loads),
        lambda: collect(read(archive)),
        lambda found: write_trust(found, options.out),
        archive,
    )
    print(found.summary())
    print(f"\nwritten to {options.out}: trust.md, trust.csv")


def write_trust(found: Trust, out: str) -> None:
    """Table and rows."""
    with fresh_files(out) as folder:
        found.save(folder / "trust.csv")
        (folder / "trust.md").write_text(f"# Random scenes\n\n{found.summary()}\n\n{found.table()}\n", encoding="utf-8")


def add_slip(p: argparse.ArgumentParser) -> None:
    """The options of `slip`."""
    p.add_argument("--out", metavar="DIR", default="out", help="folder for slip.csv and slip.png (default: out)")
    p.add_argument("--n", metavar="N", type=int, nargs="+", default=list(slip.SIZES), help="numbers of discs (default: 9 ... 257)")
    p.add_argument(
        "--slips", metavar="EPSILON", type=float, nargs="+", default=list(slip.SLIPS), help="slips (default: 1e-1 ... 1e-6)"
    )
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_slip)


def run_slip(options: argparse.Namespace) -> None:
    """Compare discs that slide with discs that roll."""
    print(slip.slip_limits(options.out, not options.quiet, tuple(options.n), tuple(options.slips))[0])
    print(f"\nwritten to {options.out}: slip.csv, slip.png")


def add_loads(p: argparse.ArgumentParser) -> None:
    """The options of `loads`."""
    p.add_argument("--out", metavar="DIR", default="out", help="folder for loads.csv and loads.png (default: out)")
    p.add_argument(
        "--n", metavar="N", type=int, nargs="+", default=list(load_limits.SIZES), help="numbers of discs (default: 129 ... 1025)"
    )
    p.add_argument(
        "--tol", metavar="TOL", type=float, default=1e-8, help="largest error of the fields, length and rad (default: 1e-8)"
    )
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_loads)


def run_loads(options: argparse.Namespace) -> None:
    """Compare loaded discs with loaded fields."""
    print(load_limits.load_limits(options.out, not options.quiet, tuple(options.n), options.tol))
    print(f"\nwritten to {options.out}: loads.csv, loads.png")


def add_report(p: argparse.ArgumentParser) -> None:
    """The options of `report`."""
    p.add_argument(
        "--out", metavar="DIR", default="out", help="folder for report.html, report.md, pictures and data (default: out)"
    )
    p.add_argument(
        "--n", metavar="N", type=int, nargs="+", default=list(report.SIZES), help="numbers of discs (default: 17 ... 257)"
    )
    p.add_argument(
        "--tol", metavar="TOL", type=float, default=1e-4, help="largest error of the fields, length and rad (default: 1e-4)"
    )
    p.add_argument(
        "--scene",
        metavar="FILE.toml",
        help="a rod with free ends and no loads, under each law (default: the untwisting rod)",
    )
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_report)


def add_precision(p: argparse.ArgumentParser) -> None:
    """The options of `precision`."""
    p.add_argument(
        "--out", metavar="DIR", default="out", help="folder for precision.csv, precision.png, precision.md (default: out)"
    )
    p.add_argument(
        "--n", metavar="N", type=int, nargs="+", default=list(precision.SIZES), help="numbers of discs (default: 32 ... 2048)"
    )
    p.add_argument("--scene", metavar="FILE.toml", help="a scene of your own instead of --scenes (default: none)")
    p.add_argument(
        "--scenes",
        metavar="SCENE",
        nargs="+",
        choices=precision.SCENES,
        help=f"of {', '.join(precision.SCENES)}, the last two with loads (default: those without)",
    )
    p.add_argument(
        "--repeats", metavar="M", type=int, default=5, help="rounds that time each setting; long runs have two times (default: 5)"
    )
    p.add_argument("--seconds", metavar="S", type=float, default=10.0, help="longest processor time for one run, s (default: 10)")
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_precision)


def add_stability(p: argparse.ArgumentParser) -> None:
    """The options of `stability`."""
    p.add_argument(
        "--out", metavar="DIR", default="out", help="folder for stability.md, stability.csv, stability.png (default: out)"
    )
    p.add_argument("--quick", action="store_true", help="small cases only: less than a minute")
    p.add_argument(
        "--seconds", metavar="S", type=float, help="longest time for one run, s; for peers 2 at most (default: 60; quick: 1)"
    )
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_stability)


def run_stability(options: argparse.Namespace) -> None:
    """Run the hard cases, write table and picture; see `measured`."""
    wait_for_kernels()
    archive = Path(options.out) / "stability.jsonl"
    found = measured(
        lambda: stability(options.quick, seconds=options.seconds, archive=archive, progress=not options.quiet),
        lambda: kept(archive, options.quick),
        lambda found: write_stability(found, options.out),
        archive,
    )
    print(found.grid(), found.summary(), found.promise(), sep="\n\n")
    print(f"\nwritten to {options.out}: stability.md, stability.csv, stability.png")


def write_stability(found: Stability, out: str) -> None:
    """Table, runs and picture."""
    with fresh_files(out) as folder:
        found.save(folder / "stability.csv")
        found.plot(folder / "stability.png")
        (folder / "stability.md").write_text(found.report(), encoding="utf-8")


def run_precision(options: argparse.Namespace) -> None:
    """Measure speed against error and write table and picture; an interrupted run writes its results to precision-partial.*."""
    wait_for_kernels()
    if options.scene and options.scenes:
        raise ValueError("--scene FILE.toml takes the place of --scenes; give one of them")
    if options.scene:
        own = read_scene(options.scene)
        scenes = {own.name: own}
    else:
        scenes = {name: precision.SCENES[name]() for name in options.scenes or precision.UNLOADED}
    found, name, stopped = WorkPrecision([], {}, {}), "precision", False
    with fresh_files(options.out) as folder:
        try:
            precision.work_precision(
                scenes, tuple(options.n), None, options.repeats, options.seconds, not options.quiet, into=found
            )
        except KeyboardInterrupt:
            if not found.rows:
                raise
            name, stopped = "precision-partial", True
        found.save(folder / f"{name}.csv")
        found.plot(folder / f"{name}.png")
        (folder / f"{name}.md").write_text(found.report(), encoding="utf-8")
    print(found.report())
    print(f"\nwritten to {options.out}: {name}.csv, {name}.png, {name}.md")
    if stopped:
        raise KeyboardInterrupt("interrupted: these are the results so far")


def run_report(options: argparse.Namespace) -> None:
    """Write everything on one page."""
    wait_for_kernels()
    scene = read_scene(options.scene) if options.scene else None
    report.report(options.out, options.n, options.tol, progress=not options.quiet, scene=scene)
    print(f"written to {options.out}: report.html, report.md, pictures and their data")


COMMANDS: dict[str, Callable[[argparse.ArgumentParser], None]] = {
    "lab": lab_command.add_options,
    "precision": add_precision,
    "stability": add_stability,
    "trust": add_trust,
    "loads": add_loads,
    "slip": add_slip,
    "crosscheck": crosschecks.add_options,
    "report": add_report,
}
