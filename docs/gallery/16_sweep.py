"""Sweep: how far the end of the rod gets, against the initial twist."""

from concurrent.futures import ThreadPoolExecutor

import matplotlib.pyplot as plt

from compare import sweep
from discs import simulate
from discs.chains.twist import untwisting_chain


def reach(twist):
    return simulate(untwisting_chain(9, twist=twist), dt=0.05, frames=1).y[-1, 0]


results = sweep(reach, [0.1 * j for j in range(11)], ThreadPoolExecutor(1))
plt.plot([one.case for one in results], [one.value for one in results], "o-")
plt.gca().set(xlabel="turns between the ends", ylabel="y of the end disc")
plt.savefig("16_sweep.png")
