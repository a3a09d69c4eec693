"""Motor: one end rolls to and fro at a given rate. Below: the torque that it needs."""

from dataclasses import replace

import matplotlib.pyplot as plt

from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.loads import Motor, signals

problem = untwisting_chain(17, "unit", twist=0.0)
run = simulate(replace(problem, loads=(Motor(signals.sine(amplitude=0.6, rate=2.0), at=0.0),)), dt=0.02, frames=91)
fig, (above, below) = plt.subplots(2, figsize=(6, 7), layout="constrained")
run.plot_motion(ax=above)
below.plot(run.t, run.reaction[:, 0])
below.set(xlabel="t", ylabel="torque of the motor")
fig.savefig("10_motor.png")
