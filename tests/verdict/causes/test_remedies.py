"""The lines that remedies name: put into the case where they say, they load."""

import re
from copy import deepcopy

import pytest
import yaml
from places import CONFIGS
from records import case_of, config
from tiers import few_of

from exfit.case.load import load_case
from exfit.fitting.build import build_experiments
from exfit.verdict.causes.channels import check_zero
from exfit.verdict.causes.steps import correct_instant, correct_step, delay_found
from exfit.verdict.causes.unit import remedy_of
from exfit.verdict.score_tests import parameters_of
from exfit.workflows import fit

LINE = re.compile(
    r"under ([\w.\[\]-]+)(?:, in place of ([\w.\[\]-]+))?(?:, beside its column)?[:,] "
    r"((?:`[^`]*`(?:, )?)+)"
)
CASES = sorted(path.relative_to(CONFIGS) for path in CONFIGS.glob("**/*.yaml"))
CASES = [path for path in CASES if path.parts[0] != "programmes"]


def place(content, dotted):
    """Return the section of a case at a place, made where there is none; an entry of vref."""
    if dotted == "vref":
        return content["test"]["vref"][0]
    for key in re.findall(r"[\w-]+", dotted):
        if key.isdigit():
            content = content[int(key)]
            continue
        if isinstance(content.get(key), str):  # the name of a column
            content[key] = {"column": content[key]}
        content = content.setdefault(key, {})
    return content


def followed(content, remedy):
    """Yield the content of a case for each place of a remedy, its lines put there."""
    for target, former, lines in LINE.findall(remedy):
        changed = deepcopy(content)
        for line in re.findall("`([^`]*)`", lines):
            entry = yaml.safe_load(line)
            if former:
                for symbol in entry:
                    place(changed, former).pop(symbol, None)
            place(changed, target).update(entry)
        yield changed


def content_of(path):
    """Return the content of a case, its files by their absolute paths."""
    content = yaml.safe_load((CONFIGS / path).read_text(encoding="utf-8"))
    for section in [content, *content.get("records", []), *content.get("validate", [])]:
        record = section.get("record")
        if record and "file" in record:
            record["file"] = str((CONFIGS / path).parent / record["file"])
    return content


@pytest.mark.parametrize("path", few_of(CASES, 6), ids=str)
def test_every_value_that_may_be_wrong_is_freed_by_the_line_that_says_so(path, tmp_path):
    case, content = load_case(CONFIGS / path), content_of(path)
    values, free, rows = case.values(), case.free(), case.rows()
    names = [
        name
        for name in parameters_of(case)
        if name in rows and values[name] and name not in free and name not in case.ties.by_name
        and not re.search("MAX|MIN", name)
    ]  # fmt: skip
    for name in names:
        remedy = remedy_of(case, {name: values[name]})
        for changed in followed(content, remedy):
            assert name in case_of(changed, tmp_path).free(), remedy
        assert ("`" in remedy) == (not name.startswith("network.")), remedy


def test_what_is_wrong_with_a_test_or_channel_is_found_by_the_line_that_says_so(tmp_path):
    content = config("ac1a_good")
    del content["validate"]
    case = case_of(content, tmp_path)
    (channel,) = build_experiments(case)[0].channels
    remedies = {
        correct_step([-0.05]): 1,
        correct_step([0.062]): 1,
        correct_instant(0.013): 2,
        check_zero(channel, -0.02): 1,
        f"let the fit find it: {delay_found(-0.3, 2.0)}": 1,
    }
    for remedy, count in remedies.items():
        changed = [*followed(content, remedy)]
        assert len(changed) == count, remedy
        for each in changed:
            case_of(each, tmp_path)


@pytest.mark.long
def test_the_lines_of_the_causes_of_a_poor_fit_load(tmp_path):
    content = config("ac1a_good")
    del content["validate"]
    content["plant"]["parameters"]["Tpd0"] = 2.0
    causes = fit(case_of(content, tmp_path)).verdict.causes
    (remedy,) = (cause.remedy for cause in causes if "machine.Tpd0 " in cause.cause)
    assert "under plant.free, in place of plant.parameters, `Tpd0: {start: " in remedy
    (changed,) = followed(content, remedy)
    assert fit(case_of(changed, tmp_path)).parameters["machine.Tpd0"].value == pytest.approx(
        6.0, rel=0.1
    )
    for cause in causes:
        for each in followed(content, cause.remedy):
            case_of(each, tmp_path)
    last = [cause.cause for cause in causes if "of another type" in cause.cause]
    assert last in ([], [causes[-1].cause])
