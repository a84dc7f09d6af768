"""Formats of `calmotion export`, one a file: ROS 2, CSV, servo ticks, URScript, Bottango."""
