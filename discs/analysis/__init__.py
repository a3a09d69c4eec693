"""Questions about a motion: modes and equilibria, Lyapunov exponents, gradients of a cost with respect to parameters."""
