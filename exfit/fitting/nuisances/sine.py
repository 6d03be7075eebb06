"""A periodic disturbance of a channel: what a fit finds of it, with exact derivatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.lines import cosine_and_sine

Array = NDArray[np.float64]
Values = Mapping[str, float]

COSINE, SINE, FREQUENCY = "cosine", "sine", "frequency"


@dataclass(frozen=True)
class Sine:
    """A disturbance of a signal: a cosine and a sine of one frequency about an instant (s).

    The amplitudes (pu) are found under ``name.cosine`` and ``name.sine``, and so is the
    ``frequency`` (Hz) where it is None, under ``name.frequency``. Amplitudes in place of an
    amplitude and a phase: the response is linear in them. About the middle of the record an error
    of the frequency is none of the phase.
    """

    name: str
    signal: str
    about: float
    frequency: float | None

    def samples(self, time: Array, values: Values) -> Array:
        """Return the disturbance (M,) at instants (M,) in s."""
        return np.asarray(self._pair(time, values) @ self._amplitudes(values))

    def slopes(self, time: Array, values: Values, moves: Sequence[Values]) -> Array:
        """Return its derivatives (M, N) along ``moves`` (N), which say what each changes."""
        pair = self._pair(time, values)
        cosine, sine = self._amplitudes(values)
        turned = sine * pair[:, 0] - cosine * pair[:, 1]
        columns = np.column_stack([pair, 2.0 * pi * (time - self.about) * turned])
        names = [f"{self.name}.{part}" for part in (COSINE, SINE, FREQUENCY)]
        changes = np.array([[move.get(name, 0.0) for name in names] for move in moves])
        return np.asarray(columns @ changes.reshape(-1, len(names)).T)

    def frequency_at(self, values: Values) -> float:
        """Return its frequency, Hz."""
        return values[f"{self.name}.{FREQUENCY}"] if self.frequency is None else self.frequency

    def amplitude_at(self, values: Values) -> float:
        """Return its amplitude, pu."""
        return float(np.hypot(*self._amplitudes(values)))

    def _pair(self, time: Array, values: Values) -> Array:
        return cosine_and_sine(self.frequency_at(values), time - self.about)

    def _amplitudes(self, values: Values) -> Array:
        return np.array([values[f"{self.name}.{part}"] for part in (COSINE, SINE)])
