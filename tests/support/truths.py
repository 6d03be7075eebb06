"""Whether intervals hold the values that records were made with."""


def holds(interval, truth):
    """Return whether an interval, with None for an open side, holds the truth."""
    low, high = interval
    return (low is None or low <= truth) and (high is None or truth <= high)
