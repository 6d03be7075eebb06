"""result.json: what is written is read back, a damaged file ends in a message with its place."""

import json
import random

import numpy as np
import pytest
from hypothesis import settings
from records import config, several
from records import recording as recorded

from exfit import workflows
from exfit.case.load import load_case
from exfit.errors import ExfitError
from exfit.results.io import VERSION, load_result, result_text
from exfit.results.thinning import MOST_ROWS, thinned

DAMAGES = 2 * settings.default.max_examples  # random ones of a file


@pytest.fixture(scope="module")
def texts(tmp_path_factory):
    """The results of several fits as files hold them."""
    import yaml

    folder = tmp_path_factory.mktemp("results")
    cases = {
        "one": config("first_order"),
        "several": several(
            recorded("up"),
            recorded("down", at={"start": 1.02, "min": 0.9, "max": 1.1}),
            free={"KA": {"start": 300.0, "min": 76.6, "max": 7660.0}},
            estimate={"causes": 0},  # of its misfit they would be 95 % of the time
        ),
        "starts": {
            **config("first_order"),
            "estimate": {"strategy": "auto", "search": "global", "starts": 3},
        },
    }
    found = {}
    for name, content in cases.items():
        path = folder / f"{name}.yaml"
        path.write_text(yaml.safe_dump(content))
        found[name] = workflows.fit(load_case(path))
    return found


@pytest.fixture
def saved(texts, tmp_path):
    """The file of a fit, and its content."""
    path = tmp_path / "result.json"
    path.write_text(result_text(texts["one"]), encoding="utf-8")
    return path, json.loads(path.read_text(encoding="utf-8"))


def written(saved, **changes):
    path, content = saved
    path.write_text(json.dumps({**content, **changes}), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["one", "several", "starts"])
def test_what_is_read_back_is_written_alike(texts, tmp_path, name):
    text = result_text(texts[name])
    (tmp_path / "result.json").write_text(text, encoding="utf-8")
    back = load_result(tmp_path)
    assert result_text(back) == text
    assert json.dumps(back.to_dict()) == json.dumps(texts[name].to_dict())
    assert repr(back) == repr(texts[name])


def test_a_fitted_parameter_has_value_error_and_interval(texts, tmp_path):
    (tmp_path / "result.json").write_text(result_text(texts["several"]), encoding="utf-8")
    for result in (texts["several"], load_result(tmp_path / "result.json")):
        gain, instant = result.parameters["KA"], result.parameters["down.vref.at"]
        own = result.knowledge.confidence.parameters["KA"]
        assert (gain.stderr, gain.interval) == (own.std_error, own.interval)
        assert gain.interval[0] < gain.value < gain.interval[1]
        assert (gain.unit, gain.of_record) == ("pu", False)
        assert (instant.unit, instant.of_record) == ("s", True)
        assert instant.meaning == "time of a step"


def test_a_comparison_without_a_channel_is_refused_wherever_it_is(saved):
    _, content = saved
    record = {**content["records"][0], "channels": {}}
    end = {"phase": "lm", "next_phase": "dgn", "iteration": 1, "cost": 1.0, "values": {}}
    for changes in ({"records": [record]}, {"phase_ends": [{**end, "records": [record]}]}):
        with pytest.raises(ExfitError, match="channels: empty"):
            load_result(written(saved, **changes))


def test_errors_of_another_fit_are_refused(saved):
    _, content = saved
    known = content["knowledge"]["confidence"]["parameters"]
    known["other"] = known.pop("k")
    with pytest.raises(ExfitError, match="confidence: its parameters are not those of the fit"):
        load_result(written(saved))


def test_a_file_of_another_version_is_refused_with_what_to_do(saved):
    path, content = saved
    with pytest.raises(ExfitError, match=f"version: {VERSION + 1}: written by a later exfit"):
        load_result(written(saved, version=VERSION + 1))
    for version in range(1, VERSION):
        with pytest.raises(ExfitError, match=f"result.json: version: {version}: .*: fit again$"):
            load_result(written(saved, version=version))
    path.write_text(json.dumps({key: content[key] for key in content if key != "version"}))
    with pytest.raises(ExfitError, match=r"version: 1: of an earlier exfit"):
        load_result(path)
    for version in (None, "2", True, 0, -1):
        with pytest.raises(ExfitError, match=r"version: .* is not a version of results"):
            load_result(written(saved, version=version))


@pytest.mark.parametrize(
    ("place", "words"),
    {
        "capped": (("history", 0, "capped"), r"history\[0\]\.capped: missing"),
        "interval_method": (
            ("parameters", "a", "interval_method"), r"parameters\.a\.interval_method: missing",
        ),
        "verdict": (("verdict",), "verdict: missing"),
    }.values(),
)  # fmt: skip
def test_nothing_of_a_result_may_be_missing(saved, place, words):
    _, content = saved
    section = content
    for key in place[:-1]:
        section = section[key]
    del section[place[-1]]
    with pytest.raises(ExfitError, match=words):
        load_result(written(saved))


@pytest.mark.long
def test_no_damage_ends_in_a_traceback(saved):
    """Values of another kind, missing keys, cut files: ExfitError with the file, or no harm."""
    path, _ = saved
    whole = path.read_text(encoding="utf-8")
    draw = random.Random(1)
    others = [None, True, -1, 1e999, 10**400, "x", "\0", [], {}, [[1.0], [1.0, 2.0]]]
    refused = 0
    for _ in range(DAMAGES):
        content = json.loads(whole)
        section, key = _somewhere(content, draw)
        if draw.random() < 0.3:
            del section[key]
        else:
            section[key] = draw.choice(others)
        path.write_text(json.dumps(content), encoding="utf-8")
        refused += _refused(path)
    assert refused > DAMAGES // 2
    for cut in (0, 1, len(whole) // 2, len(whole) - 3):
        path.write_text(whole[:cut], encoding="utf-8")
        assert _refused(path)
    path.write_bytes(b"\xff\xfe{}")
    assert _refused(path)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('"cost": ', '"cost": 1.0, "cost": ', "not JSON: duplicate key 'cost'"),
        ('"cost": ', '"cost": NaN, "other": ', "not JSON: NaN is not a number"),
        ('"cost": ', f'"cost": {"9" * 400}, "other": ', r"cost: 9{60}\.\.\. is not a number"),
        ('"cost": ', f'"cost": {"9" * 5000}, "other": ', r"cost: '9{59}\.\.\. is not a number"),
        ('"nfev": ', f'"nfev": {"9" * 400}, "other": ', r"nfev: 9{60}\.\.\. is not a whole number"),
        (f'"version": {VERSION}', f'"version": {"9" * 400}', r"version: 9{60}\.\.\.: written by"),
        ('"FIRST_ORDER"', '"\\ud800"', "half a character"),
        ('"cost": ', f'"other": {"[" * 10**5}, "cost": ', "nested too deep"),
        ('"cost": ', f'"other": [{"[]," * 2 * 10**6}[]], "cost": ', "more than 2,000,000 texts"),
    ],
)
def test_what_no_exfit_writes_into_a_file_is_refused_in_one_message(saved, before, after, words):
    path, _ = saved
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(before, after, 1), encoding="utf-8")
    with pytest.raises(ExfitError, match=words) as refused:
        load_result(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert len(str(refused.value)) < 300
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-32", "latin-1"])
def test_a_file_in_another_encoding_is_refused(saved, encoding):
    path, content = saved
    text = json.dumps({**content, "case": "é"}, ensure_ascii=False)
    path.write_bytes(text.encode(encoding, "replace"))
    with pytest.raises(ExfitError, match=r":1: not UTF-8 text: byte 0x"):
        load_result(path)


def _refused(path):
    """Return whether a file is refused, with its name."""
    try:
        load_result(path)
    except ExfitError as fault:
        return str(path) in str(fault)
    return False


def _somewhere(content, draw):
    """Return a random mapping or list of a content, and a key of it."""
    places = []

    def walk(section):
        keys = section.keys() if isinstance(section, dict) else range(min(len(section), 2))
        for key in keys:
            places.append((section, key))
            if isinstance(section[key], dict | list):
                walk(section[key])

    walk(content)
    return draw.choice(places)


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (("records", 0, "time"), "records: fit: overlays: vt: not one sample for each time"),
        (("records", 0, "overlays", "vt", "start"), "not one sample for each time"),
        (("records", 0, "iteration_responses", "samples"), "iteration_responses: not one sample"),
        (("history", 1, "values"), "history: its parameters are not those of the fit"),
        (("knowledge", "sensitivity", 0, "time"), "sensitivity: vt: not one sample"),
        (("knowledge", "confidence", "correlation", "names"), "not one row and column for each"),
        (("knowledge", "sensitivities", 0, "rms"), "rms: not of the same signals"),
        (("behaviour", "small_signal", 0, "view", "closed", "frequency"), "not one response for"),
    ],
)
def test_what_does_not_fit_together_is_refused(saved, place, words):
    path, content = saved
    section = content
    for key in place[:-1]:
        section = section[key]
    part = section[place[-1]]
    if isinstance(part, dict):
        part.popitem()
    else:
        part.pop()
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ExfitError, match=words):
        load_result(path)


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("records", 0, "time", 3), 0.0, "records: fit: time: does not increase"),
        (("knowledge", "sensitivity", 0, "time", 3), 0.0, "vt: time: does not increase"),
        (("records", 0, "iteration_responses", "time", 3), 0.0, "time: does not increase"),
        (("records", 0, "overlays", "vt", "simulated", 2), 1e200, r"1e\+200 is beyond 1e\+150"),
        (("knowledge", "sensitivity", 0, "moved", "a", 1), -1e308, r"beyond 1e\+150"),
        (("records", 0, "overlays", "vt", "reference"), [1.0, 1.0], "not one sample for each time"),
    ],
)
def test_samples_that_cannot_be_drawn_are_refused(saved, place, value, words):
    path, content = saved
    section = content
    for key in place[:-1]:
        section = section[key]
    section[place[-1]] = value
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ExfitError, match=words):
        load_result(path)


def test_long_samples_are_thinned_and_keep_their_extremes(texts):
    from dataclasses import replace

    result = texts["one"]
    match = result.comparison
    time = np.linspace(0.0, 100.0, 100_001)
    noise = np.random.default_rng(1).standard_normal((2, len(time)))
    overlay = replace(match.overlays["vt"], measured=noise[0], simulated=noise[1], start=None)
    long = replace(match, time=time, overlays={"vt": overlay}, iteration_responses=None)
    kept = thinned(replace(result, comparisons=(long,))).comparison
    assert len(kept.time) <= MOST_ROWS + 2
    assert np.all(np.diff(kept.time) > 0.0)
    for ours, theirs in zip(
        (kept.overlays["vt"].measured, kept.overlays["vt"].simulated), noise, strict=True
    ):
        # nine digits are kept
        assert ours.max() == pytest.approx(theirs.max(), rel=1e-8)
        assert ours.min() == pytest.approx(theirs.min(), rel=1e-8)
    assert kept.channels == match.channels


@pytest.mark.long
def test_a_validation_holds_what_it_found_about_its_own_record(tmp_path):
    import yaml

    found_at = {"start": 1.02, "min": 0.9, "max": 1.1}
    content = several(recorded("up"), free={"KA": {"start": 300.0, "min": 76.6, "max": 7660.0}})
    content["validate"] = [recorded("down", at=found_at)]
    path = tmp_path / "case.yaml"
    path.write_text(yaml.safe_dump(content))
    result = workflows.fit(load_case(path))
    (match,) = result.validation
    # one free parameter leaves an error that the instant takes up a part of
    assert match.of_record["down.vref.at"] == pytest.approx(1.0, abs=0.05)
    assert match.of_record["down.vref.at"] != 1.02
    assert not result.comparison.of_record
    assert [one.test for one in result.behaviour.limits] == ["up", "down"]
