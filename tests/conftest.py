"""Fixtures that all tests share."""

import os

import pytest
from oracle import WITHOUT_PLANT

from exfit.models import MODELS


@pytest.fixture(scope="session", autouse=True)
def compiled_code_is_kept_apart(tmp_path_factory):
    """Keep compiled code in a folder of this session, unless one is chosen."""
    if "EXFIT_CACHE" in os.environ:
        yield
        return
    os.environ["EXFIT_CACHE"] = str(tmp_path_factory.mktemp("cache"))
    yield
    del os.environ["EXFIT_CACHE"]


@pytest.fixture(scope="session", params=list(MODELS))
def model(request):
    """Name each model of the catalogue in turn."""
    return request.param


@pytest.fixture(scope="session", params=[name for name in MODELS if name not in WITHOUT_PLANT])
def exciter(request):
    """Name each model of the catalogue that stands on a machine in turn."""
    return request.param
