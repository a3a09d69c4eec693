"""Pictures, movies and web pages of runs."""
