"""Play-in files: voltage and frequency in the units that their numbers show, faults with a line."""

import numpy as np
import pytest
from tiers import few_of

from exfit.errors import RecordError
from exfit.features.planner.play_in import play_in_record, play_in_text
from exfit.records.formats import open_table

TIME = np.arange(0.0, 2.0, 1.0 / 60.0)
VOLTAGE = 1.02 - 0.1 * np.exp(-TIME)
FREQUENCY = 60.0 + 0.1 * np.sin(TIME)


def rows(voltage=VOLTAGE, frequency=FREQUENCY):
    return play_in_text(zip(TIME.tolist(), voltage.tolist(), frequency.tolist(), strict=True))


def table_of(tmp_path, text):
    path = tmp_path / "event.plb"
    path.write_text(text)
    return open_table(path)


@pytest.mark.parametrize("separator", [", ", ",", "  ", "\t", " , "])
def test_what_is_written_is_read_to_its_digits(tmp_path, separator):
    table = table_of(tmp_path, rows().replace(", ", separator))
    assert table.names == ("t", "vt", "frequency")
    assert dict(table.units) == {"t": "s", "vt": "pu", "frequency": "Hz"}
    columns = table.numbers(table.names)
    for name, samples in {"t": TIME, "vt": VOLTAGE, "frequency": FREQUENCY}.items():
        assert columns[name] == pytest.approx(samples, rel=1e-8, abs=1e-8)


def test_files_of_any_length_go_there_and_back(tmp_path):
    """In nine digits, uneven times among them."""
    for seed in range(200):
        random = np.random.default_rng(seed)
        count = int(random.integers(3, 40))
        time = np.cumsum(random.uniform(1e-3, 0.1, count))
        voltage, frequency = random.uniform(0.6, 1.9, count), random.uniform(45.0, 65.0, count)
        text = play_in_text(zip(time.tolist(), voltage.tolist(), frequency.tolist(), strict=True))
        columns = table_of(tmp_path, text).numbers(("t", "vt", "frequency"))
        for name, samples in {"t": time, "vt": voltage, "frequency": frequency}.items():
            assert columns[name] == pytest.approx(samples, rel=1e-8), (seed, name)
        again = play_in_text(zip(*(columns[name].tolist() for name in columns), strict=True))
        assert again == text, seed


@pytest.mark.parametrize(
    ("voltage", "frequency", "units"),
    [(15.75, 1.0 / 60.0, {"frequency": "pu"}), (15750.0, 5.0 / 6.0, {"frequency": "Hz"})],
)
def test_units_are_those_that_the_numbers_show(tmp_path, voltage, frequency, units):
    """A voltage in V or kV has a scale in the record that plays the file, not in the file."""
    table = table_of(tmp_path, rows(voltage * VOLTAGE, frequency * FREQUENCY))
    assert dict(table.units) == {"t": "s", **units}


def test_deviations_are_no_frequency(tmp_path):
    with pytest.raises(RecordError, match=r"column 3: a frequency of .* is neither in Hz nor per"):
        table_of(tmp_path, rows(frequency=FREQUENCY - 60.0))


@pytest.mark.parametrize("seed", few_of(range(100), 25))
def test_a_damaged_file_is_reported_with_its_place_or_read(tmp_path, seed):
    random = np.random.default_rng(seed)
    data = bytearray(rows().encode())
    at = int(random.integers(len(data)))
    kind = seed % 5
    if kind == 0:
        data = data[:at]
    elif kind == 1:
        data[at : at + 1] = b"x"
    elif kind == 2:
        data[at:at] = bytes(random.integers(0, 256, 4, dtype=np.uint8))
    elif kind == 3:
        lines = data.split(b"\n")
        lines[int(random.integers(1, len(lines) - 1))] += b", 1.0"
        data = b"\n".join(lines)
    else:
        data[at:at] = b","
    path = tmp_path / "event.plb"
    path.write_bytes(bytes(data))
    fault = fault_of(path)
    assert fault == "" or fault.startswith(str(path))


def fault_of(path):
    """Return why a file cannot be used, "" where it can."""
    try:
        table = open_table(path)
        table.instants(["t"])
        table.numbers(["vt", "frequency"])
    except RecordError as error:
        return str(error)
    return ""


def test_the_record_that_plays_a_file_names_it_and_its_rated_frequency():
    record = play_in_record(101, "1", "event", 50.0)
    assert record == "101 'USRMDL' 1 'PLBVFU1' 1 1 3 4 3 6 1 1 'event' 1.0 50 0.0 0.0 /"
