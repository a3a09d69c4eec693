"""Slope: a rod rolls down an inclined plane, slowed by rolling resistance, and bends as its ends are free."""

from dataclasses import replace

from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.loads import Damping, Slope

loads = Slope(gy=-0.5), Damping(rolling=0.5)
run = simulate(replace(untwisting_chain(17, "unit"), loads=loads), dt=0.02, frames=46)
run.plot_motion(instants=4).figure.savefig("09_slope.png")
