"""Tests of what avatars are distilled from."""
