"""Captures in three layouts: the project's own, metrical-tracker / INSTA, IMavatar; CAPTURE.md describes them."""
