"""Tests of the reader of RGBAvatar."""
