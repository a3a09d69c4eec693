"""The command `crosscheck`."""

import argparse

from compare.crosschecks.table import PEERS, crosscheck, summary
from discs.kernels.background import wait_for_kernels


def add_options(p: argparse.ArgumentParser) -> None:
    """The options of `crosscheck`."""
    names = [name for name, _, _ in PEERS.values()]
    p.add_argument("--out", metavar="DIR", default="out", help="folder for crosschecks.md, crosschecks.csv (default: out)")
    p.add_argument("--peers", metavar="PEER", nargs="+", choices=names, default=names, help=f"of {', '.join(names)} (default: all)")
    p.add_argument("--quiet", action="store_true", help="no progress bars")
    p.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Run the cross-checks and show their table."""
    wait_for_kernels()
    modules = [module for module, (name, _, _) in PEERS.items() if name in options.peers]
    print(summary(crosscheck(options.out, modules, not options.quiet)))
    print(f"\nwritten to {options.out}: crosschecks.md, crosschecks.csv")
