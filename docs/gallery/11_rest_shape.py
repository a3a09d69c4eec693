"""Rest shape: a straight rod with a rest curvature bends until damping brings it to rest."""

from dataclasses import replace

from compare import lump
from continuum import steered_rod
from discs import simulate
from discs.loads import Damping, Rest, signals

loads = Rest(curvature=0.8, signal=signals.smooth(0.0, 1.0)), Damping(rolling=0.5, bending=0.5, torsion=0.5)
problem = replace(lump(steered_rod(twist=0.0, duration=8.0), n=17), loads=loads)
simulate(problem, dt=0.04, frames=41).plot_motion().figure.savefig("11_rest_shape.png")
