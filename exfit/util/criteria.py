"""The limits by which a report says whether a response matches its record: a case may give others.

No standard gives any: cf. NERC MOD-026-1, which asks for the response of the model beside the
recorded one. These are of the order that operators ask for: a tenth of the change that was
recorded, and less at rest (cf. AEMO, Power System Model Guidelines, on the accuracy of models).
"""

from typing import NamedTuple

ORIGIN = (
    "The defaults are those of exfit, of the order that operators ask for: a tenth of the change "
    "that was recorded, and less at rest (cf. AEMO, Power System Model Guidelines, on the accuracy "
    "of models). The standard itself gives none (cf. NERC MOD-026-1)"
)


class Criteria(NamedTuple):
    """The largest differences between simulated and recorded response that meet a criterion.

    rmse           rms of the difference, % of the change that was recorded
    final_value    % of that change
    overshoot      % of that change
    rise_time      % of the recorded time, as are peak_time and settling_time
    time           s: a time that differs by no more meets its criterion
    """

    rmse: float = 5.0
    final_value: float = 2.0
    overshoot: float = 5.0
    rise_time: float = 10.0
    peak_time: float = 10.0
    settling_time: float = 20.0
    time: float = 0.02
