"""From a Result to a layer of overs over the shot, and a small root layer that opens both."""

from calmotion.usd.writing.result import WriteOptions, refuse_bake, refuse_inputs, refuse_options, write_result

__all__ = ["WriteOptions", "refuse_bake", "refuse_inputs", "refuse_options", "write_result"]
