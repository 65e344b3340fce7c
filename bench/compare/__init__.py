"""This checkout against an earlier one."""
