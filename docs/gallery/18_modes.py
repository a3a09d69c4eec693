"""Modes: the four slowest oscillations of the straight rod at rest."""

import matplotlib.pyplot as plt

from discs.analysis import modes
from discs.chains.twist import untwisting_chain

problem = untwisting_chain(33, twist=0.0)
found = modes(problem, count=8)
for j in (0, 2, 4, 6):  # they come in pairs, of the rates i w and -i w
    state = found.displaced(j, 1.0)
    plt.plot(problem.chain.s, state.theta, label=f"rate {abs(found.rate[j].imag):.3f}")
plt.gca().set(xlabel="s", ylabel="roll angle")
plt.legend()
plt.savefig("18_modes.png")
