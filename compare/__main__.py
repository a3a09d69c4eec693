# PYTHON_ARGCOMPLETE_OK
"""Command line of `compare`: the main job, and the commands of `compare.commands`."""

import argparse
import sys
from contextlib import nullcontext

from compare import main_page
from compare.background import background
from compare.commands import COMMANDS
from compare.help import HELP
from compare.limits import limits
from compare.main_job import SIZES, overview, quick, summary
from compare.outputs import fresh_files
from compare.speed import speed
from continuum import untwisting_rod
from continuum.files import read_scene
from discs import command_line
from discs.chains.rolling import ROLLING
from discs.kernels.background import compiling_aside


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
    for name, add_options in COMMANDS.items():
        short, says, example = HELP[name]
        add_options(commands.add_parser(name, help=short, description=says, epilog=f"example: python -m compare {name} {example}"))
    return p


def run_main_job(options: argparse.Namespace) -> None:
    """Compare discs with the field and, for the default scene, find the limits of discs with own headings."""
    if options.scene and options.rolling:
        raise ValueError("--rolling is for the default scene; a scene file sets its law with the key 'rolling'")
    scene = read_scene(options.scene) if options.scene else untwisting_rod(options.rolling or "field")
    measured, speeds = None, ""
    own_headings = not options.scene and not options.no_limits
    with compiling_aside(), nullcontext() if quick(scene, tuple(options.n)) else background() as executor:
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
