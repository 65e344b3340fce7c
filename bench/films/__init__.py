"""Figures of the films that `python -m samples.films` writes: how well they are tracked, and what is learnt of them."""
