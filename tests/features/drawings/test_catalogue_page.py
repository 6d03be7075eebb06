"""The page of models: each has its diagram and its figure, and settles where it should."""

import numpy as np
import pytest
from oracle import WITHOUT_PLANT

from exfit.features.drawings import catalogue_page
from exfit.features.drawings.catalogue_page import sample_response
from exfit.models import GOVERNORS, LIMITERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.output import figures as plots


@pytest.mark.parametrize(
    "names", [("FIRST_ORDER", "AC1A"), pytest.param(tuple(MODELS), marks=pytest.mark.long)]
)
def test_every_model_has_its_figure_and_the_page_shows_it(names, tmp_path):
    exciters = {name: MODELS[name] for name in names}
    shelves = (MACHINES, STABILISERS, GOVERNORS, LIMITERS)
    others = {name: model for shelf in shelves for name, model in shelf.items()}
    catalogue = {**exciters, **others}
    folder, files = tmp_path, catalogue_page.write_overview(tmp_path, catalogue.values())
    page = (folder / "index.html").read_text(encoding="utf-8")
    for name in exciters:
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert f'src="{name}.png"' in page
    for name, model in catalogue.items():
        assert (folder / f"{name}.svg").read_text(encoding="utf-8").startswith("<svg")
        assert f'<title id="diagram-{name}-title">' in page
        assert model.title.partition("(")[0].replace("'", "&#x27;") in page
    assert sorted(path.name for path in files) == sorted(path.name for path in folder.iterdir())


def test_typical_data_give_a_step_that_settles(exciter):
    """Whatever the regulator, vt ends near the new reference.

    The standard's AC6A swings through by half of the step; DC3A has a motor that is still running,
    and a dead band.
    """
    signals = sample_response(MODELS[exciter]).signals
    vt = signals["vt"]
    rise = vt[-1] - vt[0]
    assert vt[0] == pytest.approx(1.0, abs=1e-9)
    assert 0.9 * 0.05 < rise < 1.2 * 0.05
    assert vt.max() - vt[-1] < 0.55 * rise
    assert np.ptp(vt[-400:]) < 0.15 * rise
    assert np.isfinite(signals["efd"]).all()


@pytest.mark.parametrize("name", WITHOUT_PLANT)
def test_a_model_without_a_plant_has_its_page_too(name):
    response = sample_response(MODELS[name])
    figure = plots.overview(name, response)
    assert plots.png(figure).startswith(b"\x89PNG")
