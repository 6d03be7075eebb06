"""Checks of a case that no single key can make."""
