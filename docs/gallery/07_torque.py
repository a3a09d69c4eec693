"""A driven end: a torque on the first disc pulls the others along. Work and energy agree."""

from dataclasses import replace

from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.loads import Torque, signals

push = Torque(0.5, signals.sine(amplitude=1.0, rate=2.0), at=0.0)
run = simulate(replace(untwisting_chain(17, twist=0.0, duration=6.0), loads=(push,)), dt=0.02, frames=61)
run.plot("motion", "omega", "energy")[0].figure.savefig("07_torque.png")
