"""The first text of a case: what a record shows, and what is left to fill in."""
