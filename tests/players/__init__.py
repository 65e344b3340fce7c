"""Players outside Python, judged by vectors from Python."""
