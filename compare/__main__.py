"""Command line of `compare`."""

import argparse
import sys
from pathlib import Path

from compare import load_limits, main_page, precision, report, slip
from compare.background import background
from compare.hardcases.table import Stability, kept, stability
from compare.help import COMMANDS
from compare.lab import command as lab_command
from compare.limits import limits
from compare.main_job import SIZES, overview, summary
from compare.outputs import fresh_files
from compare.random_runs import gathered as runs_of
from compare.random_runs import trust_runs
from compare.speed import speed
from compare.sweeps import read
from compare.trust import gathered, trust
from compare.trust_table import Trust
from compare.work_precision import WorkPrecision
from continuum import untwisting_rod
from continuum.files import read_scene
from discs import command_line
from discs.chains.rolling import ROLLING
from discs.kernels.background import compiling_aside, wait_for_kernels


def parser() -> argparse.ArgumentParser:
    """The options."""
    p = argparse.ArgumentParser(
        prog="python -m compare",
        description="Compare N rolling discs with the nonholonomic Cosserat rod to which they tend. Tables and pictures of "
        "convergence, motion, energy and speed are written to the folder --out, and all of them on one page, index.html.",
        epilog="example: python -m compare --n 17 33 65 129 --out out",
    )
    p.add_argument("--scene", metavar="FILE.toml", help="scene to compare; default: the paper's untwisting rod")
    p.add_argument("--rolling", choices=tuple(ROLLING), help="law of rolling of the default scene (default: field)")
    p.add_argument(
        "--out",
        metavar="DIR",
        default="out",
        help="folder for the results: table, convergence, motion, energy over 33 times the scene's duration (default: out)",
    )
    p.add_argument("--n", metavar="N", type=int, nargs="+", default=list(SIZES), help="numbers of discs (default: 17 ... 513)")
    p.add_argument(
        "--tol",
        metavar="TOL",
        type=float,
        default=1e-7,
        help="largest error of the field, length and rad (default: 1e-7, for the ground's force)",
    )
    p.add_argument(
        "--degree", type=int, choices=(1, 2), default=1, help="2: discs of order four, too; a scene with own headings (default: 1)"
    )
    p.add_argument("--no-speed", action="store_true", help="skip the table of speed against error")
    p.add_argument("--no-limits", action="store_true", help="skip the discs with own headings (default scene only)")
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run_main_job)
    commands = p.add_subparsers(metavar="COMMAND", title="commands (without one: the comparison above)")
    options = lab_command.add_options, add_precision, add_stability, add_trust, add_loads, add_slip, add_report
    for add, (name, (short, says, example)) in zip(options, COMMANDS.items(), strict=True):
        add(commands.add_parser(name, help=short, description=says, epilog=f"example: python -m compare {name} {example}"))
    return p


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
    """Run random scenes and write the table. If interrupted, write the results so far; the same command continues the run."""
    wait_for_kernels()
    runs = options.problems is not None
    archive = Path(options.out) / ("trust-runs.jsonl" if runs else "trust.jsonl")
    measure, collect, count = (trust_runs, runs_of, options.problems) if runs else (trust, gathered, options.scenes)
    try:
        given = options.seed, options.first, options.seconds
        found = measure(count, *given, archive=archive, progress=not options.quiet, loads=options.loads)
    except KeyboardInterrupt:
        if archive.exists():
            write_trust(collect(read(archive)), options.out)
            print(f"interrupted: {options.out} has the results so far; the same command continues the run", file=sys.stderr)
        raise
    write_trust(found, options.out)
    archive.unlink()  # a later run starts anew
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
    """Run the hard cases, write table and picture. If interrupted, write the results so far; the same command continues."""
    wait_for_kernels()
    archive = Path(options.out) / "stability.jsonl"
    try:
        found = stability(options.quick, seconds=options.seconds, archive=archive, progress=not options.quiet)
    except KeyboardInterrupt:
        if archive.exists():
            write_stability(kept(archive, options.quick), options.out)
            print(f"interrupted: {options.out} has the results so far; the same command continues the run", file=sys.stderr)
        raise
    write_stability(found, options.out)
    archive.unlink()  # a later run starts anew
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


def run_main_job(options: argparse.Namespace) -> None:
    """Compare discs with the field and, for the default scene, find the limits of discs with own headings."""
    if options.scene and options.rolling:
        raise ValueError("--rolling is for the default scene; a scene file sets its law with the key 'rolling'")
    scene = read_scene(options.scene) if options.scene else untwisting_rod(options.rolling or "field")
    measured, speeds = None, ""
    own_headings = not options.scene and not options.no_limits
    with compiling_aside(), background() as executor:
        studies = overview(scene, options.out, tuple(options.n), options.tol, not options.quiet, executor, options.degree)
        print(summary(studies))
        print(
            f"\nwritten to {options.out}: convergence.csv, convergence.png, limits-of-all.png, motion.png, energy.png\n", flush=True
        )
        if own_headings:
            print(limits(options.out, not options.quiet, executor=executor))
            print(f"\nwritten to {options.out}: headings.csv, limits.csv, locking.csv, limits.png\n", flush=True)
    if not options.no_speed:
        measured, speeds = speed(scene, not options.quiet)
        print(f"speed against error, processor time, plain springs:\n{speeds}")
        if measured is not None:
            with fresh_files(options.out) as folder:
                measured.save(folder / "speed.csv")
                measured.plot(folder / "speed.png")
            print(f"\nwritten to {options.out}: speed.csv, speed.png")
    page = main_page.write(options.out, studies, own_headings, speeds, timed=measured is not None)
    print(f"\nall tables and pictures on one page: {page}")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 the motion could not be continued, 2 bad input, 130 interrupted."""
    return command_line.main(parser(), arguments)


if __name__ == "__main__":
    sys.exit(main())
