"""Records that show hardly anything go through the commands without a warning, a traceback or nan.

Each is a sample, or a few lines, of which a channel is dead, a mask leaves nothing or the record
ends where something begins.
"""

import re

import pytest
from mutant_runs import judged, run
from places import CONFIGS, SAMPLES

GOVERNED = """\
plant: {type: governor-playback}
governor:
  model: HYGOV
  parameters: {Tf: 0.05, Tg: 0.25, VELM: 0.12, At: 1.15, qNL: 0.07}
  free: {R: {start: 0.05, min: 0.01, max: 0.1}, Tr: {start: 5.0, min: 1.0}}
test: {steady_until: 2.0}
record: {file: record.csv, time: t, channels: {speed: speed, p: p}, gaps: skip}
given: exact
estimate: {search: local}
"""
FIRST_ORDER = """\
model: FIRST_ORDER
plant: {type: none}
test: TEST
record: {file: record.csv, time: t, channels: {vt: vt}}
given: exact
parameters: {free: {k: {start: 1, min: 0.1, max: 100}, a: {start: 1, min: 0.1, max: 100}}}
estimate: {search: local}
"""
LATE = "{begin: -9.0, vt0: 0.0, vref: [{at: {start: auto}, step: 1.0}]}"


def of_config(name, *changes):
    """Return a case of the collection that reads record.csv, after replacements."""
    text = (CONFIGS / f"{name}.yaml").read_text(encoding="utf-8")
    for old, new in ((r"\.\./sample_data/\w+\.csv", "record.csv"), *changes):
        text, count = re.subn(old, new, text)
        assert count, old
    return text


def sample(name, keep=lambda k, row: row):
    """Return a record of the samples, each row as ``keep`` has it: none if it is left out."""
    first, *rows = (SAMPLES / name).read_text(encoding="utf-8").splitlines()
    kept = (keep(k, row.split(",")) for k, row in enumerate(rows))
    return "\n".join([first, *(",".join(row) for row in kept if row)])


def without_p_in_the_event(_, row):
    return row if float(row[0]) <= 1.0 else [*row[:3], "", *row[4:]]


EVENT = sample("grid_event.csv")
INJECTION = "hydro_unit_injection.csv"
FLAT = sample("ac1a_channels.csv", lambda k, row: row if float(row[0]) <= 1.05 else [])
CASES = {
    "no step of vt": (of_config("machine_playback"), FLAT, "fit --search local"),
    "no field voltage": (
        of_config("machine_playback"),
        sample("ac1a_channels.csv", lambda k, row: [*row[:2], "0", *row[3:]]),
        "fit --search local",
    ),
    "masked": (
        of_config("grid_event", (" {2}channels:", "  mask: [[-1, 5.0], [5.001, 20]]\n  channels:")),
        EVENT,
        "check",
    ),
    "event at the end": (
        of_config("grid_event", (r"\Z", "\ntest: {steady_until: 11.9833}\n")),
        EVENT,
        "check",
    ),
    "no power in the event": (
        of_config("grid_event", (" {2}channels:", "  gaps: skip\n  channels:")),
        sample("grid_event.csv", without_p_in_the_event),
        "check",
    ),
    "exact match": (
        FIRST_ORDER.replace("TEST", "{vt0: 0, vref: [{at: 1, step: 1}]}"),
        "t,vt\n0.99,0\n1,0\n1.01,0.0396\n",
        "profile",
    ),
    "end after the step": (
        FIRST_ORDER.replace("TEST", LATE),
        "\n".join(["t,vt", *(f"{k / 100},{max(0.0, k - 100) / 55}" for k in range(111))]),
        "validate --as-found",
    ),
    "end at the rest": (
        GOVERNED,
        sample(INJECTION, lambda k, row: row if k % 2 == 0 and float(row[0]) <= 2.0 else []),
        "validate --as-found",
    ),
    "no sample at rest": (
        GOVERNED.replace("p: p", "p: p, gate: gate"),
        sample(
            INJECTION,
            lambda k, row: [] if k % 200 else row if k else [*row[:3], ""],
        ),
        "validate --as-found",
    ),
    "no upper bound": (GOVERNED, sample(INJECTION), "profile"),
    "speed of 1e9": (
        GOVERNED + "simulation: {step: 1.0}\n",
        sample(INJECTION, lambda k, row: [] if k % 2 else [row[0], f"{float(row[1])}e9", *row[2:]]),
        "fit",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_record_that_shows_little_is_used_or_refused(name, tmp_path, monkeypatch):
    case, record, command = CASES[name]
    (tmp_path / "case.yaml").write_text(case, encoding="utf-8")
    (tmp_path / "record.csv").write_text(record, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    command, *options = command.split()
    written = [] if command == "check" else ["-o", "out", "--no-plots"]
    ended = run((command, "case.yaml", *options, *written))
    assert [*judged(ended)] == []
    assert not re.search(r"\bnan\b", ended.out + ended.err)
