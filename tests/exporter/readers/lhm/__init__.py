"""Tests of the reader of LHM."""
