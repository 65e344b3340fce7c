"""Sample checkpoints in the exact layouts of the trained systems, built from a real scanned head."""
