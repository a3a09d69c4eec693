"""Ground's force: what keeps each disc from sliding. It is largest at the free ends."""

from compare import lump
from continuum import untwisting_rod
from discs import simulate

run = simulate(lump(untwisting_rod(), n=33), dt=0.02, frames=91, want=("contact_force",))
run.plot("contact_force")[0].figure.savefig("12_ground_force.png")
