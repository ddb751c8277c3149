"""The app: a scene under a camera whose knobs can be turned, in a browser or in a notebook."""

from chipglow.app.exploring import explore, serve

__all__ = ["explore", "serve"]
