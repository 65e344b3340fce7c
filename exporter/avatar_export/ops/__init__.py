"""Functions from Avatar to Avatar, and measures of an Avatar."""
