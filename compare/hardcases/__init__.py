"""Hard cases: the results and limits of every method."""
