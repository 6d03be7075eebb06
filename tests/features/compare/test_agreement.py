"""compare: the differences of two responses are what they are, whatever clocks they have."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH
from tiers import few_of

import exfit
from exfit import cli
from exfit.errors import RecordError
from exfit.features.compare.agreement import compare
from exfit.features.compare.figure import agreement as agreement_figure
from exfit.output import figures as plots
from exfit.output import run_folder

LAG = 0.25  # s
AT, SIZE = 1.0, 0.05


def rise(time, lag=LAG, at=AT):
    """Return two lags behind a step, as a voltage rises."""
    ago = np.maximum(time - at, 0.0) / lag
    return 1.0 + SIZE * (1.0 - (1.0 + ago) * np.exp(-ago))


def write(path, **columns):
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(f"{x:.12g}" for x in row) for row in rows]
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    return path


def clock(step, end=10.0, begin=0.0):
    return begin + step * np.arange(round((end - begin) / step) + 1)


@pytest.fixture(autouse=True)
def workplace(tmp_path, monkeypatch):
    """Work in an empty folder, and draw with few dots."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plots.style, "DPI", 40)


@pytest.fixture
def run(capsys):
    def command(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main(args=["compare", *map(str, arguments)], prog_name="exfit")
        shown = capsys.readouterr()
        return int(ended.value.code or 0), shown.out, shown.err

    return command


def of(agreement, signal="vt", first="A", second="B"):
    (difference,) = [
        each
        for each in agreement.differences
        if (each.signal, each.first, each.second) == (signal, first, second)
    ]
    return difference


def test_a_response_does_not_differ_from_itself():
    a = write("a.csv", t=clock(0.01), vt=rise(clock(0.01)))
    difference = of(compare([a, a]))
    assert (difference.rms, difference.largest[0], difference.interpolation) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("step", [0.01, 0.007, 0.0213])
def test_an_offset_is_the_difference_on_any_two_clocks(step):
    a = write("a.csv", t=clock(0.01), vt=rise(clock(0.01)))
    b = write("b.csv", t=clock(step), vt=rise(clock(step)) + 0.003)
    difference = of(compare([a, b]))
    assert len(difference.time) == pytest.approx(10.0 / min(step, 0.01), abs=2)
    assert difference.rms == pytest.approx(0.003, abs=difference.interpolation + 1e-9)
    assert difference.largest[0] == pytest.approx(0.003, abs=difference.interpolation + 1e-9)
    # a straight line is off by an eighth of the curvature times the step squared
    bound = max(step, 0.01) ** 2 / 8.0 * SIZE / LAG**2
    assert difference.interpolation <= (0.0 if step == 0.01 else 1.5 * bound)


def test_the_stated_error_of_interpolation_is_more_than_the_true_one():
    time, fine = clock(0.05), clock(0.001)
    a = write("a.csv", t=time, vt=np.sin(time))
    b = write("b.csv", t=fine, vt=np.sin(fine))
    difference = of(compare([a, b]))
    assert 0.0 < np.max(np.abs(difference.error)) < difference.interpolation


def test_the_rms_is_over_time_whatever_the_samples():
    """The difference is t: over one second, the mean of its square is a third."""
    uneven = np.concatenate([np.linspace(0.0, 0.1, 500), np.linspace(0.11, 1.0, 90)])
    a = write("a.csv", t=uneven, vt=np.ones(len(uneven)))
    b = write("b.csv", t=uneven, vt=1.0 + uneven)
    difference = of(compare([a, b]))
    assert difference.rms == pytest.approx(3.0**-0.5, rel=1e-4)  # of the trapezoids
    assert difference.largest == pytest.approx((1.0, 1.0))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_largest_difference_has_its_sign_and_its_instant(side):
    time = clock(0.01)
    bump = side * (0.03 * np.exp(-((time - 4.0) ** 2)) - 0.01 * np.exp(-((time - 8.0) ** 2)))
    a = write("a.csv", t=time, vt=np.ones(len(time)))
    b = write("b.csv", t=time, vt=1.0 + bump)
    assert of(compare([a, b])).largest == pytest.approx((0.03 * side, 4.0), rel=1e-6)


def test_nothing_is_compared_beyond_what_both_cover():
    a = write("a.csv", t=clock(0.01, 4.0, -1.0), vt=rise(clock(0.01, 4.0, -1.0)))
    b = write("b.csv", t=clock(0.02, 9.0, 0.5), vt=rise(clock(0.02, 9.0, 0.5)))
    difference = of(compare([a, b]))
    assert (difference.time[0], difference.time[-1]) == pytest.approx((0.5, 4.0))
    assert np.isfinite(difference.error).all()


def proposed(note):
    return float(note.partition("--shift B=")[2].split()[0])


def test_a_shift_puts_two_clocks_together_and_is_proposed():
    time = clock(0.01)
    a = write("a.csv", t=time, vt=rise(time))
    b = write("b.csv", t=time, vt=rise(time, at=3.0))
    (note,) = compare([a, b]).notes
    assert proposed(note) == pytest.approx(AT - 3.0, abs=1e-4)
    (note,) = compare([a, b], shifts={"B": -1.2}).notes
    assert proposed(note) == pytest.approx(AT - 3.0, abs=1e-4)
    agreement = compare([a, b], shifts={"B": -2.0})
    assert agreement.notes == ()
    assert of(agreement).rms == pytest.approx(0.0, abs=1e-9)


def test_final_values_are_the_means_of_the_last_twentieth():
    time = clock(0.01)
    ripple = 0.01 * np.sin(2.0 * np.pi * time / 0.1)  # five periods of it
    a = write("a.csv", t=time, vt=np.ones(len(time)) + ripple)
    b = write("b.csv", t=time, vt=np.full(len(time), 1.05))
    assert of(compare([a, b])).finals == pytest.approx((1.0, 1.05), abs=1e-4)


def test_final_values_are_of_the_time_that_both_show():
    """Where one ends in a gap, of what lies before it."""
    time = clock(0.01)
    falls = np.where(time < 8.0, 1.0, 0.5)
    for name, vt in (("a", falls), ("b", np.where(time < 8.0, 1.01, np.nan))):
        rows = (f"{t:.9g},{'' if np.isnan(y) else y}" for t, y in zip(time, vt, strict=True))
        Path(f"{name}.csv").write_text("\n".join(["t,vt", *rows]) + "\n")
    difference = of(compare([Path("a.csv"), Path("b.csv")]))
    assert difference.finals == pytest.approx((1.0, 1.01))


@pytest.mark.long
def test_features_stand_beside_each_other_with_the_step_found():
    """From 10 to 90 % two equal lags take 3.3579 times one of them."""
    time = clock(0.002)
    a = write("a.csv", t=time, vt=rise(time))
    b = write("b.csv", t=time, vt=rise(time, lag=2.0 * LAG))
    agreement = compare([a, b])
    assert agreement.step_at == pytest.approx(AT, abs=0.05)  # by the shape of the rise
    assert agreement.features["A"].rise_time == pytest.approx(3.3579 * LAG, rel=1e-3)
    assert agreement.features["B"].rise_time == pytest.approx(2.0 * 3.3579 * LAG, rel=1e-3)
    given = compare([a, b], step_at=AT)
    assert given.step_at == AT


def test_features_are_of_the_time_before_the_first_ends():
    """What the longer one shows behind it is not in them."""
    short, long = clock(0.01, 5.0), clock(0.01, 9.0)
    a = write("a.csv", t=short, vt=rise(short))
    b = write("b.csv", t=long, vt=rise(long) + np.where(long > 5.5, 0.02, 0.0))
    features = compare([a, b]).features
    assert features["B"].final_value == pytest.approx(features["A"].final_value, abs=1e-9)


@pytest.mark.parametrize("at", [-np.inf, np.nan, 1e308])
def test_the_time_of_a_step_is_a_number(at):
    a = write("a.csv", t=clock(0.01), vt=np.ones(len(clock(0.01))))
    with pytest.raises(RecordError, match=r"step: .* (is not a finite number|exceeds)"):
        compare([a, a], step_at=at)


def test_without_a_step_there_are_no_features():
    time = clock(0.01)
    a = write("a.csv", t=time, vt=np.ones(len(time)))
    agreement = compare([a, a])
    assert agreement.features == {}
    assert agreement.step_at is None


def test_a_record_is_never_interpolated():
    rng = np.random.default_rng(0)
    time, coarse = clock(0.001), clock(0.013)
    a = write("a.csv", t=time, vt=rise(time))
    b = write("b.csv", t=time, vt=rise(time) + 0.001)
    measured = rise(coarse) + 1e-3 * rng.standard_normal(len(coarse))
    record = write("record.csv", t=coarse, vt=measured)
    agreement = compare([a, b], record)
    difference = of(agreement, first="record", second="A")
    np.testing.assert_allclose(difference.time, coarse)
    np.testing.assert_allclose(difference.values[0], measured, rtol=0, atol=1e-11)
    assert difference.rms == pytest.approx(1e-3, rel=0.1)  # of 770 samples, 2.5 % is one sigma
    assert {*agreement.features} == {"A", "B", "record"}


def test_all_signals_in_common_are_compared_and_no_others():
    time = clock(0.01)
    a = write("a.csv", t=time, vt=rise(time), efd=2 * rise(time), ifd=time, VA=time)
    b = write("b.csv", t=time, vt=rise(time), efd=2 * rise(time) + 0.1, q=time, VA=time)
    agreement = compare([a, b])
    assert [each.signal for each in agreement.between] == ["vt", "efd"]
    assert of(agreement, "efd").rms == pytest.approx(0.1)
    by_name = compare([a, b], None, {"VA": ["VA"]})
    assert "VA" in [each.signal for each in by_name.between]


def test_a_fit_is_compared_with_an_export_of_another_program():
    time = clock(0.01)
    write("fit/response.csv", t=time, vt_measured=rise(time) + 1.0, vt_simulated=rise(time))
    Path("fit/result.json").write_text("{}")
    export = {"Time(s)": time, "VOLT 1 [GEN]": rise(time), "EFD": time}
    b = write("psse.csv", **export)
    columns = {"vt": ["VOLT 1 [GEN]"]}
    for fit in (Path("fit"), Path("fit/result.json"), Path("fit/response.csv")):
        agreement = compare([fit, b], Path("fit/response.csv"), columns)
        assert of(agreement).rms == 0.0
        assert of(agreement, first="record").finals[0] == pytest.approx(2.05, abs=1e-6)


def test_instants_that_rounding_hardly_tells_apart_are_compared():
    a = write("a.csv", t=[0.0, 5e-324], vt=[1.0, 1.0])
    assert of(compare([a, a])).rms == 0.0


def test_a_column_of_time_is_named_where_it_has_a_name_of_its_own():
    time = clock(0.01)
    a = write("a.csv", t=time, vt=rise(time))
    b = write("b.csv", vt=rise(time), sec=time)
    with pytest.raises(RecordError, match=r"b\.csv: no column seems .*--time .*'vt', 'sec'"):
        compare([a, b])
    assert of(compare([a, b], time=["sec"])).rms == 0.0


def test_of_instants_that_repeat_the_last_row_is_taken():
    """A simulator writes the instant of a step twice: before and after it."""
    a = write("a.csv", t=[0, 1, 1, 2], vt=[1, 1, 2, 2])
    b = write("b.csv", t=[0, 1, 2], vt=[1, 2, 2])
    agreement = compare([a, b])
    assert of(agreement).rms == 0.0
    assert any("1 repeated times" in note for note in agreement.notes)


def test_nothing_is_read_across_a_gap():
    time, fine = clock(0.1), clock(0.01)
    gappy = np.where((time > 4.0) & (time < 5.0), np.nan, time)
    a = write("a.csv", t=time, vt=gappy)
    b = write("b.csv", t=fine, vt=fine)
    difference = of(compare([a, b]))
    inside = (difference.time > 4.0 + 1e-6) & (difference.time < 5.0 - 1e-6)
    assert np.isnan(difference.error[inside]).all()
    assert np.isfinite(difference.error[~inside]).all()
    assert difference.rms == pytest.approx(0.0, abs=1e-9)


def good():
    time = clock(0.01)
    return write("a.csv", t=time, vt=rise(time)), write("b.csv", t=time, vt=rise(time))


NOWHERE = {"t": clock(0.01), "vt": np.full(1001, np.nan)}
REFUSED = {
    "no signal": ({"t": [0, 1], "x": [1, 1]}, ["no signal in common", "--columns"]),
    "no time": ({"t": [20, 21], "vt": [1, 1]}, ["no time in common", "--shift"]),
    "back": ({"t": [0, 2, 1], "vt": [1, 1, 1]}, ["b.csv", "'t'", "goes back"]),
    "lost time": ({"t": [0, np.nan], "vt": [1, 1]}, ["b.csv", "'t'", "not a finite"]),
    "no sample": (NOWHERE, ["vt", "samples of both"]),
}


@pytest.mark.parametrize(("b", "words"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_compared_is_refused(run, b, words):
    a, _ = good()
    code, out, err = run(a, write("b.csv", **b))
    assert (code, out) == (1, "")
    for word in words:
        assert word in err


def test_wrong_files_are_refused(run):
    a, b = good()
    Path("empty").mkdir()
    write("two/up.csv", t=[0, 1], vt_simulated=[1, 1])
    write("two/history.csv", iteration=[0, 1])
    Path("words.csv").write_text("t,vt\n0,high\n")
    for arguments, words in (
        (("none.csv", b), ["none.csv", "No such file"]),
        (("empty", b), ["empty: no response.csv"]),
        (("two", b), ["two: no response.csv", "name one of its files: up.csv\n"]),
        (("words.csv", b), ["words.csv:2", "'high'"]),
        ((a, b, "--columns", "vt=VOLT"), ["no file has a column 'VOLT'", f"{b} has 't', 'vt'"]),
        ((a, b, "--time", "sec"), ["no file has a column 'sec'"]),
        ((a, b, "--columns", "vt"), ["--columns vt: not of the form vt=VOLT"]),
        ((a, b, "--record", write("r.csv", t=[0, 1], x=[0, 1])), ["r.csv: no signal in common"]),
    ):
        code, out, err = run(*arguments)
        assert (code, out) == (1, ""), arguments
        for word in words:
            assert word in err


@pytest.mark.pixels
def test_the_command_writes_its_files_and_says_what_they_hold(run):
    time = clock(0.01)
    a, b = good()
    b = write("b.csv", t=time, vt=rise(time) + 0.002)
    code, out, _ = run(a, b, "--record", a)
    assert code == 0
    place = Path("runs/compare")
    assert {path.name for path in place.iterdir()} == {
        "compare.csv",
        "compare-record.csv",
        "compare.json",
        "compare.png",
    }
    header, *rows = csv.reader((place / "compare.csv").read_text().splitlines())
    assert header == ["t", "vt_A", "vt_B", "vt_difference"]
    assert {row[3] for row in rows} == {"0.002"}
    stored = json.loads((place / "compare.json").read_text())
    assert stored["differences"][0]["rms"] == pytest.approx(0.002)
    assert "B - A" in out
    assert "2.000e-03" in out
    assert max(map(len, out.splitlines())) <= 80
    code, printed, _ = run(a, b, "--record", a, "--json", "--no-plots", "-o", "other")
    assert json.loads(printed) == stored
    assert not Path("other/compare.png").exists()
    assert run(a, b, "--quiet", "--no-plots")[:2] == (0, "")


@pytest.mark.long
@pytest.mark.parametrize("record", [False, True])
def test_the_figure_has_a_panel_and_a_panel_of_differences_for_each_signal(record):
    time = clock(0.01)
    a = write("a.csv", t=time, vt=rise(time), efd=rise(time))
    b = write("b.csv", t=time, vt=rise(time) + 1e-3, efd=rise(time))
    figure = agreement_figure(compare([a, b], a if record else None))
    assert plots.png(figure)
    assert len(figure.axes) == 4
    curves, differences = figure.axes[:2]
    labels = [text.get_text() for text in curves.get_legend().get_texts()]
    of_zero, of_b = ", f = 0.00e+00 pu²", ", f = 5.00e-04 pu²"  # half of 1001 times 1e-6
    expected = ["record", f"A{of_zero}", f"B{of_b}"] if record else ["A", f"B{of_b}"]
    assert labels == expected
    assert "vt" in curves.get_ylabel()
    assert len(differences.lines) == (4 if record else 2)  # with zero
    assert figure.axes[-1].get_xlabel() == "time (s)"


@pytest.mark.long
def test_of_many_responses_the_differences_from_the_reference_are_drawn():
    time = clock(0.01)
    sources = [write(f"{k}.csv", t=time, vt=rise(time) + 1e-3 * k) for k in range(6)]
    for record, first in ((None, "A"), (sources[0], "record")):
        curves, differences = agreement_figure(compare(sources, record)).axes
        lines = curves.lines if record is None else curves.lines[1:]  # the record lies below
        assert len({(line.get_color(), line.get_linestyle()) for line in lines}) == len(sources)
        widths = [line.get_linewidth() for line in lines]
        assert widths == sorted(widths, reverse=True)  # what lies on top hides nothing
        labels = [text.get_text() for text in differences.get_legend().get_texts()]
        assert [label.split(" - ")[1] for label in labels] == [first] * len(labels)


def test_a_column_that_its_file_says_is_not_per_unit_is_refused(run):
    a, _ = good()
    rows = ((0.0, 15.75), (1.0, 15.75), (10.0, 16.5))
    for name in ("U [kV]", "U (V)", "U [%]"):
        other = write("other.csv", **{"t": [t for t, _ in rows], name: [u for _, u in rows]})
        code, out, err = run(a, other, "--columns", f"vt={name}")
        assert (code, out) == (1, "")
        assert f"other.csv: column '{name}' is in" in err
        assert "pu" in err
    other = write("other.csv", **{"t": [t for t, _ in rows], "U [pu]": [1.0, 1.0, 1.05]})
    assert run(a, other, "--columns", "vt=U [pu]")[0] == 0


# ---- any number of responses, their f, and their clocks


def noisy(time, seed=1):
    return rise(time) + 1e-4 * np.random.default_rng(seed).standard_normal(len(time))


def test_f_is_half_the_sum_of_squares_over_the_samples_of_the_record():
    """Of every second sample it is about half as large; the rmse stays."""
    time = clock(0.01)
    sources = [write(f"{k}.csv", t=time, vt=rise(time) + 1e-3 * k) for k in range(3)]
    measured = noisy(time)
    whole = compare(sources, write("record.csv", t=time, vt=measured))
    half = compare(sources, write("half.csv", t=time[::2], vt=measured[::2]))
    for k, name in enumerate("ABC"):
        errors = rise(time) + 1e-3 * k - measured
        entry, fewer = (of(each, first="record", second=name) for each in (whole, half))
        assert entry.f == pytest.approx(0.5 * float(errors @ errors), rel=1e-6)  # 12 digits
        assert (entry.count, fewer.count) == (1001, 501)
        assert entry.rmse == pytest.approx(np.sqrt(2.0 * entry.f / 1001))
        assert fewer.rmse == pytest.approx(entry.rmse, rel=0.1)
        assert of(half, first="record", second=name).f == pytest.approx(0.5 * entry.f, rel=0.2)
    assert [entry.second for entry in whole.from_reference] == ["A", "B", "C"]
    assert [entry.second for entry in whole.between] == ["B", "C"]


def test_without_a_record_the_first_is_the_reference():
    time = clock(0.01)
    sources = [write(f"{k}.csv", t=time, vt=rise(time) + 1e-3 * k) for k in range(3)]
    agreement = compare(sources)
    assert [(entry.first, entry.second) for entry in agreement.from_reference] == [
        ("A", "B"),
        ("A", "C"),
    ]
    assert of(agreement, second="C").f == pytest.approx(0.5 * 1001 * 4e-6)
    assert of(agreement, second="C").fit_percent == pytest.approx(
        100.0 * (1.0 - 2e-3 / np.std(rise(time))), abs=1e-3
    )


def test_all_are_compared_over_the_time_that_all_cover():
    """Else the f of one that ends early would be of fewer samples."""
    long, short = clock(0.01, 10.0), clock(0.02, 4.0, 0.5)
    sources = [
        write("a.csv", t=long, vt=rise(long)),
        write("b.csv", t=long, vt=rise(long) + 0.001),
        write("c.csv", t=short, vt=rise(short)),
    ]
    agreement = compare(sources, write("record.csv", t=long, vt=noisy(long)))
    assert {entry.count for entry in agreement.from_reference} == {351}
    assert {len(entry.time) for entry in agreement.between} == {351}


def test_one_response_is_compared_with_a_record(run):
    time = clock(0.01)
    a, record = write("a.csv", t=time, vt=rise(time)), write("r.csv", t=time, vt=noisy(time))
    code, out, _ = run(a, "--record", record)
    assert code == 0
    assert "A - record" in out
    header, *rows = csv.reader(Path("runs/compare/compare-record.csv").read_text().splitlines())
    assert header == ["t", "vt_record", "vt_A"]
    assert len(rows) == 1001
    assert run(a)[0] == 2
    run(a, a, "--no-plots")
    assert not Path("runs/compare/compare-record.csv").exists()  # of a former comparison


def test_more_responses_than_letters_have_names():
    a = write("a.csv", t=clock(1.0), vt=rise(clock(1.0)))
    names = [curve.name for curve in compare([a] * 28).curves]
    assert (names[0], names[25:]) == ("A", ["Z", "AA", "AB"])


@pytest.mark.parametrize("at", few_of([0.7, 3.0], 1))
def test_aligned_clocks_have_their_steps_together(at):
    """Known to the match of the same shape; noise of 1e-4 leaves less than a millisecond."""
    time = clock(0.01, 15.0)
    record = write("record.csv", t=time, vt=noisy(time))
    a = write("a.csv", t=time, vt=rise(time, at=at))
    b = write("b.csv", t=time, vt=rise(time))
    agreement = compare([a, b], record, align=True)
    shifts = {curve.name: curve.shift for curve in agreement.curves}
    assert shifts == {"A": pytest.approx(AT - at, abs=1e-3), "B": 0.0, "record": 0.0}
    assert of(agreement, first="record", second="A").rmse == pytest.approx(1e-4, rel=0.1)
    (note,) = agreement.notes
    assert "A is shifted by" in note
    (proposed,) = compare([a, b], record).notes
    assert f"f = {of(agreement, first='record', second='A').f:.2e}" in proposed
    assert "--align" in proposed


def test_clocks_without_a_time_in_common_are_aligned():
    """A recorder counts from midnight, a simulator from zero."""
    time, midnight = clock(0.01), clock(0.01, 40010.0, 40000.0)
    a = write("a.csv", t=time, vt=rise(time))
    b = write("b.csv", t=midnight, vt=rise(midnight, at=40002.0))
    with pytest.raises(RecordError, match=r"no time in common.*--align"):
        compare([a, b])
    assert compare([a, b], align=True).curves[1].shift == pytest.approx(AT - 40002.0, abs=1e-3)


@pytest.mark.parametrize("lag", [LAG, 2.0 * LAG])
def test_clocks_that_are_one_are_not_moved_whatever_the_shape(lag):
    """What is detected differs by some of the rise: that is no difference of clocks."""
    time = clock(0.01)
    a, b = (write(f"{k}.csv", t=time, vt=rise(time, lag=k)) for k in (LAG, lag))
    agreement = compare([a, b], align=True)
    assert [curve.shift for curve in agreement.curves] == [0.0, 0.0]
    assert agreement.notes == ()


def test_what_cannot_be_aligned_or_shifted_is_refused(run):
    time = clock(0.01)
    a, b = good()
    flat = write("flat.csv", t=time, vt=np.ones(len(time)))
    for arguments, code, words in (
        ((a, flat, "--align"), 1, ["--align: B, flat.csv", "no step", "--shift"]),
        ((a, b, "--align", "--shift", "1"), 2, ["--align", "--shift"]),
        ((a, b, "--shift", "C=1"), 1, ["--shift C", "known: A, B"]),
        ((a, b, "--shift", "B=soon"), 1, ["--shift B=soon: not of the form B=0.5"]),
        ((a, b, "--shift", "1", "--shift", "B=2"), 1, ["shifted twice"]),
        ((a, b, "--shift", "nan"), 1, ["not of the form"]),
    ):
        ended, out, err = run(*arguments)
        assert (ended, out) == (code, ""), arguments
        for word in words:
            assert word in err
    code, out, _ = run(a, b, a, "--shift", "1", "--shift", "C=-0.5", "--no-plots", "--json")
    shifts = {name: curve["shift"] for name, curve in json.loads(out)["curves"].items()}
    assert (code, shifts) == (0, {"A": 0.0, "B": 1.0, "C": -0.5})


def test_each_file_is_read_by_the_column_that_it_has(run):
    time = clock(0.01)
    sources = [
        write("a.csv", t=time, V_t=rise(time)),
        write("b.csv", **{"t": time, "VOLT 1": rise(time)}),
        write("both.csv", **{"t": time, "V_t": rise(time), "VOLT 1": rise(time)}),
    ]
    names = ("--columns", "vt=V_t", "--columns", "vt=VOLT 1", "--no-plots")
    assert run(*sources[:2], *names)[0] == 0
    code, _, err = run(*sources, *names)
    assert code == 1
    assert "both.csv: has several of the columns given: 'V_t', 'VOLT 1'" in err


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """Return the folders of two fits of one record: with both parameters, and with one fixed."""
    folder = tmp_path_factory.mktemp("fits")
    samples = TRUTH + 1e-3 * np.random.default_rng(5).standard_normal(len(TIME))
    record = exfit.Record.from_arrays(TIME, {"vt": samples})
    free = FIRST_ORDER["parameters"]["free"]
    fixed = {"free": {"k": free["k"]}, "fixed": {"a": 2.0}}
    for name, parameters in (("both", FIRST_ORDER["parameters"]), ("one", fixed)):
        case = exfit.Case.from_dict({**FIRST_ORDER, "parameters": parameters}, record, name=name)
        run_folder.write_fit(exfit.fit(case), folder / name)
    write(folder / "record.csv", t=TIME, vt=samples)
    return folder


def test_the_f_of_a_fit_is_its_cost_and_parameters_are_side_by_side(run, fits):
    code, printed, _ = run(fits / "both", fits / "one", "--record", fits / "record.csv", "--json")
    assert code == 0
    stored = json.loads(printed)
    f = {entry["difference"]: entry["f"] for entry in stored["differences"]}
    for name, folder in (("A", "both"), ("B", "one")):
        cost = exfit.load_result(fits / folder).cost
        assert f[f"{name} - record"] == pytest.approx(cost, rel=1e-5)  # of nine digits
        assert stored["results"][name]["f"] == cost
    code, out, _ = run(fits / "both", fits / "one/result.json", fits / "record.csv", "--no-plots")
    assert code == 0
    rows = {line.split()[0]: line.split() for line in out.splitlines() if line.strip()}
    assert rows["strategy"][1:] == ["lm-then-dgn", "lm-then-dgn"]
    assert rows["a"][-1] == "2="
    assert "= fixed" in out
    assert max(map(len, out.splitlines())) <= 80 + len(str(fits))


def test_a_result_that_cannot_be_read_costs_its_parameters_only(fits):
    time = clock(0.01)
    write("fit/response.csv", t=time, vt_simulated=rise(time))
    Path("fit/result.json").write_text("{}")
    agreement = compare([Path("fit"), fits / "both"])
    assert [*agreement.results] == ["B"]
    assert any(
        "A: its parameters are not shown: fit/result.json" in note for note in agreement.notes
    )


def test_a_sample_beyond_all_measure_is_refused_with_its_place(run):
    time = clock(0.01)
    write("a.csv", t=time, vt=rise(time))
    write("b.csv", t=time, vt=np.where(time == time[5], 1e308, rise(time)))
    assert run("a.csv", "b.csv") == (1, "", "Error: b.csv:7: vt: 1e+308 exceeds 1e+100\n")
