"""Command line of `compare`."""

import argparse
import sys

from compare.background import background
from compare.limits import limits
from compare.main_job import SIZES, overview, summary
from continuum import untwisting_rod
from continuum.files import read_scene
from discs import SimulationError


def parser() -> argparse.ArgumentParser:
    """The options."""
    p = argparse.ArgumentParser(
        prog="python -m compare",
        description="N rolling discs against the nonholonomic Cosserat rod: table, convergence, motion and energy.",
    )
    p.add_argument("--scene", metavar="FILE.toml", help="scene to compare; default: the paper's untwisting rod")
    p.add_argument("--rolling", choices=("field", "unit"), help="law of rolling of the default scene (default: field)")
    p.add_argument(
        "--out",
        metavar="DIR",
        default="out",
        help="folder for the results: table, convergence, motion, energy over 100/3 durations (default: out)",
    )
    p.add_argument("--n", metavar="N", type=int, nargs="+", default=list(SIZES), help="numbers of discs (default: 17 ... 513)")
    p.add_argument("--tol", metavar="TOL", type=float, default=1e-5, help="largest error of the field (default: 1e-5)")
    p.add_argument("--no-limits", action="store_true", help="of the default scene, leave out the discs with headings of their own")
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    return p


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 the motion could not go on, 2 bad input, 130 interrupted."""
    options = parser().parse_args(arguments)
    try:
        if options.scene and options.rolling:
            raise ValueError("--rolling belongs to the default scene; a scene file says its own law with the key 'rolling'")
        scene = read_scene(options.scene) if options.scene else untwisting_rod(options.rolling or "field")
        with background() as executor:
            studies = overview(scene, options.out, tuple(options.n), options.tol, not options.quiet, executor)
            print(summary(studies))
            print(f"\nwritten to {options.out}: convergence.csv, convergence.png, motion.png, energy.png\n", flush=True)
            if not options.scene and not options.no_limits:
                print(limits(options.out, not options.quiet, executor=executor))
                print(f"\nwritten to {options.out}: headings.csv, limits.csv, locking.csv, limits.png")
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except SimulationError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("interrupted; what is in the folder is whole", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
