"""From a Result to a layer of overs over the shot, and a small root layer that opens both."""

from calmotion.usd.writing.result import (
    WriteOptions,
    motors_that_may_change,
    refuse_bake,
    refuse_inputs,
    refuse_options,
    sampled_at_frames,
    write_result,
)
from calmotion.usd.writing.root import refuse_foreign_root

__all__ = [
    "WriteOptions",
    "motors_that_may_change",
    "refuse_bake",
    "refuse_foreign_root",
    "refuse_inputs",
    "refuse_options",
    "sampled_at_frames",
    "write_result",
]
