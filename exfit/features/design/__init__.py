"""Tests that are yet to be made: what they would show, and which would show most."""
