"""Runs of a system of equations over time, and what can be said of them."""
