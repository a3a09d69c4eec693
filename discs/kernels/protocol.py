"""What compiled steps ask of a chain, and the driver of a method: stubs, filled in by the type of their first argument.

`chain` and `method` are NamedTuples of parameters. Arrays: positions and moves (rows, n), momenta (columns, n), one column for roll
and one for turning where discs have their own heading. `work` is what `workspace` made: arrays that a chain's functions share,
among them the shape of the base position, from which moves are reckoned.
"""

from discs.kernels.compiled import stub


@stub
def workspace(chain):
    """Room to work in."""


@stub
def settle(chain, work, hi, lo):
    """Take hi + lo as the base position: moves are reckoned from there."""


@stub
def basis(chain, work, move, c):
    """c = C after a move from the base."""


@stub
def pullback(chain, work, state, t, move, c, p, g):
    """g = C^T (grad V - f) after a move from the base, the positions of `state`, for the C given; f at the time t and v = C p."""


@stub
def gradient(chain, work, move, g):
    """g = grad V, (rows, n), after a move from the base."""


@stub
def sweep(chain, work, state, t, h, p, move, first):
    """One sweep of a midpoint step from `state` at the time t, the first or a later one: p and the half step `move`, in place.

    Returns how far the move changed, in units of its scale."""


@stub
def factors(chain, g, count):
    """Room for `count` matrices of `precondition`, real or complex as g is."""


@stub
def pick(chain, matrices, j):
    """One of the matrices of `factors`."""


@stub
def stiffness(chain, work, move, c, matrix):
    """The real matrix C^T (grad^2 V) C after a move, for the C given; of grad^2 V without what prestress adds."""


@stub
def precondition(chain, stiff, c, d, g, matrix):
    """Factors of I + d C^T D C + g C^T (grad^2 V) C, `stiff` being that of `stiffness`, D the damping of the chain's load."""


@stub
def correct(chain, matrix, r):
    """Solve with the factors of `precondition`, r (columns, n) in place."""


@stub
def potential(chain, work):
    """V at the base position."""


@stub
def vanishing(chain):
    """Whether a heading can vanish, for a chain or a law of rolling."""


@stub
def lost(chain, work, slope):
    """A disc whose heading vanishes on the straight way from `slope` (2, n) to the base's, or -1; then `slope` is the base's."""


# What the driver asks of a method


@stub
def room(method, chain, state):
    """Arrays that a method's steps work in, for states of the kind of `state`."""


@stub
def step(method, chain, work, room, before, after, t, h):
    """A step from `before`, the base position, which is left as it is, at the time t to `after`, then the base position; returns
    its `Cost`."""


@stub
def jumps(method):
    """Whether stages jump to and fro, as in explicit steps: a heading that vanishes on the way is then told by the velocity."""


# What the driver asks of a state, `discs.skew.Phase` or what a method of several steps remembers


@stub
def like(state):
    """Room for another state."""


@stub
def take(state, to):
    """to = state."""


@stub
def kinetic(state, chain, h):
    """Kinetic energy; of what a method of several steps remembers, half a step h later."""


@stub
def rate(state, chain, work, c, tau, move):
    """move = tau times the velocities at a state, the base position; c is room for C."""


@stub
def kick(before, after, chain, work, t, h, c, g, defect):
    """defect = 12 times the error that the change of the force in a step of h from the time t tells of, `discs.running.step_error`.

    `after` is the base position; c and g are room like C and C^T grad V."""


# What a chain or a field asks of its law of rolling, `chain.rolling`; `vanishing` too


@stub
def contact(law, radius, half, x, y):
    """e = f J (a, b) and |e|^2 for r' = half (x, y): returns a, b, f, |e|^2."""


@stub
def jet(law, z, z1, z2):
    """h, h', h'' for z, z', z'', complex numbers: as `discs.chains.rolling.law.RollingLaw.jet`."""


# What a chain of slaved headings asks of its link law, `chain.links`; links (3, n + 1) as `discs.kernels.slaved` has them


@stub
def elastic(law, d):
    """V of links."""


@stub
def tension(law, ends, before, d, g):
    """g = mean derivative of V by the links over a step from `before` of which d is the middle; over none if they are the same.

    What pulls at ghosts is put on the links that they are made of.
    """


@stub
def assemble(law, ends, before, d, c, one, g, matrix):
    """Entries of `one` I + g C^T (grad^2 V) C for that step; only how soon sweeps converge depends on them."""


# What a chain asks of its load, `chain.load`


@stub
def loaded(load):
    """Whether there are loads: where not, what they need is left out of the code."""


@stub
def push(load, state, t, move, c, p, factor, g):
    """g += factor C^T f: loads after a move from the positions of `state`, at the time t and v = C p."""


@stub
def guide(load, c, d, g, roll, turn):
    """Add d C^T D C + g C^T (stiffness) C, which is diagonal, to roll (n,) and, where discs turn by themselves, to turn (n,)."""
