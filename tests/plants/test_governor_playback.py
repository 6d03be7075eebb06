"""The governor alone, driven by a recorded speed: a second typing, and a fit through noise."""

import numpy as np
import pytest
from typed_governors import GOVERNORS, TYPICAL, integrated

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.workflows import fit, simulate

CASE = """\
plant: {type: governor-playback}
governor: {model: GOVERNOR, parameters: VALUES}
test: {steady_until: 1.0}
record: {file: record.csv, time: t, channels: {speed: n, pref: ref, p: P, gate: Y}}
"""
NOISE = {"speed": 2e-5, "p": 1e-3, "gate": 1e-3}


def speed(t):
    """A dip of the frequency with its recovery."""
    after = np.maximum(t - 1.0, 0.0)
    return -0.006 * (1.0 - np.exp(-after / 2.0)) * (0.6 + 0.4 * np.exp(-after / 8.0))


def pref(t, name):
    size = 0.0005 if name in ("TGOV1", "HYGOV") else 0.02
    return size * np.clip(t - 15.0, 0.0, 1.0)


def played(folder, name, noise=0.0, free=None):
    """Write the record of a governor as another typing simulates it, and its case."""
    time, model = np.arange(0.0, 30.0, 0.02), GOVERNORS[name](TYPICAL[name])
    x0, held = model.rest(0.6)

    def slopes(t, x):
        return model.slopes(x, speed(t), 0.0, held + pref(t, name))

    x = integrated(slopes, x0, time, (1.0, 15.0, 16.0))
    rng = np.random.default_rng(5)
    columns = {
        "speed": 1.0 + speed(time),
        "p": np.array([model.power(at, speed(t)) for t, at in zip(time, x.T, strict=True)]),
        "gate": x[model.gate],
    }
    for each, size in NOISE.items():
        columns[each] = columns[each] + noise * size * rng.standard_normal(len(time))
    table = [time, columns["speed"], held + pref(time, name), columns["p"], columns["gate"]]
    np.savetxt(
        folder / "record.csv", np.transpose(table), "%.9f", ",", header="t,n,ref,P,Y", comments=""
    )
    path = folder / "case.yaml"
    fixed = {key: value for key, value in TYPICAL[name].items() if key not in (free or {})}
    values = str(fixed) if free is None else f"{fixed}, free: {free}"
    path.write_text(CASE.replace("GOVERNOR", name).replace("VALUES", values.replace("'", "")))
    return load_case(path)


@pytest.mark.parametrize("name", TYPICAL)
def test_the_recorded_speed_gives_power_and_gate_of_a_second_typing(name, tmp_path):
    found = simulate(played(tmp_path, name), {}).comparison
    assert set(found.overlays) == {"p", "gate"}
    # the speed is drawn straight between samples of 20 ms, of nine digits
    for overlay in found.overlays.values():
        assert overlay.max_error < 2e-5


def test_droop_and_time_constants_are_found_through_noise_without_the_gate(tmp_path):
    free = {"R": {"start": 0.03, "min": 0.01, "max": 0.2}, "T3": {"start": 5, "min": 1, "max": 30}}
    path = played(tmp_path, "TGOV1", 1.0, free).path
    path.write_text(path.read_text().replace(", gate: Y", ""))
    found = fit(load_case(path)).parameters
    for name, true in (("governor.R", 0.05), ("governor.T3", 8.0)):
        low, high = found[name].interval
        assert low < true < high
        assert high - low < 0.06 * true


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("governor: {", "# {", "governor: is missing: plant governor-playback needs it"),
        ("speed: n, ", "", "channels.speed: is missing"),
        (", p: P", "", "channels.p: is missing"),
        ("plant:", "model: AC1A\nplant:", "model: not allowed with plant governor-playback"),
        ("TGOV1", "IESGO", "'IESGO' is not a governor"),
        ("gate: Y", "vt: Y", "channels.vt: not allowed with plant governor-playback"),
    ],
)
def test_what_contradicts_the_plant_is_refused(old, new, says, tmp_path):
    path = played(tmp_path, "TGOV1").path
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(CaseError, match=says):
        load_case(path)


def test_a_governor_without_a_gate_has_no_such_channel(tmp_path):
    path = played(tmp_path, "TGOV1").path
    path.write_text(
        path.read_text().replace("TGOV1", "IEESGO").partition(", parameters")[0]
        + "}\n"
        + "test: {steady_until: 1.0}\n"
        + CASE.splitlines()[-1]
    )
    with pytest.raises(CaseError, match="gate: IEESGO has no state that is the gate"):
        load_case(path)
