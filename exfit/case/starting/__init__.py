"""A case to start from: its tests, its unit, what is free, and its text."""
