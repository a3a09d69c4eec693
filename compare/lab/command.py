"""The command `python -m compare lab`."""

import argparse
import asyncio
import sys
from contextlib import suppress

from compare.lab.messages import MOST_DISCS
from compare.lab.settings import Settings
from continuum.files import read_scene


def add_options(p: argparse.ArgumentParser) -> None:
    """The options."""
    p.add_argument("--scene", metavar="FILE.toml", help="a scene of your own, besides those of the menu (default: none)")
    p.add_argument("--n", metavar="N", type=int, default=32, help="number of discs at first (default: 32)")
    p.add_argument("--port", metavar="PORT", type=int, default=0, help="port of 127.0.0.1 (default: a free one)")
    p.add_argument("--no-browser", action="store_true", help="print the address and open no browser")
    p.add_argument("--stay", action="store_true", help="go on when the page is closed, until Ctrl-C")
    p.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Serve the lab until its page is closed, or Ctrl-C."""
    if not 2 <= options.n <= MOST_DISCS:
        raise ValueError(f"--n must be a whole number from 2 to {MOST_DISCS}; got {options.n}")
    if not 0 <= options.port < 1 << 16:
        raise ValueError(f"--port must be from 0 to 65535; got {options.port}")
    settings = Settings.of(read_scene(options.scene) if options.scene else None, options.n)
    settings.make_problem()  # what is wrong with it is said here, not on the page
    try:
        from compare.lab import server
    except ModuleNotFoundError as error:
        if error.name != "tornado":
            raise
        raise ValueError('the lab needs tornado: pip install "rolling-discs[lab]"') from None
    with suppress(KeyboardInterrupt):
        asyncio.run(server.serve(settings, options.port, not options.no_browser, options.stay))
    print("the lab has ended", file=sys.stderr)
