"""`python -m avatar_export`."""

from avatar_export.cli import main

main()
