"""Peers: other programs that solve the same problems, all optional (`pip install rolling-discs[peers]`)."""
