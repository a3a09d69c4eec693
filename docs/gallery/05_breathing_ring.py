"""Breathing ring: all discs of a circle roll inwards at the same rate."""

from compare import lump
from continuum import breathing_ring
from discs import simulate

run = simulate(lump(breathing_ring(duration=1.0), n=32, ends="ring"), dt=0.01, frames=41)
run.plot_motion(instants=4).figure.savefig("05_breathing_ring.png")
