"""Tests of the Android and iOS projects."""
