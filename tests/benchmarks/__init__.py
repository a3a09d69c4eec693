"""What is timed: `make bench`. The names of files keep the suite from collecting them."""
