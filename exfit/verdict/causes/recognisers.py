"""What looks for the causes of a misfit in turn; a fit that matches does without them."""

from collections.abc import Mapping

from exfit.verdict.causes.channels import (
    clipped_channel,
    wrong_offset,
    wrong_scale,
    wrong_start,
)
from exfit.verdict.causes.evidence import Recogniser
from exfit.verdict.causes.levels import unsteady_record, wrong_voltage
from exfit.verdict.causes.recorder import (
    aliased_ripple,
    averaging,
    drift,
    other_clock,
    ripple,
    spiky_channel,
)
from exfit.verdict.causes.speed import other_speed
from exfit.verdict.causes.steps import (
    further_step,
    ramped_step,
    wrong_instant,
    wrong_sign,
    wrong_size,
)
from exfit.verdict.causes.unit import (
    fixed_values,
    machine_data,
    narrow_bound,
    not_ended,
    wrong_limit,
)

WITHOUT_TRIAL: Mapping[str, Recogniser] = {
    "iterations": not_ended,
    "unit of the time": other_clock,
    "spikes": spiky_channel,
    "ripple": ripple,
    "drift": drift,
    "level of vt": wrong_voltage,
    "rest before the step": unsteady_record,
}
BY_TRIAL: Mapping[str, Recogniser] = {
    "sign of the step": wrong_sign,
    "size of the step": wrong_size,
    "time of the step": wrong_instant,
    "base of a channel": wrong_scale,
    "zero of a channel": wrong_offset,
    "vt0": wrong_start,
    "clipped channel": clipped_channel,
    "aliased ripple": aliased_ripple,
    "bounds": narrow_bound,
    "machine data": machine_data,
    "other fixed values": fixed_values,
    "limits": wrong_limit,
    "speed": other_speed,
    "ramp of the step": ramped_step,
    "further step": further_step,
}
AFTER_TRIALS: Mapping[str, Recogniser] = {"recorder that averages": averaging}
