"""Pictures, movies and pages of runs."""
