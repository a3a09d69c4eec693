"""What the methods ask of a chain; `discs.kernels.slaved` and `discs.kernels.steered` fill it in, by the type of `chain`.

Arrays: positions and moves (rows, n), momenta (columns, n), one column for roll and one for turning where discs have their own
heading. `work` is what `workspace` made: arrays that these functions share, among them the shape of the base position.
"""

from discs.kernels.compiled import stub


@stub
def workspace(chain):
    """Room to work in."""


@stub
def settle(chain, work, hi, lo):
    """Take hi + lo as the base position: moves are reckoned from there."""


@stub
def frame(chain, work, move, c):
    """c = C after a move from the base."""


@stub
def pullback(chain, work, move, c, g):
    """g = C^T grad V after a move from the base, for the C given."""


@stub
def gradient(chain, work, move, g):
    """g = grad V, (rows, n), after a move from the base."""


@stub
def sweep(chain, work, h, pi, p, move, first):
    """One sweep of a midpoint step, the first or a later one: p and the half step `move`, in place; returns how far the move
    changed, in units of its scale."""


@stub
def factors(chain, g):
    """Room for the factors of `precondition`, real or complex as g is."""


@stub
def stiffness(chain, work, move, c, matrix):
    """The real matrix C^T (grad^2 V) C after a move, for the C given; of grad^2 V without what prestress adds."""


@stub
def precondition(chain, stiff, g, matrix):
    """Factors of I + g C^T (grad^2 V) C, `stiff` being that of `stiffness`."""


@stub
def correct(chain, matrix, r):
    """Solve with the factors of `precondition`, r (columns, n) in place."""


@stub
def potential(chain, work):
    """V at the base position."""


@stub
def vanishing(chain):
    """Whether a heading can vanish."""


@stub
def lost(chain, work, slope):
    """A disc whose heading vanishes on the straight way from `slope` (2, n) to the base's, or -1; then `slope` is the base's."""
