"""Lines in the spectrum of errors: how probable they are by chance, where they lie, how large."""

from fractions import Fraction
from math import comb, floor

import numpy as np
import pytest

from exfit.dsp.lines import cosine_and_sine, largest_line, share_by_chance

SAMPLES, STEP = 1001, 0.01
TIME = STEP * np.arange(SAMPLES)
ALL = np.ones(SAMPLES, dtype=bool)


def white(seed):
    return np.random.default_rng(seed).standard_normal(SAMPLES)


@pytest.mark.long
def test_white_noise_has_as_large_a_line_as_often_as_the_test_says():
    rng = np.random.default_rng(3)
    samples, draws = 60, 300
    time, kept = STEP * np.arange(samples), np.ones(samples, dtype=bool)
    p_values = np.array(
        [largest_line(time, rng.standard_normal(samples), kept).p_value for _ in range(draws)]
    )
    for level in (0.03, 0.1):
        # four standard deviations of a count; the first term of the sum is the whole up to p^2
        scatter = 4.0 * np.sqrt(draws * level)
        assert abs(np.count_nonzero(p_values < level) - draws * level) <= scatter


@pytest.mark.parametrize(("share", "count"), [(0.2, 20), (0.27, 20), (0.4, 20), (0.13, 50)])
def test_the_probability_exceeds_the_whole_sum_of_fisher_by_less_than_its_square(share, count):
    whole = sum(
        (-1) ** (j - 1) * comb(count, j) * (1 - j * Fraction(share)) ** (count - 1)
        for j in range(1, floor(1 / share) + 1)
    )
    p_value = share_by_chance(share, count, count)
    assert float(whole) <= p_value <= float(whole) + p_value**2


def test_the_largest_line_is_where_it_is_put_and_as_large():
    frequency, amplitude, phase = 1.037, 0.8, 0.6
    about = 0.5 * (TIME[0] + TIME[-1])
    line = amplitude * np.cos(2 * np.pi * frequency * (TIME - about) + phase)
    found = largest_line(TIME, white(1) + line, ALL)
    spacing = 1.0 / (SAMPLES * STEP)
    # a frequency is known to sqrt(6 / M) / (pi T) noise / amplitude: 0.003 Hz; the grid has 0.005
    assert found.frequency == pytest.approx(frequency, abs=0.15 * spacing)
    # four standard errors, sqrt(2 / M) of the noise
    assert found.amplitude == pytest.approx(amplitude, abs=4 * np.sqrt(2 / SAMPLES))
    pair = cosine_and_sine(found.frequency, TIME - found.about)
    assert pair @ [found.cosine, found.sine] == pytest.approx(line, abs=0.3)
    assert found.p_value < 1e-10


def test_gaps_are_no_line():
    kept = (TIME < 4.0) | (TIME > 5.5)
    found = largest_line(TIME, white(2)[kept], kept)
    assert found.p_value > 0.01


def test_a_line_is_looked_for_in_its_range_only():
    errors = white(4) + np.cos(2 * np.pi * 1.0 * TIME) + 3.0 * np.cos(2 * np.pi * 9.0 * TIME)
    assert largest_line(TIME, errors, ALL).frequency == pytest.approx(9.0, abs=0.02)
    found = largest_line(TIME, errors, ALL, within=(0.5, 2.0))
    assert found.frequency == pytest.approx(1.0, abs=0.05)


def test_what_the_parameters_took_of_a_line_is_given_back():
    line = np.cos(2 * np.pi * 1.0 * TIME)
    slopes = (line + np.linspace(0.0, 1.0, SAMPLES))[:, None]
    left = line - slopes[:, 0] * (slopes[:, 0] @ line) / (slopes[:, 0] @ slopes[:, 0])
    plain, together = (largest_line(TIME, left, ALL, with_) for with_ in (None, slopes))
    assert abs(plain.amplitude - 1.0) > 0.1
    # the grid of frequencies holds 1.0 to a twentieth of the spacing
    assert together.amplitude == pytest.approx(1.0, abs=0.02)


def test_an_uneven_clock_and_a_range_without_frequencies_are_refused():
    with pytest.raises(ValueError, match="even sampling"):
        largest_line(TIME**1.1, white(1), ALL)
    for within in ((0.0, 0.05), (60.0, 90.0)):
        with pytest.raises(ValueError, match="no line"):
            largest_line(TIME, white(1), ALL, within=within)
