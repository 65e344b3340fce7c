"""From a trained system to a bundle and its reference."""
