"""What builds releases. Nothing of it is installed."""
