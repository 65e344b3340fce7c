"""The commands of avatar-train, one file each; `cli.py` registers them."""
