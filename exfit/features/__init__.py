"""Beside the core: a folder each, with its commands, sections of a case, and what it shows."""
