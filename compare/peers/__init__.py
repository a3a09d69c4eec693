"""Other programs that solve the same problems, each an optional extra (`pip install rolling-discs[peers]`)."""
