"""The paper's rod, let go: it untwists, rolls and turns. 33 discs from above, and five more panels."""

from discs import simulate
from discs.chains.twist import untwisting_chain

run = simulate(untwisting_chain(33), dt=0.02, frames=91)
run.plot()[0].figure.savefig("01_untwisting_rod.png")
