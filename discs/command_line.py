"""Shared parts of the command lines: options of a run, descriptions of files, exit codes."""

import argparse
import os
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from discs.chains.stencils import ENDS
from discs.files import exports, safe
from discs.files.archive import load, recorded, replacing
from discs.files.framefile import FrameFile
from discs.files.safe import check_writable, fresh
from discs.files.schema import describe
from discs.files.untrusted import printable
from discs.integrators import METHODS
from discs.loads import OnRod
from discs.loads.tables import load_of_words
from discs.mechanics import Trajectory
from discs.problem import Problem
from discs.running.engine import ENGINES
from discs.running.failure import SimulationError
from discs.running.frames import WANTS
from discs.simulation import simulate
from discs.solution import Solution
from discs.stats import doubts

OFFERS = sorted({name for method in METHODS.values() for name in method.offers})


def add_run_options(p: argparse.ArgumentParser) -> None:
    """Options of `run_discs`."""
    p.add_argument("--n", metavar="N", type=int, default=64, help="number of discs (default: 64)")
    p.add_argument(
        "--ends",
        choices=[e for e in ENDS if e != "ring"],
        default="springs",
        help="how the free ends are treated (default: springs)",
    )
    p.add_argument(
        "--degree",
        metavar="P",
        type=int,
        default=1,
        help="2: discs with headings of their own in elements of three, errors fall like 1/N^4, not 1/N^2 (default: 1)",
    )
    p.add_argument(
        "--method",
        choices=("auto", *METHODS),
        metavar="NAME",
        help=f"auto, {', '.join(METHODS)} (default: auto; midpoint with --dt)",
    )
    p.add_argument("--dt", metavar="DT", type=float, help="time step, time (default: suggested for the method, and printed)")
    p.add_argument(
        "--tol",
        metavar="TOL",
        type=float,
        help="instead of --dt: largest error, relative (default: 1e-3, without --dt and --method)",
    )
    p.add_argument("--frames", metavar="F", type=int, default=101, help="frames, equally spaced over the time (default: 101)")
    p.add_argument(
        "--want", metavar="NAME", nargs="+", default=[], help=f"record also {', '.join((*WANTS, *OFFERS))} (default: none)"
    )
    add_loads(p)
    said = "compiled; plain, NumPy and SciPy; ready, compiled if kernels are there; auto, which also compiles them (default: auto)"
    p.add_argument("--engine", choices=ENGINES, help=said)
    p.add_argument("--threads", metavar="N", type=int, default=1, help="cores for one chain of thousands of discs (default: 1)")
    add_saving(p)


def add_loads(p: argparse.ArgumentParser) -> None:
    """The option for loads."""
    p.add_argument(
        "--load",
        metavar=("NAME", "KEY=VALUE"),
        nargs="+",
        action="append",
        default=[],
        help="a load of discs.loads, as --load Torque pattern=0.3 at=0.0 'signal={name=\"sine\", amplitude=1.0, rate=2.0}'; "
        "may be given several times (default: none)",
    )


def add_saving(p: argparse.ArgumentParser) -> None:
    """Options for saving."""
    p.add_argument(
        "--save",
        metavar="FILE",
        help="file for the run: .nc (all of it, frame by frame), .csv, .glb (Blender) or .vtkhdf (ParaView) (default: not saved)",
    )
    p.add_argument("--overwrite", action="store_true", help="replace FILE if there is another run in it (default: refuse)")
    p.add_argument("--quiet", action="store_true", help="no progress bars")


def add_file_commands(commands: "argparse._SubParsersAction[argparse.ArgumentParser]", program: str) -> None:
    """The commands that read a file."""
    p = commands.add_parser(
        "info",
        help="say what is in a file",
        description="Print what is in the file of a saved run: a summary, its parameters and the versions that it was made with.",
        epilog=f"example: {program} info run.nc",
    )
    p.add_argument("file", metavar="FILE", help="a saved run")
    p.set_defaults(run=lambda options: print(about(options.file)))
    for name, what, out in (
        ("plot", "pictures of a run", "run.png"),
        ("animate", "a movie of the discs as they roll", "run.mp4"),
        ("view", "a page to turn and play the run in three dimensions", "run.html"),
    ):
        p = commands.add_parser(
            name,
            help=what,
            description=f"Read a saved run and write {what}.",
            epilog=f"example: {program} {name} run.nc --out {out}",
        )
        p.add_argument("file", metavar="FILE", help="a saved run")
        p.add_argument("--out", metavar="FILE", default=out, help=f"file to write (default: {out})")
        if name == "animate":
            p.add_argument("--fps", metavar="N", type=float, default=25, help="pictures a second (default: 25)")
        if name == "view":
            p.add_argument("--beside", metavar="FILE", help="another saved run, shown to the right (default: none)")
        p.set_defaults(run=draw)


def run_discs(problem: Problem, options: argparse.Namespace) -> None:
    """Run a problem with the given options and print a summary."""
    problem = replace(problem, loads=problem.loads + given_loads(options))
    streams = bool(options.save) and exports.check_kind(options.save) not in exports.KINDS
    clear_way(options, whole=not streams)
    run = simulate(
        problem,
        options.method,
        options.dt,
        tol=options.tol,
        frames=options.frames,
        want=options.want,
        engine=options.engine,
        threads=options.threads,
        progress=not options.quiet,
        checkpoint=options.save if streams else None,
    )
    print(summary(run))
    if options.save and not streams:
        run.save(options.save)
    if options.save:
        print(f"written to {options.save}")


def given_loads(options: argparse.Namespace) -> tuple[OnRod, ...]:
    """The loads that the options give."""
    return tuple(load_of_words(words) for words in options.load)


def clear_way(options: argparse.Namespace, whole: bool) -> None:
    """Before a run: ValueError if its file cannot be written. A run that is not saved `whole` at its end may continue from it."""
    if options.overwrite and not options.save:
        raise ValueError("--overwrite goes with --save FILE")
    if not options.save:
        return
    kind = exports.check_kind(options.save)
    path = safe.target(options.save)
    check_writable(path)
    if kind in exports.KINDS and options.overwrite:
        return  # what such a file holds is not known; the new one replaces it at the end
    if path.exists() and options.overwrite:
        with FrameFile.open(path):  # only a run is ever deleted
            pass
        with replacing(path) as real:
            if not whole:  # otherwise the new run replaces the old one at its end
                real.unlink()
    elif path.exists() and whole:
        raise ValueError(f"{path} exists; give --overwrite to replace it")


def summary(run: Solution | Trajectory) -> str:
    """A summary of a run in a few lines."""
    stats: Any = run.stats
    drift = np.abs(run.energy - run.energy[0]).max()
    if isinstance(run, Trajectory):
        what = f"mechanical system of the coordinates {printable(', '.join(run.names))}"
    else:
        what = f"field of the {printable(stats['scene']['name'])} on {run.s.size} nodes" if is_field(run) else f"{run.s.size} discs"
    lines = [f"{what}, {run.t.size} frames, t = {run.t[0]:g} to {run.t[-1]:g}"]
    if stats.get("frames_missing"):
        lines.append(f"unfinished: {stats['frames_missing']} frames are not there yet")
    done = [f"dt = {stats['dt']:g}" + (" (suggested)" if stats.get("dt_suggested") else "")] if stats.get("dt") else []
    done += [f"{stats['steps']} steps"] if "steps" in stats else []
    done += [f"{stats['seconds']:.3g} s"] if "seconds" in stats else []
    lines.append(f"method {printable(stats.get('method'))}" + (f": {', '.join(done)}" if done else ""))
    lines.append(f"energy {run.energy[0]:.9g}, changed by {drift:.1e} at most")
    if isinstance(run, Solution) and run.balance is not None:
        off = run.energy - run.work + run.dissipated
        balanced = f"balanced to {np.abs(off - off[0]).max():.1e}"
        lines.append(f"work of loads {run.work[-1]:.6g}, taken by dampers {run.dissipated[-1]:.6g}, {balanced}")
    if isinstance(run, Solution) and run.rolling_residual is not None:
        lines.append(f"largest slip {run.rolling_residual.max():.1e}")
    lines += [f"not to be trusted: {doubt}" for doubt in doubts(stats)]
    if isinstance(run, Solution) and run.error_estimate:
        errors = ", ".join(f"{printable(name)} {error:.1e}" for name, error in run.error_estimate.items())
        lines.append(f"estimated error: {errors}")
    return "\n".join(lines)


def is_field(run: Solution) -> bool:
    """Whether a run is a field, whose stats contain its scene."""
    return isinstance(run.stats.get("scene"), dict)


def about(path: str | Path) -> str:
    """Description of a file: the run, its parameters, the versions it was made with."""
    run, told = load(path), []
    if isinstance(run, Trajectory):
        told = [f"constraints of {printable(', '.join(run.owners))}"] * bool(run.owners)
    elif is_field(run):
        told = [_parameter_line(name, value) for name, value in run.stats["scene"].items()]
    elif run.problem is not None:
        numbers, arrays = describe(run.problem)
        told = [f"{name} = {value}" for name, value in numbers.items() if value is not None and name != "loads"]
        told += [printable(load) for load in run.problem.loads]
        told += [f"{name}: {value.size} numbers, {value.min():.6g} to {value.max():.6g}" for name, value in arrays.items()]
    with FrameFile.open(path) as file:
        made = ", ".join(f"{printable(name)} {printable(value)}" for name, value in file.attrs["versions"].items())
    return "\n".join([summary(run), f"recorded: {', '.join(recorded(run))}", *told, f"made with {made}"])


def _parameter_line(name: str, value: object) -> str:
    """A line for a parameter of a scene; of one that varies along the rod, a list of its values, the range."""
    if isinstance(value, list) and len(value) > 2 and all(isinstance(entry, float) for entry in value):
        return f"{printable(name)}: varies along the rod, {min(value):.6g} to {max(value):.6g}"
    return f"{printable(name)} = {printable(value)}"


def draw(options: argparse.Namespace) -> None:
    """Write the picture, movie or page that `options.command` names."""
    run, out = load(options.file), Path(options.out)
    check_writable(out)
    if options.command == "plot":
        with fresh(out) as new:
            figure = run.plot()[0].figure
            figure.savefig(new, format=out.suffix.removeprefix(".") or "png")  # type: ignore[union-attr]
    elif options.command == "animate":
        run.animate(out, fps=options.fps)
    else:
        run.view(out, beside=load(options.beside) if options.beside else None)
    print(f"written to {out}")


def failed(error: object, code: int) -> int:
    """Print an error in one line; text from files is escaped."""
    print(f"error: {printable(error)}", file=sys.stderr)
    return code


def main(parser: argparse.ArgumentParser, arguments: list[str] | None) -> int:
    """Run a command line; returns the exit code: 0 done, 1 the motion could not be continued, 2 bad input, 130 interrupted."""
    if "_ARGCOMPLETE" in os.environ:  # a shell asks, by argcomplete
        import argcomplete

        argcomplete.autocomplete(parser)
    options = parser.parse_args(arguments)
    formatted, warnings.formatwarning = warnings.formatwarning, lambda message, *_: f"warning: {message}\n"
    try:
        options.run(options)
    except (ValueError, OSError) as error:
        return failed(error, 2)
    except MemoryError as error:
        return failed(f"too large for this machine's memory: {error}", 2)
    except SimulationError as error:
        return failed(error, 1)
    except KeyboardInterrupt as stop:
        print(str(stop) or "interrupted; what is on disc is whole", file=sys.stderr)
        return 130
    finally:
        warnings.formatwarning = formatted
    return 0
