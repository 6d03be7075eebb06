"""exfit: the parameters of a generator's excitation system from a recorded bump test."""

__version__ = "0.1.0"
