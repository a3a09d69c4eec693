# PYTHON_ARGCOMPLETE_OK
"""Command line of `continuum`."""

import argparse
import sys
from dataclasses import replace

from continuum.files import read_scene
from continuum.mesh import semidiscretise
from continuum.rod import Scene
from continuum.scenes import untwisting_rod
from continuum.solver import solve
from continuum.wants import ARRAYS
from discs import command_line


def parser() -> argparse.ArgumentParser:
    """The parser of the command line."""
    p = argparse.ArgumentParser(
        prog="python -m continuum",
        description="The nonholonomic Cosserat rod: its fields, and its discs. Any consistent units.",
        epilog="example: python -m continuum solve --tol 1e-6 --save field.nc",
    )
    commands = p.add_subparsers(metavar="COMMAND", title="commands", required=True, dest="command")
    field = commands.add_parser(
        "solve",
        help="the fields of a scene to a tolerance",
        description="Compute the fields of a scene to a tolerance and print a summary with an estimate of the error. With --save "
        "they are written to a file.",
        epilog="example: python -m continuum solve --tol 1e-6 --save field.nc",
    )
    _add_scene(field)
    field.add_argument(
        "--tol", metavar="TOL", type=float, default=1e-5, help="largest error of x, y (length), theta, phi (rad) (default: 1e-5)"
    )
    field.add_argument(
        "--method", metavar="NAME", help="spectral, richardson, elements or leapfrog, see continuum.solve (default: fits the scene)"
    )
    field.add_argument("--n", metavar="N", type=int, help="nodes of leapfrog (default: 32)")
    field.add_argument("--dt", metavar="DT", type=float, help="time step of leapfrog (default: k^2/8)")
    field.add_argument(
        "--frames", metavar="F", type=int, default=101, help="number of frames, equally spaced in time (default: 101)"
    )
    field.add_argument("--want", metavar="NAME", nargs="+", default=[], help=f"give also {', '.join(ARRAYS)} (default: none)")
    command_line.add_loads(field)
    command_line.add_saving(field)
    field.set_defaults(run=run_solve)
    discs = commands.add_parser(
        "discs",
        help="a scene's rod as N discs",
        description="Lump a scene's rod into N discs and run them as python -m discs run does.",
        epilog="example: python -m continuum discs --scene FILE.toml --n 64 --save run.nc",
    )
    _add_scene(discs)
    command_line.add_run_options(discs)
    discs.set_defaults(run=run_discs)
    command_line.add_file_commands(commands, "python -m continuum")
    return p


def _add_scene(p: argparse.ArgumentParser) -> None:
    p.add_argument("--scene", metavar="FILE.toml", help="the scene (default: the paper's untwisting rod)")


def _scene(options: argparse.Namespace) -> Scene:
    return read_scene(options.scene) if options.scene else untwisting_rod()


def run_solve(options: argparse.Namespace) -> None:
    """The command `solve`."""
    scene = _scene(options)
    scene = replace(scene, loads=scene.loads + command_line.given_loads(options))
    command_line.clear_way(options, whole=True)
    field = solve(scene, options.tol, options.method, options.n, options.dt, options.frames, not options.quiet, want=options.want)
    if options.save:
        field.save(options.save)
    print(command_line.summary(field))
    if options.save:
        print(f"written to {options.save}")


def run_discs(options: argparse.Namespace) -> None:
    """The command `discs`."""
    command_line.run_discs(semidiscretise(_scene(options), options.n, options.ends, options.degree), options)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line. Returns the exit code: 0 done, 1 the motion could not continue, 2 bad input, 130 interrupted."""
    return command_line.main(parser(), arguments)


if __name__ == "__main__":
    sys.exit(main())
