"""A task to be edited."""

CAPSULE = """\
# In metres, seconds and kilograms.
name: my task
object:
  mass: 0.1
  shapes:
    - capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}
palm: {radius: 0.06, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion:
  - {at: 0, position: [0.09, 0, 0.3]}
  - {at: 1, position: [0.09, 0.02, 0.3]}
fingers:
  thumb: {touches: [0, 0.02, 0]}
  index: {touches: [0, -0.02, 0.025]}
  middle: {touches: [0, -0.02, -0.025]}
friction: 0.6
"""
