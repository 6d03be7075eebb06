"""Grid events: a unit played back, the noise that drives it, PMU channels, causes of a misfit."""
