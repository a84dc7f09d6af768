"""Public names of `calmotion.testing`: each is imported when it is first used."""

from calmotion.testing.beam_arms import beam_arm as beam_arm
from calmotion.testing.beam_arms import beam_mesh as beam_mesh
from calmotion.testing.beam_arms import branched_links as branched_links
from calmotion.testing.beam_arms import fresh_cache as fresh_cache
from calmotion.testing.beam_arms import link_chain as link_chain
from calmotion.testing.beam_arms import quintic as quintic
from calmotion.testing.beam_arms import shot_of as shot_of
from calmotion.testing.plugins import check_plugin as check_plugin
from calmotion.testing.plugins import host_with as host_with
from calmotion.testing.plugins import run_operator as run_operator
from calmotion.testing.search_terms import derivative_error as derivative_error
from calmotion.testing.small_shots import beam as beam
from calmotion.testing.small_shots import small_shot as small_shot
