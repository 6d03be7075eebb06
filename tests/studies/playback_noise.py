"""Grid events with noise on all that was recorded: how often intervals hold the truth, the bias.

    python tests/studies/playback_noise.py 500
    python tests/studies/playback_noise.py 100 --times 5
    python tests/studies/playback_noise.py 100 --free machine.Xppd machine.Tpd0
    python tests/studies/playback_noise.py 100 --driving 0 --same
    python tests/studies/playback_noise.py 100 --plain

The event is that of `tests/reference/playback_ac8b.csv`, which another simulator made: noise of
2e-4 pu is added to p and q, 1e-4 pu to vt, 2e-4 rad to its angle, or ``--times`` as much; to vt
and the angle also ``--driving`` times as much. ``--same`` takes p and q of the simulator of the
fit. KPR, KIR, TE and H are fitted, and what else is to be ``--free``; ``--plain`` is without
weights by the noise of what drives. ``--search global`` is the default of the command; it finds the
same minimum.
"""

import json
import sys
import tempfile
from argparse import ArgumentParser
from pathlib import Path
from time import process_time
from unittest import mock

import numpy as np
import yaml

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from exfit.case.load import load_case  # noqa: E402
from exfit.fitting.build import build_experiments  # noqa: E402
from exfit.workflows import fit  # noqa: E402

NOISE = {"vt": 1e-4, "angle": 2e-4, "p": 2e-4, "q": 2e-4}  # pu, rad
REFERENCE = ROOT / "tests" / "reference" / "playback_ac8b.csv"
MACHINE = {
    "Tpd0": "Td10", "Tppd0": "Td20", "Tpq0": "Tq10", "Tppq0": "Tq20", "H": "H", "Xd": "xd",
    "Xq": "xq", "Xpd": "xd1", "Xpq": "xq1", "Xppd": "xd2", "Xl": "xl", "S10": "S10", "S12": "S12",
}  # fmt: skip
EXCITER = {"KPR": "kP", "KIR": "kI", "KDR": "kD", "TDR": "Td", "VFEMAX": "VFEMAX"} | {
    name: name
    for name in (
        "TR", "KA", "TA", "VRMAX", "VRMIN", "TE", "KC", "KD", "KE", "E1", "SE1", "E2", "SE2",
        "VEMIN",
    )
}  # fmt: skip
FREE = ("KPR", "KIR", "TE", "machine.H")


def unit():
    """Return the values of the unit in the event, by name."""
    given = json.loads(REFERENCE.with_suffix(".json").read_text())
    exciter = {name: given["exciter"][other] for name, other in EXCITER.items()}
    machine = {f"machine.{name}": given["machine"][other] for name, other in MACHINE.items()}
    return exciter | machine


def content(free, search="local", record="event.csv"):
    """Return a case of the event with some values free, each with a start 20 % off."""
    values = unit()
    sections = {
        name: {"start": 1.2 * values[name], "min": 0.3 * values[name], "max": 3.0 * values[name]}
        for name in free
    }
    for name in ("machine.Xppd",):
        if name in sections:  # it lies between Xl and X'd
            sections[name] = {"start": 0.24, "min": 0.14, "max": 0.32}
    machine = {name.partition(".")[2]: value for name, value in values.items() if "." in name}
    freed = {name.partition(".")[2]: own for name, own in sections.items() if "." in name}
    return {
        "model": "AC8B",
        "plant": {
            "type": "grid-playback", "machine": "GENROU", "dialect": "andes",
            "parameters": {name: own for name, own in machine.items() if name not in freed},
            "free": freed, "network": {"f0": 60},
        },
        "record": {
            "file": record, "time": "t", "channels": {signal: signal for signal in NOISE}
        },
        "parameters": {
            "fixed": {n: v for n, v in values.items() if "." not in n and n not in sections},
            "free": {name: own for name, own in sections.items() if "." not in name},
        },
        "estimate": {"search": search},
        "given": "exact",
    }  # fmt: skip


def event_of(same=False):
    """Return the columns of the event; p and q of the ``same`` simulator as that of the fit."""
    event = np.genfromtxt(REFERENCE, delimiter=",", names=True)
    if same:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "case.yaml"
            path.write_text(yaml.safe_dump(content((), record=str(REFERENCE))))
            case = load_case(path)
            (setup,) = build_experiments(case)
        signals = setup.experiment.samples(case.values())[0]
        for place, name in enumerate(setup.experiment.signals):
            event[name] = signals[:, place]
    return event


def write_record(path, event, times, driving, seed):
    """Write the record of the event with so many times the noise."""
    generator, columns = np.random.default_rng(seed), {"t": event["t"]}
    for signal, deviation in NOISE.items():
        size = times * deviation * (driving if signal in ("vt", "angle") else 1.0)
        columns[signal] = event[signal] + size * generator.standard_normal(len(event))
    rows = np.transpose([*columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")


def fits(count, free, times=1.0, driving=1.0, same=False, search="local", plain=False, first=0):
    """Yield the fit of each record."""
    event = event_of(same)
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.yaml"
        case.write_text(yaml.safe_dump(content(free, search)))
        reason = mock.patch(
            "exfit.features.events.input_noise.why_not_weighted",
            return_value="in this study",
        )
        for seed in range(first, first + count):
            write_record(case.with_name("event.csv"), event, times, driving, seed)
            if plain:
                with reason:
                    yield fit(case)
            else:
                yield fit(case)


def figures(results, free):
    """Return of each parameter how often its interval holds the truth, bias and scatter."""
    truth, table = unit(), {}
    for name in free:
        own = [result.parameters[name] for result in results]
        off = np.log([parameter.value / truth[name] for parameter in own])
        errors = np.array([(parameter.std_error or np.nan) / parameter.value for parameter in own])
        held = [
            parameter.interval is not None
            and (parameter.interval[0] or 0.0) <= truth[name] <= (parameter.interval[1] or np.inf)
            for parameter in own
        ]
        scatter = float(np.std(off))
        table[name] = {
            "holds": 100.0 * np.mean(held),
            "bias": float(np.mean(off)) / scatter,
            "scatter": 100.0 * scatter,
            "error": 100.0 * float(np.nanmedian(errors)),
        }
    return table


def main():
    parser = ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("count", type=int, nargs="?", default=20)
    parser.add_argument("--times", type=float, default=1.0)
    parser.add_argument("--driving", type=float, default=1.0)
    parser.add_argument("--same", action="store_true")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--free", nargs="*", default=[])
    parser.add_argument("--search", default="local")
    parser.add_argument("--plain", action="store_true")
    given = parser.parse_args()
    free, results, began = (*FREE, *given.free), [], process_time()
    all_fits = fits(
        given.count, free, given.times, given.driving, given.same, given.search, given.plain,
        given.first,
    )  # fmt: skip
    for result in all_fits:
        results.append(result)
        if len(results) in (10, 50) or len(results) % 100 == 0 or len(results) == given.count:
            seconds = (process_time() - began) / len(results)
            good = sum(own.verdict.verdict == "good" for own in results)
            print(f"{len(results)} records, {good} good, {seconds:.2f} s of a processor each")
            for name, row in figures(results, free).items():
                print(
                    f"  {name}: holds {row['holds']:.1f} %, bias {row['bias']:+.2f} deviations, "
                    f"scatter {row['scatter']:.3g} %, standard error {row['error']:.3g} %",
                    flush=True,
                )


if __name__ == "__main__":
    main()
