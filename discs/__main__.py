# PYTHON_ARGCOMPLETE_OK
"""Command line of `discs`."""

import argparse
import sys
from dataclasses import replace

from discs import command_line
from discs.analysis.lyapunov import lyapunov
from discs.analysis.modes import modes
from discs.chains.rolling import ROLLING
from discs.chains.twist import DURATION, PAPER, STEERED, TURNS, circle_chain, untwisting_chain
from discs.problem import Problem

UNITS = {
    "length": "length of the rod, length",
    "density": "rho, mass per length",
    "spin_inertia": "alpha, inertia about the axle per length, mass length",
    "torsion_stiffness": "beta, mass length^3/time^2",
    "bending_stiffness": "K, mass length^3/time^2",
    "radius": "R of the discs, length",
    "heading_inertia": "J, inertia about the vertical per length, mass length; --rolling own",
    "stretch_stiffness": "A, mass length/time^2; --rolling own",
    "shear_stiffness": "G, mass length/time^2; --rolling own",
}


def parser() -> argparse.ArgumentParser:
    """The options."""
    p = argparse.ArgumentParser(
        prog="python -m discs",
        description="N rolling discs joined by springs. Any consistent units. "
        "To run a scene from a file: python -m continuum discs --scene FILE.toml.",
        epilog="example: python -m discs run --n 64 --t 4.5 --save run.nc",
    )
    commands = p.add_subparsers(metavar="COMMAND", title="commands", required=True, dest="command")
    run = commands.add_parser(
        "run",
        help="run the paper's twist, or a rolling circle",
        description="Run a straight rod of discs that is twisted by half a turn and released, or with --ring a closed circle "
        "of discs. A summary is printed. With --save every frame is written as it comes; after Ctrl-C or a crash the same "
        "command continues the run.",
        epilog="example: python -m discs run --n 64 --t 4.5 --save run.nc",
    )
    run.add_argument("--t", metavar="T", type=float, default=DURATION, help=f"duration, time (default: {DURATION})")
    run.add_argument("--rolling", choices=(*ROLLING, "own"), default="field", help="law; own: own headings (default: field)")
    run.add_argument("--twist", metavar="TURNS", type=float, default=TURNS, help=f"turns between the ends (default: {TURNS})")
    run.add_argument(
        "--ring",
        metavar="RATE",
        type=float,
        help="instead of the twisted rod a closed circle of discs that all roll inwards at this rate, rad per time (default: none)",
    )
    command_line.add_run_options(run)
    _add_rod(run)
    run.set_defaults(run=run_twist)
    chaos = commands.add_parser(
        "lyapunov",
        help="rates at which errors grow along the motion",
        description="Print Lyapunov exponents of the twisted rod after its release, and the time after which an error of 1e-16 has "
        "grown to 1e-3. No file is written.",
        epilog="example: python -m discs lyapunov --n 17 --count 2",
    )
    chaos.add_argument("--t", metavar="T", type=float, default=DURATION, help=f"duration, time (default: {DURATION})")
    chaos.add_argument("--twist", metavar="TURNS", type=float, default=TURNS, help=f"turns between the ends (default: {TURNS})")
    chaos.add_argument("--dt", metavar="H", type=float, help="time step (default: suggested)")
    _add_straight(chaos, n=17, count=1, what="exponents")
    chaos.set_defaults(run=show_exponents)
    small = commands.add_parser(
        "modes",
        help="rates and shapes of small motions",
        description="Print growth and frequency of the slowest small motions of the straight rod, at rest or rolling sideways. No "
        "file is written.",
        epilog="example: python -m discs modes --n 64 --omega 0.5",
    )
    _add_straight(small, n=64, count=8, what="modes, zero left out")
    small.set_defaults(run=show_modes)
    command_line.add_file_commands(commands, "python -m discs")
    return p


def _add_straight(p: argparse.ArgumentParser, n: int, count: int, what: str) -> None:
    """Options of an analysis of a rod that is straight at first."""
    p.add_argument("--rolling", choices=(*ROLLING, "own"), default="field", help="law; own: own headings (default: field)")
    p.add_argument("--n", metavar="N", type=int, default=n, help=f"number of discs (default: {n})")
    p.add_argument("--count", metavar="M", type=int, default=count, help=f"how many {what} (default: {count})")
    p.add_argument("--omega", metavar="RATE", type=float, default=0.0, help="rate of roll, rad per time (default: 0, at rest)")
    p.add_argument(
        "--ends",
        choices=("springs", "consistent", "paper"),
        default="springs",
        help="how the free ends are treated (default: springs)",
    )
    p.add_argument("--degree", metavar="P", type=int, default=1, help="2: elements of three discs, --rolling own (default: 1)")
    command_line.add_loads(p)
    _add_rod(p)


def _add_rod(p: argparse.ArgumentParser) -> None:
    """Options for the parameters of the rod."""
    rod = p.add_argument_group("the rod")
    for name, value in (PAPER | STEERED).items():
        rod.add_argument(f"--{name.replace('_', '-')}", metavar="X", type=float, help=f"{UNITS[name]} (default: {value})")


def _rod(options: argparse.Namespace) -> dict[str, float]:
    """The parameters of the rod that are given."""
    return {name: value for name in PAPER | STEERED if (value := getattr(options, name)) is not None}


def _straight(options: argparse.Namespace, twist: float, duration: float) -> Problem:
    """The rod of `_add_straight`."""
    rod = untwisting_chain(options.n, options.rolling, options.ends, duration, twist, options.degree, **_rod(options))
    return replace(rod, initial=replace(rod.initial, omega=options.omega), loads=command_line.given_loads(options))


def show_modes(options: argparse.Namespace) -> None:
    """The command `modes`."""
    print(modes(_straight(options, 0.0, DURATION), options.count).table())


def show_exponents(options: argparse.Namespace) -> None:
    """The command `lyapunov`."""
    found = lyapunov(_straight(options, options.twist, options.t), options.count, options.dt)
    for exponent, error in zip(found.exponent, found.error, strict=True):
        print(f"{exponent:11.4g} +- {error:.2g}")
    print(f"an error of 1e-16 is 1e-3 after t = {found.horizon():.4g}")


def run_twist(options: argparse.Namespace) -> None:
    """The command `run`."""
    if options.ring is None:
        problem = untwisting_chain(
            options.n, options.rolling, options.ends, options.t, options.twist, options.degree, **_rod(options)
        )
    else:
        if options.twist != TURNS or options.ends != "springs":
            raise ValueError("--ring takes no --twist and no --ends: a circle has no ends; leave them out")
        problem = circle_chain(options.n, options.ring, options.rolling, options.t, options.degree, **_rod(options))
    command_line.run_discs(problem, options)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 the motion could not go on, 2 bad input, 130 interrupted."""
    return command_line.main(parser(), arguments)


if __name__ == "__main__":
    sys.exit(main())
