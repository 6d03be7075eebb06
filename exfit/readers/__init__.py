"""Recorders' files, each kind read by a module of its own, all to the same table."""
