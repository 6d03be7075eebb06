"""Records of several channels whose errors differ: noise, the ripple of a bridge, spikes."""

import numpy as np
from cases import with_local_search
from records import TIME, UNIT, config, found_in

from exfit.case.case import Case
from exfit.fitting.build import build_experiments
from exfit.records.record import Record

NOISE = {"vt": 1e-4, "efd": 2e-2, "ifd": 1e-3}  # pu
STARTS = {"KA": 500.0, "TE": 1.2, "TA": 0.03}
RIPPLE_FREQUENCY = 31.7  # Hz, of what is left of a bridge's ripple in samples of 10 ms


def response_of(content, values, time):
    """Return the signals (M,) by name of a case's content, at times (M,)."""
    channels = content["record"]["channels"]
    still = Record.from_arrays(time, dict.fromkeys(channels, time))
    (setup,) = build_experiments(Case.from_dict(content, still))
    at = {**setup.with_start_values(Case.from_dict(content, still).values()), **values}
    return {
        signal: samples
        for signal, samples in setup.with_enough_substeps(at).response(at).signals.items()
        if signal in channels
    }


def disturbed(signals, noise, seed, ripple=0.0, spikes=0):
    """Return signals with white noise of each, a ripple (pu) in efd and spikes in vt."""
    rng = np.random.default_rng(seed)
    noisy = {name: y + rng.normal(0.0, noise[name], len(y)) for name, y in signals.items()}
    if "efd" in noisy:
        wave = np.sin(2.0 * np.pi * RIPPLE_FREQUENCY * 0.01 * np.arange(len(noisy["efd"])))
        noisy["efd"] = noisy["efd"] + ripple * wave
    places = rng.choice(len(noisy["vt"]) - 20, spikes, replace=False) + 10
    noisy["vt"][places] += 0.02 * rng.choice([-1.0, 1.0], spikes)
    return noisy


def three_channels(seed=14, count=1, ripple=0.0, spikes=0, noise=NOISE, **estimate):
    """Return a case of the AC1A with one or more records of vt, efd and ifd."""
    content = config("ac1a_typical")
    del content["validate"]
    content["test"] = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.02}]}  # meets no limit
    channels = {signal: signal for signal in noise}
    fixed = {name: value for name, value in UNIT.items() if name not in STARTS}
    content["parameters"]["fixed"] |= fixed
    content["parameters"]["free"] = {
        name: found_in(start, start / 10.0, start * 10.0) for name, start in STARTS.items()
    }
    content["record"] = {"channels": channels}
    truth = response_of(content, UNIT, TIME)
    content["estimate"] = estimate
    names = [f"record{k}" for k in range(count)]
    if count > 1:
        own = {"test": content.pop("test"), "record": content.pop("record")}
        content["records"] = [{"name": name, **own} for name in names]
    records = {
        name: Record.from_arrays(TIME, disturbed(truth, noise, seed + k, ripple, spikes))
        for k, name in enumerate(names)
    }
    return Case.from_dict(with_local_search(content), records if count > 1 else records["record0"])
