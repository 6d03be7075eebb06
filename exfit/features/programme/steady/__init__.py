"""Tests at rest: what points that were read from instruments say of a machine."""
