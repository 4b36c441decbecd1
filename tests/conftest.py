"""What all tests share."""

import os
import sys

# MuJoCo reads this once, as it is imported: without a screen only EGL draws.
if sys.platform == "linux" and "DISPLAY" not in os.environ:
    os.environ.setdefault("MUJOCO_GL", "egl")
