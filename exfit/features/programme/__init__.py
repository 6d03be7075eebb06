"""Programmes: all tests of a unit, run in the order in which one feeds the next, and resumed."""
