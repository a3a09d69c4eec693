"""Rolling rod: a straight rod rolls sideways. By the field law a small wave on it grows, by the unit law it does not."""

import matplotlib.pyplot as plt
import numpy as np

from compare import lump
from continuum import rolling_rod
from discs import simulate

for law in ("field", "unit"):
    run = simulate(lump(rolling_rod(law), n=64, ends="ring"), "gauss6", dt=0.05, frames=51)
    plt.semilogy(run.t, np.ptp(run.theta, axis=1), label=f"{law} law")
plt.gca().set(xlabel="t", ylabel="largest minus smallest roll angle")
plt.legend()
plt.savefig("06_rolling_rod.png")
