"""Damping: rolling resistance and viscous torsion take the energy of the twisted rod."""

from dataclasses import replace

import matplotlib.pyplot as plt

from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.loads import Damping

run = simulate(replace(untwisting_chain(17), loads=(Damping(rolling=0.3, torsion=0.1),)), dt=0.02, frames=91)
plt.plot(run.t, run.energy, label="energy")
plt.plot(run.t, run.dissipated, label="dissipated")
plt.legend()
plt.gca().set_xlabel("t")
plt.savefig("08_damping.png")
