"""Own headings: the direction of each disc is an unknown, and beams join the discs. Over place and time: the heading."""

from compare import lump
from continuum import steered_rod
from discs import simulate

run = simulate(lump(steered_rod(), n=33), dt=0.02, frames=91)
motion, heading = run.plot("motion", "phi")
motion.figure.savefig("04_own_headings.png")
