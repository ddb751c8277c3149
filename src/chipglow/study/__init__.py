"""Studies: settings of cut, camera and analysis, as a YAML file or in Python."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
