"""A converted robot as a shot: motors, motion, flexible links, targets and limits in a layer over it."""
