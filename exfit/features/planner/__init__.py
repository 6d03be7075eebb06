"""Planners' files."""
