"""What ``import exfit`` offers: light to import, typed, and the same functions as the commands."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest
from matplotlib.figure import Figure
from places import ROOT

import exfit
from exfit import cli
from exfit.fitting.recordings import record_of
from exfit.output import run_folder

API_PAGE = ROOT / "docs" / "python_api.md"
CASE = ROOT / "configs" / "first_order.yaml"
DYR = ROOT / "sample_data" / "unit.dyr"
HEAVY = {"numpy", "scipy", "pydantic", "yaml", "matplotlib", "rich", "click", "llvmlite"}

NOISE = 1e-4  # pu
TRUE_K = 200.0
SEXS = {
    "model": "SEXS",
    "given": "exact",
    "plant": {"type": "open-circuit", "machine": "GENROU"},
    "test": {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.02}]},
    "parameters": {"free": {"K": {"start": 100.0, "min": 10.0, "max": 1000.0}}},
    "estimate": {"search": "local"},
}


@pytest.fixture(scope="module")
def result():
    return exfit.fit(CASE, search="local")


def test_importing_exfit_loads_nothing_heavy():
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    code = "import exfit, sys; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert "exfit" in done.stdout.split()
    assert not HEAVY & set(done.stdout.split())


@pytest.mark.parametrize("name", exfit.__all__)
def test_every_public_name_can_be_used_and_is_listed(name):
    assert getattr(exfit, name) is not None
    assert name in dir(exfit)


@pytest.mark.parametrize("name", sorted({*exfit.__all__} - {"__version__"}))
def test_every_public_name_is_documented(name):
    assert getattr(exfit, name).__doc__
    assert f"`{name}`" in API_PAGE.read_text(encoding="utf-8")


def test_no_module_hides_a_public_name():
    """Importing a module ``exfit.show`` would put it in place of a function of that name."""
    assert not {module.name for module in iter_modules(exfit.__path__)} & {*exfit.__all__}


def test_another_name_is_no_attribute():
    with pytest.raises(AttributeError, match="module 'exfit' has no attribute 'fitt'"):
        exfit.fitt  # noqa: B018


@pytest.mark.parametrize("given", [str, Path, exfit.load_case])
def test_a_case_may_be_given_as_such_or_by_its_path(given, result):
    assert exfit.fit(given(CASE), search="local").values == result.values


def test_input_that_cannot_be_used_raises_an_exfit_error(tmp_path):
    with pytest.raises(exfit.CaseError, match="cannot be read"):
        exfit.load_case(tmp_path / "nowhere.yaml")
    assert issubclass(exfit.CaseError, exfit.ExfitError)


def test_the_callback_of_a_fit_is_called_with_every_iteration():
    iterations = []
    result = exfit.fit(CASE, search="local", progress=iterations.append)
    assert [*map(vars, iterations)] == [*map(vars, result.history)]
    assert [iteration.number for iteration in iterations] == list(range(len(iterations)))


def test_an_interruption_in_the_callback_keeps_the_best_point():
    def interrupt(iteration):
        if iteration.number == 3:
            raise KeyboardInterrupt

    result = exfit.fit(CASE, search="local", progress=interrupt)
    assert result.interrupted
    assert not result.success
    assert result.cost == min(iteration.cost for iteration in result.history) < result.start_cost


def test_a_result_stands_for_its_values(result):
    """Those of a fit lead to its response: the same simulation, so the same cost."""
    fitted, *_ = exfit.validate(CASE, result)
    assert fitted.cost == result.comparison.cost
    simulated = exfit.simulate(CASE, result)
    assert simulated.comparison.cost == result.comparison.cost
    assert exfit.simulate(CASE, result.values).comparison.cost == result.comparison.cost
    assert exfit.simulate(CASE).comparison.cost > result.comparison.cost


def test_a_profile_encloses_the_fitted_value(result):
    stages = []
    (profile,) = exfit.profile(CASE, ["k"], progress=stages.append).profiles
    assert profile.low < result.parameters["k"].value < profile.high
    assert stages


def test_more_noise_leaves_larger_errors():
    """Standard errors of the linear theory are proportional to the noise."""
    errors = [
        exfit.identify(CASE, {"vt": noise}).own.confidence.parameters["k"].std_error
        for noise in (1e-4, 1e-3)
    ]
    assert errors[1] == pytest.approx(10.0 * errors[0], rel=1e-9)


def test_a_check_takes_a_path():
    assert exfit.check(str(CASE)).agrees


@pytest.fixture(scope="module")
def arrays():
    """Return the record of a simulation with a known parameter, with noise."""
    plan = {**SEXS, "test": {**SEXS["test"], "duration": 10.0}}
    truth = exfit.simulate(exfit.Case.from_dict(plan), {"K": TRUE_K}).response
    noise = np.random.default_rng(1).normal(scale=NOISE, size=truth.time.size)
    signals = {name: truth.signals[name] for name in ("vt", "efd")}
    return exfit.Record.from_arrays(truth.time, {**signals, "vt": signals["vt"] + noise})


def test_a_case_of_a_dict_is_fitted_to_a_record_of_arrays(arrays):
    case = exfit.Case.from_dict({**SEXS, "record": {"channels": {"vt": {"noise": NOISE}}}}, arrays)
    result = exfit.fit(case, search="local")
    fitted = result.parameters["K"].value
    error = result.knowledge.confidence.parameters["K"].std_error
    assert result.success
    # four standard errors: of this seed it is well below one
    assert abs(fitted - TRUE_K) < 4.0 * error < 0.01 * TRUE_K
    assert result.inputs == {"record": arrays.sha256}
    assert list(result.comparison.overlays) == ["vt"]


@pytest.mark.parametrize("use", [exfit.simulate, exfit.validate])
@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"KK": 2.0}, "values: KK: not a parameter"),
        ({"k": -1.0e9}, "values: k: -1e.09 is below 1e-06"),
        ({"k": float("nan")}, "values: k: nan lies outside"),
    ],
)
def test_values_that_the_case_does_not_take_are_refused(use, values, message):
    with pytest.raises(exfit.CaseError, match=message):
        use(CASE, values)


def test_an_unknown_strategy_is_refused():
    with pytest.raises(exfit.CaseError, match="strategy: 'dgm' is unknown; did you mean dgn"):
        exfit.fit(CASE, strategy="dgm")


def test_one_parameter_is_profiled_by_its_name():
    assert [profile.name for profile in exfit.profile(CASE, "a").profiles] == ["a"]


def test_a_case_and_a_record_are_shown_in_one_line(arrays):
    case = exfit.load_case(CASE)
    assert repr(case) == f"<Case first_order: FIRST_ORDER, {case.plant.type}; free: k, a>"
    samples, last = len(arrays.time), arrays.time[-1]
    assert repr(arrays) == f"<Record arrays: vt, efd; {samples} samples, 0 ... {last:g} s>"


def test_a_case_without_a_record_section_takes_all_signals_of_the_arrays(arrays):
    case = exfit.Case.from_dict(SEXS, arrays)
    assert {*case.record.channels} == {"vt", "efd"}


def test_a_record_that_is_given_is_fitted_like_its_file(result):
    case = exfit.load_case(CASE)
    read = record_of(case, case.recordings[0])
    copy = exfit.Record.from_arrays(read.time, read.signals)
    assert exfit.fit(case.with_record(copy), search="local").values == result.values


def test_several_records_are_given_by_name(arrays):
    test = SEXS["test"]
    content = {
        **{key: SEXS[key] for key in ("model", "plant", "parameters", "estimate")},
        "records": [{"name": "up", "test": test}, {"name": "again", "test": test}],
        "validate": [{"name": "later", "test": test}],
    }
    case = exfit.Case.from_dict(content, dict.fromkeys(("up", "again", "later"), arrays))
    together, alone = exfit.fit(case), exfit.fit(exfit.Case.from_dict(SEXS, arrays))
    assert [match.name for match in together.comparisons] == ["up", "again"]
    assert [match.name for match in together.validation] == ["later"]
    # the same record twice has the same minimum; both searches end within their tolerances
    assert together.values["K"] == pytest.approx(alone.values["K"], rel=1e-6)


def test_a_record_under_a_name_that_the_case_lacks_is_refused(arrays):
    with pytest.raises(exfit.CaseError, match=r"case: records: up is given, but .* known: fit"):
        exfit.Case.from_dict(SEXS, {"up": arrays})
    with pytest.raises(exfit.CaseError, match="up: not a record of the case; known: fit"):
        exfit.Case.from_dict(SEXS, arrays).with_record(arrays, "up")


def test_a_record_without_a_signal_that_is_compared_is_refused(arrays):
    content = {**SEXS, "record": {"channels": {"vt": {}, "ifd": {}}}}
    with pytest.raises(exfit.CaseError, match="case: record fit: ifd: missing in arrays"):
        exfit.Case.from_dict(content, arrays)


def test_a_record_that_does_not_hold_the_step_is_refused(arrays):
    late = exfit.Record.from_arrays(arrays.time + 5.0, arrays.signals)
    with pytest.raises(exfit.RecordError, match=r"arrays: holds 5 ... 15 s, but case has a step"):
        exfit.fit(exfit.Case.from_dict(SEXS, late))


def test_a_file_is_read_as_the_section_of_its_case_says():
    """The record of a case, its columns given by hand: in kV and A, with gaps of the recorder."""
    case = exfit.load_case(ROOT / "configs" / "field_record.yaml")
    section = case.record
    channels = {
        signal: channel.model_dump(include={"column", "unit", "base"})
        for signal, channel in section.channels.items()
    }
    own = record_of(case, case.recordings[0])
    read = exfit.read_record(case.folder / section.file, section.time, channels, section.window)
    assert read.sha256 == own.sha256
    assert np.array_equal(read.time, own.time)
    for signal, samples in own.signals.items():
        assert np.array_equal(read.signals[signal], samples)


@pytest.mark.parametrize(
    ("channels", "fault"),
    [
        ({"vt": {"colum": "v"}}, r"channels\.vt\.colum: unknown key; did you mean column\?"),
        ({"vt": {"column": "v", "unit": "kV"}}, r"channels\.vt\.base: is missing: what is 1 pu"),
        ({"vx": "v"}, r"channels.*vx"),
        ({}, r"channels: "),
    ],
)
def test_columns_that_are_not_given_rightly_are_refused_with_their_place(channels, fault):
    with pytest.raises(exfit.CaseError, match=r"bump\.csv: " + fault):
        exfit.read_record("bump.csv", "t", channels)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(exfit.RecordError, match="cannot be read"):
        exfit.read_record(tmp_path / "bump.csv", "t", {"vt": "v"})


def test_a_parameter_has_its_value_standard_error_and_interval(result):
    for name in ("k", "a"):
        parameter = result.parameters[name]
        low, high = parameter.interval
        assert low < parameter.value < high
        assert 0.0 < parameter.stderr < high - low
    # what the record was made with, rounded to five decimals, 300 of them
    assert result.parameters["k"].value == pytest.approx(4.0, rel=1e-5)


def test_a_result_is_plain_data_with_a_row_for_each_parameter(result):
    content = result.to_dict()
    assert json.loads(json.dumps(content)) == content
    rows = content["parameters"]
    assert rows.keys() == result.parameters.keys()
    assert len({tuple(row) for row in rows.values()}) == 1  # the same columns
    assert {"value", "std_error", "interval", "unit"} <= {*rows["k"]}


def test_a_result_is_shown_in_one_line(result):
    assert repr(result).startswith("<FitResult FIRST_ORDER to first_order.csv: rmse ")
    assert "k=4" in repr(result)
    assert "\n" not in repr(result)


class Page(HTMLParser):
    """The cells of the tables of a page, and whether its tags are balanced."""

    def __init__(self, html):
        super().__init__()
        self.open_tags, self.rows, self.texts = [], [], []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.open_tags.append(tag)
        if tag == "tr":
            self.rows.append([])

    def handle_endtag(self, tag):
        assert self.open_tags.pop() == tag

    def handle_data(self, data):
        if self.open_tags and self.open_tags[-1] in ("td", "th"):
            self.rows[-1].append(data)
        self.texts.append(data)


def test_a_notebook_shows_a_row_for_each_parameter_and_escapes_what_is_named(result):
    page = Page(replace(result, model="<script>", notes=("a < b",))._repr_html_())
    assert page.open_tags == []
    assert [row[0] for row in page.rows] == ["parameter", *result.parameters]
    assert all(len(row) == len(page.rows[0]) for row in page.rows)
    assert {"<script>", "a < b"} <= {*page.texts}


def test_a_result_is_drawn_beside_each_of_its_records(result):
    figure = result.plot()
    assert isinstance(figure, Figure)
    # the figure draws a thinned line, which passes through the fitted samples
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert {"measured", "start values", "fitted"} <= lines.keys()
    overlay = result.comparison.overlays["vt"]
    assert np.isin(lines["fitted"].get_ydata(), overlay.simulated).all()
    assert isinstance(result.plot(result.validation[0].name), Figure)


def test_a_record_that_cannot_be_drawn_is_refused(result):
    with pytest.raises(exfit.ExfitError, match="up: not a record of this fit; known: fit"):
        result.plot("up")


def test_a_result_is_read_back_from_its_folder(result, tmp_path):
    run_folder.write_fit(result, tmp_path)
    for place in (tmp_path, str(tmp_path), tmp_path / "result.json"):
        read = exfit.load_result(place)
        assert read.to_dict() == result.to_dict()
        assert read._repr_html_() == result._repr_html_()
        assert isinstance(read.plot(), Figure)


def test_a_result_is_printed_as_the_command_prints_it(result, tmp_path, capsys):
    run_folder.write_fit(result, tmp_path)
    exfit.show(tmp_path)
    printed = capsys.readouterr().out
    assert "written to" in printed
    exfit.show(result)
    verdict = printed.splitlines()[-1]
    assert (
        capsys.readouterr().out.splitlines()[-1] == verdict == f"verdict: {result.verdict.sentence}"
    )
    with pytest.raises(SystemExit):
        cli.main(["show", str(tmp_path)], prog_name="exfit")
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(
    ("use", "fault"),
    [
        (lambda result: exfit.export(result, form="dvr"), "dvr: .* did you mean dyr"),
        (lambda _: exfit.compare([CASE]), "one curve alone"),
        (lambda _: exfit.import_units(DYR, "out", steps=["0.05"]), "only with a folder of records"),
    ],
)
def test_what_a_function_cannot_use_is_refused_before_it_writes(
    result, use, fault, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(exfit.ExfitError, match=fault):
        use(result)
    assert not [*tmp_path.iterdir()]
