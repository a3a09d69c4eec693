"""What is asked of a motion besides its run: the place of modes, Lyapunov exponents and gradients, none of which is written yet."""
