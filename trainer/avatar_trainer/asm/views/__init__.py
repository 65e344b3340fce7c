"""A face and its cameras from uncalibrated images of a still head."""
