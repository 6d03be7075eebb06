"""Fits without bounds: what they find, and that they say what is not physical."""

import io
import json
import re
from dataclasses import replace
from itertools import cycle, product
from math import inf

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from hypothesis import given, settings
from hypothesis import strategies as st
from places import CONFIGS
from records import TEST, UNIT, case_of, one, write
from records import TIME as SAMPLES
from rich.console import Console
from tiers import few_of

from exfit.case.case import Case
from exfit.errors import CaseError, ExfitError
from exfit.features.planner.export import export
from exfit.features.report.page import html
from exfit.fitting.build import build_experiments
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.search import fitted
from exfit.models import MODELS
from exfit.models.families import without_doubles
from exfit.output import fits, terminal
from exfit.records.record import Record
from exfit.results.io import load_result, result_text
from exfit.results.tables import parameter_file
from exfit.results.verdict import NO_MATCH
from exfit.workflows import check, fit, profile, simulate
from exfit.workflows.given_values import changed_values, read_parameters, with_given_values

NOISE = 1e-5  # pu: far below what KD = -0.3 does to vt
NEGATIVE = {**UNIT, "KD": -0.3}
ROUNDING = 1e-9  # relative, of a value through its scale and back

finite = st.floats(-1e3, 1e3).filter(lambda x: abs(x) > 1e-6)


@settings(max_examples=50)
@given(start=finite, below=st.none() | st.floats(0.1, 1e3), above=st.none() | st.floats(0.1, 1e3))
def test_every_parameter_has_a_size_by_which_to_search(start, below, above):
    low = -inf if below is None else start - below
    high = inf if above is None else start + above
    parameter = FreeParameter("x", start, low, high, logarithmic=False)
    assert 0.0 < parameter.width < inf
    for value in (start, start + 0.05, start - 0.05):
        assert abs(parameter.value(parameter.scaled(value)) - value) <= ROUNDING * (1 + abs(value))
    assert parameter.bound(start) is None
    assert [parameter.value(parameter.scaled(bound)) for bound in (low, high)] == [low, high]
    # a reasonable step is the same change on each linear scale
    for divisor in (1.0, abs(start)):
        other = replace(parameter, divisor=divisor)
        assert other.value(other.scaled(start)) == pytest.approx(start, rel=ROUNDING)
        steps = [each.unit * each.slope(0.0) for each in (parameter, other)]
        assert steps[0] == pytest.approx(steps[1], rel=ROUNDING)
    if below is not None and above is not None:
        assert parameter.width == high - low


@pytest.mark.parametrize("start", [0.0, 2.7e16])
def test_bounds_that_rounding_makes_one_hold_the_parameter(start):
    """A voltage of 2.7e16 with a tenth more and less is that voltage."""
    parameter = FreeParameter("x", start, start, start, logarithmic=False)
    assert parameter.value(parameter.scaled(start)) == start
    assert parameter.unit > 0.0


def test_a_voltage_beyond_the_resolution_of_numbers_ends_in_a_verdict():
    """That the causes of it are tried between bounds that are one ends nothing."""
    content = FIRST_ORDER | {"test": FIRST_ORDER["test"] | {"vt0": 2.7e16}}
    record = Record.from_arrays(TIME, {"vt": TRUTH})
    assert fit(Case.from_dict(content, record)).verdict.verdict == NO_MATCH


def unit_with(free, values, folder):
    """Write the response of a unit, with noise; return the case that fits ``free`` to it."""
    write(folder / "record.csv", t=SAMPLES, vt=SAMPLES)
    truth = case_of(one(TEST), folder)
    rng = np.random.default_rng(4)
    (setup,) = build_experiments(truth)
    vt = setup.with_enough_substeps({**truth.values(), **values}).response(
        {**truth.values(), **values}
    )
    noisy = vt.signals["vt"] + NOISE * rng.standard_normal(len(SAMPLES))
    write(folder / "record.csv", t=SAMPLES, vt=noisy)
    content = one(TEST, free=["TA", "TE", "KD"])
    content["parameters"]["free"] |= free
    return content


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return the folder of a unit whose KD is negative, its case, and the fit without bounds."""
    folder = tmp_path_factory.mktemp("unit")
    free = {
        "TA": {"start": 0.02},
        "TE": {"start": 1.0, "scale": "linear"},
        "KD": {"start": 0.36, "scale": "linear"},
    }
    content = unit_with(free, NEGATIVE, folder)
    return folder, content, fit(case_of(content, folder))


def test_a_fit_without_bounds_finds_a_value_outside_the_data_sheet(found):
    _, _, result = found
    for name, parameter in result.parameters.items():
        assert parameter.std_error is not None
        assert abs(parameter.value - NEGATIVE[name]) < 4.0 * parameter.std_error, name
    assert result.parameters["KD"].value < -0.25
    assert not result.parameters["KD"].physical
    assert result.parameters["TE"].physical


def test_it_says_what_is_not_physical(found):
    _, _, result = found
    (outside,) = [note for note in result.notes if "is not physical" in note]
    assert outside.startswith("KD = -0.3")
    assert "0 ... 100 pu" in outside
    assert any("TA, TE and KD may leave the range" in note for note in result.notes)


@pytest.mark.long
def test_bounds_within_the_data_sheet_need_no_word(found):
    folder, content, _ = found
    bounded = {**content, "parameters": {**content["parameters"]}}
    bounded["parameters"]["free"] = one(TEST, free=["TA", "TE", "KD"])["parameters"]["free"]
    case = case_of(bounded, folder)
    assert not [note for note in check(case).notes if "physical" in note]
    result = fit(case)
    assert result.parameters["KD"].at_bound == "min"
    assert not [note for note in result.notes if "physical" in note]


def test_a_missing_bound_is_null_in_the_file_and_infinite_in_python(found, tmp_path):
    _, _, result = found
    text = result_text(result)
    parameter = json.loads(text)["parameters"]["KD"]
    assert (parameter["min"], parameter["max"], parameter["physical"]) == (None, None, False)
    (tmp_path / "result.json").write_text(text)
    read = load_result(tmp_path).parameters
    assert (read["KD"].min, read["KD"].max) == (-inf, inf)
    assert (read["TE"].min, read["TE"].max) == (0.01, inf)
    assert read == dict(result.parameters)


def test_terminal_report_and_file_mark_the_value_and_no_other(found):
    folder, _, result = found
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=80), fits.whole(result))
    lines = stream.getvalue().splitlines()
    assert all(len(line) <= 80 for line in lines)
    for name in ("KD", "TE"):
        (place,) = [k for k, line in enumerate(lines) if line.startswith(f"{name} ")]
        more = [line.strip() for line in lines[place + 1 : place + 2] if line.startswith(" ")]
        remarks = " ".join([lines[place], *more])  # folded where the terminal is narrow
        assert ("not physical" in remarks) == (name == "KD")
        rows = [row for row in parameter_file(result).splitlines() if f" {name}:" in row]
        stored, source = rows
        assert source == f"  {name}: fitted"
        assert stored.endswith("# not physical") == (name == "KD")
    ranked = [effect.parameter for effect in result.knowledge.effects]
    shown = " ".join(line.strip() for line in lines).partition("in units of the noise: ")[2]
    assert re.findall(r"(K[AD]|T[AE]) [\d.]+", shown.partition("note:")[0])[:3] == ranked
    page = html(result, folder)
    rows = {name: page.partition(f'<th scope="row">{name} <small>')[2] for name in ("KD", "TE")}
    cells = {name: row.partition("</tr>")[0] for name, row in rows.items()}
    assert "not physical" in cells["KD"]
    assert ">none<" in cells["KD"]
    assert "not physical" not in cells["TE"]
    assert "0.01 … –" in cells["TE"]
    ranking = page.partition("Change for 1 % of each parameter")[2].partition("</table>")[0]
    assert re.findall(r'<th scope="row">(\w+)</th>', ranking) == ranked


def test_its_parameters_are_taken_up_by_a_simulation_which_says_so(found, tmp_path):
    folder, content, result = found
    case = case_of(content, folder)
    path = tmp_path / "parameters.yaml"
    path.write_text(parameter_file(result))
    simulated = simulate(case, read_parameters(case, path))
    assert simulated.comparison is not None
    assert abs(simulated.comparison.rmse - result.rmse) <= 1e-6 * result.rmse
    assert any(note.startswith("KD = -0.3") for note in simulated.notes)


def test_what_the_equations_exclude_is_refused_as_a_value_too(found):
    folder, content, _ = found
    case = case_of(content, folder)
    assert changed_values(case, {"KD": -1.0}, "--set") == {"KD": -1.0}
    for name, value in (("TE", -1.0), ("KA", 0.0), ("KD", inf), ("KD", np.nan)):
        with pytest.raises(CaseError, match=f"--set: {name}: "):
            changed_values(case, {name: value}, "--set")


def test_a_start_of_zero_given_beside_the_case_is_refused_where_it_gives_no_size(found):
    folder, content, _ = found
    case = with_given_values(case_of(content, folder), {"KD": 0.0}, "--set")
    with pytest.raises(CaseError, match="KD: a start of 0 sets no scale"):
        fit(case)


def test_no_file_for_psse_has_what_is_not_physical(found):
    _, _, result = found
    with pytest.raises(ExfitError, match=r"KD: -0\.3.* lies outside 0 \.\.\. ") as refused:
        export(result, 1, "1")
    assert "TE" not in str(refused.value)


def test_a_profile_goes_where_the_bounds_would_have_stopped_it(found):
    folder, content, result = found
    (of_gain,) = profile(case_of(content, folder), "KD").profiles
    interval = result.parameters["KD"].interval
    assert of_gain.low is not None
    assert of_gain.high is not None
    # the response is close to linear over so small an interval: profile and linear theory agree
    width = interval[1] - interval[0]
    assert np.allclose([of_gain.low, of_gain.high], interval, atol=0.1 * width)


@pytest.mark.parametrize("strategy", few_of(["dgn", "lm", "lm-then-dgn", "robust", "auto"], 2))
def test_bounds_that_are_never_met_do_not_matter(strategy):
    ends = []
    for bounds in ({}, {"min": 1e-3, "max": 1e3}):
        content = yaml.safe_load(yaml.safe_dump(FIRST_ORDER))
        for name in ("k", "a"):
            scale = {"scale": "linear"} if not bounds else {}
            content["parameters"]["free"][name] = {"start": 1.0, **bounds, **scale}
        case = Case.from_dict(content, Record.from_arrays(TIME, {"vt": TRUTH}))
        ends.append([parameter.value for parameter in fit(case, strategy).parameters.values()])
    assert np.allclose(*ends, rtol=1e-5)  # the record is noiseless: both end at k = 4, a = 2


@pytest.mark.parametrize("strategy", few_of(["dgn", "lm-then-dgn"], 1))
def test_the_default_methods_go_the_same_way_on_each_linear_scale(strategy):
    """Their radius and caps are in units of the parameters; rounding alone tells them apart."""
    ways = []
    for scale in ("linear", "start", "raw"):
        content = yaml.safe_load(yaml.safe_dump(FIRST_ORDER))
        for name, start in (("k", 9.0), ("a", 0.7)):
            content["parameters"]["free"][name] = {"start": start, "bounds": "none", "scale": scale}
        case = Case.from_dict(content, Record.from_arrays(TIME, {"vt": TRUTH}))
        history = fit(case, strategy).history
        ways.append([[line.values["k"], line.values["a"]] for line in history[:5]])
    assert len(ways[0]) == 5
    assert np.allclose(ways[0], ways[1], rtol=1e-6)
    assert np.allclose(ways[0], ways[2], rtol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("strategy", ["dgn", "lm"])
def test_without_any_bounds_a_gain_that_is_divided_by_changes_its_sign(strategy):
    content = yaml.safe_load(yaml.safe_dump(FIRST_ORDER))
    case_of_sign = {}
    for bounds in ("none", "equations"):
        for name in ("k", "a"):
            free = {"start": 1.0, "bounds": bounds, "scale": "start"}
            content["parameters"]["free"][name] = free
        content["estimate"] = {"dgn": {"step": "full", "cut": "half"}, "lm": {"update": "armijo"}}
        case = Case.from_dict(content, Record.from_arrays(TIME, {"vt": -TRUTH}))
        case_of_sign[bounds] = fit(case, strategy).parameters
    free, bounded = case_of_sign["none"], case_of_sign["equations"]
    assert [free[name].value for name in ("k", "a")] == pytest.approx([-4.0, 2.0], rel=1e-5)
    assert (free["k"].min, free["k"].max, free["k"].physical) == (-inf, inf, False)
    assert bounded["k"].value >= bounded["k"].min > 0.0


def test_what_a_model_refuses_costs_infinity(found):
    folder, content, _ = found
    free = {name: {"start": start, "bounds": "none", "scale": "raw"}
            for name, start in (("KA", 300.0), ("TA", 0.02), ("TE", 1.0))}  # fmt: skip
    content = {**content, "parameters": {**content["parameters"], "free": free}}
    content["parameters"]["fixed"] = {
        name: value for name, value in content["parameters"]["fixed"].items() if name not in free
    }
    _, problem = fitted(case_of(content, folder))
    residuals = problem.residuals
    assert np.isneginf(residuals.bounds[0]).all()
    for refused in ([0.0, 0.02, 1.0], [300.0, -0.02, 1.0], [300.0, 0.02, -1.0], [300.0, 0.02, 0.0]):
        assert np.isinf(residuals(np.array(refused))).all(), refused
    for point in ([-5.0, 0.02, 1.0], [300.0, 0.0, 1.0]):
        assert residuals.residuals([np.array(point)])[0].shape == (residuals.count,)
    # the points of a difference do not cross 0
    tiny = np.array([300.0, 2e-4, 1.0])
    steep = replace(residuals, difference_step=1e-3)
    assert np.isfinite(steep.central(tiny)).all()


@pytest.mark.parametrize(
    ("section", "text"),
    [
        ({"min": 1.0}, "min: not allowed with bounds: none"),
        ({"max": 1.0}, "max: not allowed with bounds: none"),
        ({"scale": "log"}, "bounds: none leaves no min above 0"),
        ({"start": 0.0}, "start: 0 sets no scale for the search: use another"),
        ({"start": 0.0, "scale": "raw"}, "start: 0 sets no scale"),
    ],
)
def test_what_bounds_none_contradicts_is_refused(found, section, text):
    folder, content, _ = found
    free = {"KD": {"start": 0.36, "bounds": "none", "scale": "start", **section}}
    content = {**content, "parameters": {**content["parameters"], "free": free}}
    with pytest.raises(CaseError, match=text):
        case_of(content, folder)


# both limit the same signal, at the same value: the response has a corner there
CORNERS = {"BBSEX1": ("VRMAX", "EFDMAX")}


def test_exact_derivatives_equal_differences_without_bounds(model):
    """Whatever the range of a data sheet: a step of a difference follows the value."""
    content = yaml.safe_load((CONFIGS / "models" / f"{model.lower()}.yaml").read_text())
    content["test"]["duration"] = 3.0
    values = Case.from_dict(content).values()
    fixed = content["parameters"].setdefault("fixed", {})
    free = content["parameters"]["free"] = {}
    for row in MODELS[model].sheet:
        switch = row.unit == "1"
        if values[row.symbol] != 0.0 and not switch and row.symbol not in CORNERS.get(model, ()):
            fixed.pop(row.symbol, None)
            free[row.symbol] = {"start": values[row.symbol], "scale": "linear"}
    assert check(Case.from_dict(content)).agrees


@pytest.mark.parametrize("strategy", ["dgn", "lm"])
def test_a_fit_by_differences_takes_the_way_of_one_by_exact_derivatives(strategy):
    ways = []
    for jacobian in ("exact", "central"):
        content = yaml.safe_load(yaml.safe_dump(FIRST_ORDER))
        content["parameters"]["free"] = {
            "k": {"start": 1.0, "scale": "linear"},
            "a": {"start": 2.5, "scale": "linear"},
        }
        content["estimate"]["jacobian"] = jacobian
        case = Case.from_dict(content, Record.from_arrays(TIME, {"vt": TRUTH}))
        result = fit(case, strategy)
        ways.append([iteration.cost for iteration in result.history])
    assert len(ways[0]) == len(ways[1])
    # the record is noiseless: what is left at the end is rounding
    np.testing.assert_allclose(*ways, rtol=1e-3, atol=1e-9)


# each model meets a start on one side, by one method, its neighbours the others; a form of 2016 has
# the gains and times of that of 2005
DISTINCT = without_doubles("AC1A", MODELS)
IN_TURN = [*zip(DISTINCT, cycle(product((0.5, 1.6), ("dgn", "lm"))), strict=False)]


@pytest.mark.long
@pytest.mark.parametrize(("model", "start"), IN_TURN)
def test_a_fit_without_bounds_runs_to_an_end_with_every_model(model, start):
    """Whatever it meets on its way is a rejected trial; what it ends with, the equations allow."""
    factor, strategy = start
    content = yaml.safe_load((CONFIGS / "models" / f"{model.lower()}.yaml").read_text())
    content["test"]["duration"] = 4.0
    truth = Case.from_dict(content)
    response = simulate(truth).response
    rng = np.random.default_rng(1)
    noisy = response.signals["vt"] + 1e-4 * rng.standard_normal(len(response.time))
    record = Record.from_arrays(response.time, {"vt": noisy})
    del content["test"]["duration"]
    fixed = content["parameters"].setdefault("fixed", {})
    free = content["parameters"]["free"] = {}
    for row in MODELS[model].sheet:
        if row.free:
            fixed.pop(row.symbol, None)
            start = factor * truth.values()[row.symbol]
            free[row.symbol] = {"start": start, "scale": "linear"}
    content["estimate"] = {"iterations": 12}
    case = Case.from_dict(content, record)
    rows, result = case.rows(), fit(case, strategy)
    assert result.cost < 0.1 * result.start_cost
    assert json.loads(result_text(result))["parameters"].keys() == free.keys()
    for name, parameter in result.parameters.items():
        assert rows[name].range_fault(parameter.value) is None
        marked = any(note.startswith(f"{name} = ") for note in result.notes)
        assert marked == (not parameter.physical), name
