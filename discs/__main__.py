"""Command line of `discs`."""

import argparse
import sys
from dataclasses import replace

from discs import command_line
from discs.analysis.modes import modes
from discs.chains.rolling import ROLLING
from discs.chains.twist import DURATION, PAPER, STEERED, TURNS, untwisting_chain

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
    )
    commands = p.add_subparsers(metavar="COMMAND", title="commands", required=True, dest="command")
    run = commands.add_parser(
        "run",
        help="run the paper's twist",
        description="A straight rod of discs, twisted by half a turn, lets go. With --save every frame is written as it comes; "
        "after Ctrl-C or a crash the same command goes on where it was.",
    )
    run.add_argument("--t", metavar="T", type=float, default=DURATION, help=f"duration, time (default: {DURATION})")
    run.add_argument("--rolling", choices=(*ROLLING, "own"), default="field", help="law; own: own headings (default: field)")
    run.add_argument("--twist", metavar="TURNS", type=float, default=TURNS, help=f"turns between the ends (default: {TURNS})")
    command_line.add_run_options(run)
    _add_rod(run)
    run.set_defaults(run=run_twist)
    small = commands.add_parser(
        "modes",
        help="rates and shapes of small motions",
        description="The slowest small motions of the straight rod, at rest or rolling sideways: growth and frequency of each.",
    )
    small.add_argument("--rolling", choices=(*ROLLING, "own"), default="field", help="law; own: own headings (default: field)")
    small.add_argument("--n", metavar="N", type=int, default=64, help="number of discs (default: 64)")
    small.add_argument("--count", metavar="M", type=int, default=8, help="how many modes, zero left out (default: 8)")
    small.add_argument("--omega", metavar="RATE", type=float, default=0.0, help="rate of roll, rad per time (default: 0, at rest)")
    small.add_argument(
        "--ends",
        choices=("springs", "consistent", "paper"),
        default="springs",
        help="how the free ends are treated (default: springs)",
    )
    small.add_argument("--degree", metavar="P", type=int, default=1, help="2: elements of three discs, --rolling own (default: 1)")
    command_line.add_loads(small)
    _add_rod(small)
    small.set_defaults(run=show_modes)
    command_line.add_file_commands(commands)
    return p


def _add_rod(p: argparse.ArgumentParser) -> None:
    """Options for the parameters of the rod."""
    rod = p.add_argument_group("the rod")
    for name, value in (PAPER | STEERED).items():
        rod.add_argument(f"--{name.replace('_', '-')}", metavar="X", type=float, help=f"{UNITS[name]} (default: {value})")


def _rod(options: argparse.Namespace) -> dict[str, float]:
    """The parameters of the rod that are given."""
    return {name: value for name in PAPER | STEERED if (value := getattr(options, name)) is not None}


def show_modes(options: argparse.Namespace) -> None:
    """The command `modes`."""
    straight = untwisting_chain(options.n, options.rolling, options.ends, twist=0.0, degree=options.degree, **_rod(options))
    rolling = replace(straight.initial, omega=options.omega)
    print(modes(replace(straight, initial=rolling, loads=command_line.given_loads(options)), options.count).table())


def run_twist(options: argparse.Namespace) -> None:
    """The command `run`."""
    problem = untwisting_chain(options.n, options.rolling, options.ends, options.t, options.twist, options.degree, **_rod(options))
    command_line.run_discs(problem, options)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 the motion could not go on, 2 bad input, 130 interrupted."""
    return command_line.main(parser(), arguments)


if __name__ == "__main__":
    sys.exit(main())
