"""What someone looks at while a slider moves: the figures and extremes of however long a record."""

import numpy as np
import pytest
import yaml
from places import ROOT

import exfit
from exfit.errors import CaseError
from exfit.workflows.exploring import MOST_SAMPLES, STRETCHES, explorer

COUNT, NOISE, SEED = 30_003, 2e-3, 7
PEAK = 23_457  # the sample of one alone, which gives no figure


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Make a case with so many samples of noise, and one peak, over a short record."""
    folder = tmp_path_factory.mktemp("long")
    text = (ROOT / "configs" / "ac1a_good.yaml").read_text(encoding="utf-8")
    content = yaml.safe_load(text)
    short = np.genfromtxt(ROOT / "sample_data" / "ac1a_up.csv", delimiter=",", names=True)
    time = np.linspace(short["t"][0], short["t"][-1], COUNT)
    noise = NOISE * np.random.default_rng(SEED).standard_normal(COUNT)
    vt = np.interp(time, short["t"], short["vt"]) + noise
    vt[PEAK] += 0.1
    lines = [f"{t:.7f},{v:.6f}" for t, v in zip(time, vt, strict=True)]
    (folder / "long.csv").write_text("\n".join(["t,vt", *lines]), encoding="utf-8")
    content["record"]["file"] = "long.csv"
    content.pop("validate", None)
    path = folder / "long.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return exfit.load_case(path)


def test_a_long_record_is_looked_at_through_some_of_its_samples(case):
    looked = explorer(case, None)
    values = {"KA": 500.0}
    (shown,) = looked.at(values)
    whole = exfit.simulate(case, values).comparison
    (note,) = shown.notes
    assert note.startswith(f"of {COUNT} samples every 4th gives the figures")
    drawn = shown.overlays["vt"].measured
    assert len(shown.time) <= 2 * STRETCHES + 2 < MOST_SAMPLES
    assert drawn.max() == whole.overlays["vt"].measured[PEAK]
    places = np.searchsorted(whole.time, shown.time)
    np.testing.assert_array_equal(drawn, whole.overlays["vt"].measured[places])
    simulated = whole.overlays["vt"].simulated[places]
    np.testing.assert_allclose(shown.overlays["vt"].simulated, simulated, rtol=0.0, atol=1e-6)
    # the mean of some 7,500 independent squares varies by sqrt(2 / 7500) = 1.6 %
    assert shown.cost == pytest.approx(whole.cost, rel=0.06)
    assert shown.channels["vt"].rmse == pytest.approx(whole.channels["vt"].rmse, rel=0.03)


def test_a_record_that_a_fit_has_no_memory_for_can_be_looked_at(case):
    content = yaml.safe_load(case.path.read_text(encoding="utf-8"))
    content["simulation"] = {**content.get("simulation", {}), "memory": 0.3}
    small = case.path.with_name("small.yaml")
    small.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(CaseError, match="memory"):
        exfit.fit(small)
    assert explorer(exfit.load_case(small), None).start
