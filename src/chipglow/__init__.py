"""chipglow: a virtual infrared camera for metal cutting.

The stub beside this file names what is public; a room is imported when one of its names is first
used, so that the command line starts at once.
"""

import os

import lazy_loader

# Threads of a kernel sleep while they wait for each other. Those of GNU's OpenMP spin by default:
# where another process shares the cores, a cut takes eight times as long.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
