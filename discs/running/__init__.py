"""Runs: the time loop, frames and their recording, the suggested step, error estimates and tolerances."""
