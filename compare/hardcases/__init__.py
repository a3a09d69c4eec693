"""Hard cases: what each method survives, and where it fails."""
