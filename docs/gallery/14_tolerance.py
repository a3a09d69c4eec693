"""A tolerance instead of a step: the method "auto" chooses both, and estimates the error."""

import matplotlib.pyplot as plt

from discs import simulate
from discs.chains.twist import untwisting_chain

tolerances = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
found = [simulate(untwisting_chain(9), "auto", tol=tol, frames=1).error_estimate["x"] for tol in tolerances]
plt.loglog(tolerances, found, "o-", label="estimated error of x")
plt.loglog(tolerances, tolerances, "k:", label="tolerance")
plt.legend()
plt.savefig("14_tolerance.png")
