"""Cross-checks with other programs: the same problem by ours and by theirs, with the difference, its order and both times."""
