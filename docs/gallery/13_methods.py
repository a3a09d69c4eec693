"""Methods: the error of the energy by a method that conserves it and by one that does not, with the same step."""

import matplotlib.pyplot as plt

from discs import simulate
from discs.chains.twist import untwisting_chain
from discs.pictures.style import look

for method in ("midpoint", "rk4", "radau3"):
    run = simulate(untwisting_chain(9, duration=40.0), method, dt=0.1, frames=201)
    plt.semilogy(run.t[1:], abs(run.energy / run.energy[0] - 1)[1:] + 1e-17, color=look(method)["color"], label=method)
plt.gca().set(xlabel="t", ylabel="relative error of the energy")
plt.legend()
plt.savefig("13_methods.png")
