"""Shows packs in a browser: a server for one's own machine, and folders that any web server serves."""

__all__ = ["talk"]
