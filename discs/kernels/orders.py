"""What an order of discs in lanes fills in: `discs.kernels.lanes`, one chain; `discs.kernels.parts`, one chain of several threads;
`discs.kernels.abreast`, several chains.

Arrays of discs are (n',), n' = LANES rows; those with a halo have two more rows at both ends. `first` is the row of disc 0 in its
lane. `ring` : whether the ends are joined. `ends` : as in `discs.kernels.slaved_matrix`.
"""

from discs.kernels.compiled import stub


@stub
def previous(order, v, w):
    """What is before the first row of each lane, from the last row, twice; beyond the ends of a chain it is not used."""


@stub
def join(order, ring, x):
    """Fill in the rows -2, -1 and `rows`, `rows` + 1 of x (K, n' + 2 HALO): the neighbours of each lane, beyond free ends 0."""


@stub
def wrap(order, x):
    """Fill in the rows `rows` and `rows` + 1 of x (K, n' + HALO) by what is next to each lane; free ends do not use them."""


@stub
def first_links(order, ring, shift, x, e, to):
    """Correct the links `to` (K, n' + 2 HALO) of positions x + e before the first disc: 0, or on a ring from the last one."""


@stub
def rejoin(order, base, move, to):
    """The same of a ring's links of x and y after a move from links `base`."""


@stub
def present(order, i):
    """1 where the row that begins at the entry i belongs to a disc, elsewhere 0."""


@stub
def record(order, state, v, energy, slip, spare, q, rates, told):
    """Record a frame, see `protocol.frame`, of a state with velocities v; energy and slip are vectors, parts of the energy and of
    the largest slip of one chain, or those of each."""


@stub
def close_links(order, ends, x):
    """Set the links of x and y before the first disc and after the last one, and those before `first`, whose headings are then
    those of disc 0."""


@stub
def pull_ends(order, springs, base, half, c, g):
    """Add the forces of the bending springs of consistent ends, after the move `half` from the links `base`, to g (n',)."""


@stub
def bend_ends(order, springs, base, still):
    """The energy of these springs twice, as a vector like `record` takes; `still` (2, n' + 2 HALO) are zeros."""


@stub
def corners(order, given, g, c, to):
    """to = g C^T (given) C, entries of the discs 0 with 3 and n - 4 with n - 1."""


@stub
def lead(order, m):
    """Put the couplings of a ring's first discs to its last ones in m.lead."""


@stub
def separators(order, g, count):
    """Workspace for `count` systems of `factor_separators`, real or complex as g."""


@stub
def factor_separators(order, ring, m, own, sums, ties):
    """Factor the system of the separators, one block of two for each lane.

    own : (3,), vectors, the block D of each lane. sums : (3,), what each lane leaves on the separator before it. ties : (4,), the
    block between a separator and the one before it. m : the workspace; for several chains the matrix itself.
    """


@stub
def solve_separators(order, ring, m, x, y, at_x, at_y):
    """The solution at the separators, (x, y), and at those before them, (p, q), for the right side (x, y), of which the lanes
    after them take (at_x, at_y)."""


@stub
def most(order, x):
    """The largest x of the threads that share a chain."""


@stub
def added(order, x):
    """The sum of their x."""


@stub
def halted(order, size):
    """As `discs.kernels.interrupts.interrupted`, for all of them at once."""


@stub
def matrices(order, g, count):
    """Workspace for `count` matrices of zeros, real or complex as g."""


@stub
def pick(m, j):
    """One of the matrices of `matrices`."""


@stub
def factor(order, ring, ghosts, m):
    """Factor a matrix, whose entries are a, u, w and, for consistent ends (`ghosts`), corners; on a ring they cross from the last
    disc to the first."""


@stub
def solve(order, ring, ghosts, m, b):
    """Solve with the factors of `factor`, b (n',) in place."""
