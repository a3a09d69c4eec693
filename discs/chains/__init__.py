"""Chains of rolling discs: their parameters, springs and equations of motion."""
