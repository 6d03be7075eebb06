"""Grid events: a unit played back, the noise that drives it, PMU channels, causes of a misfit."""

SUGGESTIONS = {"grid event": "suggestion:event_sections"}
PLANTS = {"grid-playback": "grid_playback:GRID_PLAYBACK"}
INPUT_NOISE = {
    "weighted search": "input_noise:weighted_search",
    "without bias": "input_noise:without_bias",
    "errors by noise": "input_noise:errors_by_noise",
}
CAUSES_BEFORE_FIT = {"records of events": "record_causes:event_causes"}
CAUSES_AT_REST = {"record of the event": "record_causes:wrong_event"}
CAUSES_OF_EVENTS = {
    "equation of the speed": "unit_causes:other_swing",
    "governor": "unit_causes:missing_governor",
    "stabiliser": "unit_causes:missing_stabiliser",
    "controls out of service": "unit_causes:idle_control",
    "inertia and damping": "unit_causes:other_motion",
    "transformer": "unit_causes:other_transformer",
}
