"""Errors in variables: the noise of the recorded signals that drive a simulation."""
