"""Limiters of over- and underexcitation and of the stator current, a file for each."""
