"""chipglow: a virtual infrared camera for metal cutting.

The stub beside this file names what is public; a room is imported when one of its names is first
used, so that the command line starts at once.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
