"""From a case to its experiments: all of the case that a simulation or a fit depends on."""

from copy import deepcopy

import numpy as np
import oracle
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from places import ROOT
from tiers import few_of

from exfit.case.load import load_case
from exfit.errors import SimulationError
from exfit.fitting.build import build_experiments
from exfit.fitting.recordings import record_of
from exfit.fitting.system import values_of
from exfit.plants import SATURATION, VT0
from exfit.results.compare_with_record import compare_with_record
from exfit.simulation.simulator import Simulator
from exfit.workflows import fit, simulate
from exfit.workflows.profiles import profile

CASE = {
    **FIRST_ORDER,
    "record": {"file": "record.csv", "time": "t", "channels": {"vt": "vt"}},
}
MACHINE_CASE = {
    **yaml.safe_load((ROOT / "configs" / "ac1a_typical.yaml").read_text()),
    "test": {"vt0": 1.0, "vref": [{"at": 0.5, "step": 0.05}]},
    "record": {"file": "record.csv", "time": "t", "channels": {"vt": "vt"}},
    "validate": [],
}


@pytest.fixture
def load(tmp_path):
    """Return a function that writes a case with its record and loads it."""

    def loaded(content, time=TIME, **signals):
        rows = np.column_stack([time, *signals.values()])
        header = ",".join(["t", *signals])
        np.savetxt(
            tmp_path / "record.csv", rows, fmt="%.10g", delimiter=",", header=header, comments=""
        )
        path = tmp_path / "case.yaml"
        path.write_text(yaml.safe_dump(content, sort_keys=False))
        return load_case(path)

    return loaded


def changed(content, section, **values):
    """Return a copy of a case with values in one of its sections."""
    content = deepcopy(content)
    content[section] = {**content.get(section, {}), **values}
    return content


def test_only_the_samples_within_the_window_are_measured_and_fitted(load):
    """Outside it the record is spoilt; both ends belong to it."""
    inside = (TIME > 0.24) & (TIME < 2.51)
    case = load(changed(CASE, "record", window=[0.25, 2.5]), vt=np.where(inside, TRUTH, 9.0))
    record = record_of(case, case.recordings[0])
    assert record.time == pytest.approx(TIME[inside], abs=1e-9)
    assert (record.time[0], record.time[-1]) == (0.25, 2.5)
    found = fit(case)
    assert found.comparison.time == pytest.approx(record.time)
    # the record is written with ten digits
    assert found.values == pytest.approx({"k": 4.0, "a": 2.0}, rel=1e-6)


def test_the_cost_is_half_the_sum_of_the_weighted_errors_squared(load):
    weights = {"vt": 3.0, "efd": 0.25}
    channels = {name: {"column": name, "weight": weight} for name, weight in weights.items()}
    rng = np.random.default_rng(1)
    signals = {"vt": rng.normal(1.0, 0.01, 61), "efd": rng.normal(1.1, 0.5, 61)}
    case = load(changed(MACHINE_CASE, "record", channels=channels), **signals)
    compared = compare_with_record(build_experiments(case)[0], values_of(case, {}))
    assert compared.overlays.keys() == weights.keys()
    expected = sum(
        0.5 * np.sum((weights[name] * one.error) ** 2) for name, one in compared.overlays.items()
    )
    assert compared.cost == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("form", list(SATURATION))
def test_the_saturation_that_a_case_names_is_the_one_simulated(load, form):
    case = load({**MACHINE_CASE, "saturation": form}, vt=1.0 + 0.025 * TRUTH)
    got = simulate(case, {}).response.signals["vt"]
    setup = build_experiments(case)[0]
    values = {**values_of(case, {}), VT0: 1.0}

    def response(name):
        system = oracle.system_of("AC1A", "GENROU", name)
        simulator = Simulator(system, setup.experiment.simulator.inputs, TIME, case.simulation.step)
        return simulator.with_enough_substeps(values).samples(values, ("vt",))[0][:, 0]

    assert got == pytest.approx(response(form), abs=1e-12)
    for other in SATURATION.keys() - {form}:
        assert np.abs(got - response(other)).max() > 1e-6  # of a step of 0.05


@pytest.mark.parametrize("tolerance", few_of([{"gradient": 1.0}, {"step": 1e3}], 1))
def test_a_tolerance_that_the_start_meets_ends_the_fit_there(load, tolerance):
    case = load(changed(CASE, "estimate", tolerance=tolerance), vt=TRUTH)
    loose, tight = fit(case), fit(load(CASE, vt=TRUTH))
    assert loose.success
    assert loose.nit == 0
    assert tight.nit > 0
    assert tight.comparison.cost < loose.comparison.cost


@pytest.mark.parametrize(
    ("jacobian", "runs"), [("exact", 1), ("central", 4), ("forward", 4), ("backward", 4)]
)
def test_a_jacobian_costs_the_simulations_of_its_kind(load, jacobian, runs):
    """One with tangents, or one at each end of a difference for each of the two parameters.

    The start may be looked at once before the search.
    """
    found = fit(load(changed(CASE, "estimate", jacobian=jacobian), vt=TRUTH))
    assert found.success
    assert 0 <= found.simulations - (found.nfev + runs * found.njev) <= 1


def test_a_fit_that_ends_where_the_response_has_no_slope_reports_what_it_found(load, tmp_path):
    """The gain goes with the root of c, which is steepest where the best c lies: on its bound 0."""
    text = (ROOT / "exfit" / "models" / "exciters" / "first_order.py").read_text()
    text = text.replace("p.k", "(p.k + sqrt(p.c))")
    text = text.replace(
        "sheet(\n", 'sheet(\n    ("c", 0.1, "", (0.0, 10.0), "a part of the gain"),\n'
    )
    text = text.replace("import Signal\n", "import Signal, sqrt\n")
    (tmp_path / "steep.py").write_text(text)
    bounds = {"a": {"start": 1.0, "min": 0.1, "max": 100.0}}
    bounds["c"] = {"start": 1.0, "min": 0.0, "max": 5.0, "scale": "linear"}
    parameters = {"fixed": {"k": 4.5}, "free": bounds}  # the record has k = 4
    case = load({**CASE, "model": "steep.py", "parameters": parameters}, vt=TRUTH)
    found = fit(case)
    assert (found.success, found.values["c"]) == (False, 0.0)
    assert found.knowledge is None
    assert found.to_dict()["parameters"]["a"]["why"] == "no finite derivatives"
    with pytest.raises(SimulationError, match=r"the derivatives are not finite at .*c = 0"):
        profile(case)
