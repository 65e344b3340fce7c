"""Whether the parts of a capture belong together: what a person would see in its images, found by numbers."""
