"""A run on its way: the time loop, what is recorded, the step, the error."""
