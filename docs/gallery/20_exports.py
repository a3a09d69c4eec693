"""Exports: a run as a table, an archive, moving bodies for Blender or ParaView, and a movie."""

from discs import load, simulate
from discs.chains.twist import untwisting_chain

run = simulate(untwisting_chain(17), dt=0.02, frames=16)
for name in ("run.csv", "run.nc", "run.vtkhdf"):
    run.save(name)
load("run.nc").animate("20_exports.gif", fps=8, size=(480, 270))
