"""What hinders a test from taking a reference from its record."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import PlantKind

RECORDED = "recorded"  # in place of steps: the channel of the record


def recorded_faults(
    test: ContentNode, record: ContentNode, signal: str, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield what hinders a test from taking a reference from its record."""
    given, channel = test.at(signal), record.at("channels", signal)
    if kind.plays_back:
        drives = f"record.channels.{signal} drives it without"
        yield given.fault(f"not allowed with plant {kind.name}: {drives}")
    elif not has_record:
        yield given.fault(f"{RECORDED} needs a record")
    elif channel.value is None:
        yield channel.fault(f"is missing: test.{signal} is {RECORDED}")
    if "begin" in test and not kind.plays_back:
        shown = "the record shows it from its start only"
        yield test.at("begin").fault(f"not allowed with {signal}: {RECORDED}: {shown}")
    if "resample" in record:
        text = f"not allowed with test.{signal}: {RECORDED}: its filter smears the jumps"
        yield record.at("resample").fault(text)
