"""Tests of the Unreal plugin."""
