"""Runs in files: archives, restart files, and how they are written and read safely."""
