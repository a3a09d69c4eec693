"""Ensemble: where the end of the rod goes from 100 random twists, run together."""

import matplotlib.pyplot as plt
import numpy as np

from discs import simulate_many
from discs.chains.twist import untwisting_chain

twists = np.random.default_rng(1).normal(0.5, 0.1, 100)
runs = simulate_many([untwisting_chain(9, twist=twist) for twist in twists], "midpoint", dt=0.05, frames=2)
plt.scatter(runs.x[:, -1, 0], runs.y[:, -1, 0], c=twists)
plt.colorbar(label="turns between the ends")
plt.gca().set(xlabel="x", ylabel="y")
plt.savefig("17_ensemble.png")
