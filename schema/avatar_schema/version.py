"""The version of both distributions, and of what stands as `generator` in a bundle. It stands here alone."""

__version__ = "0.1.0"
