"""Deforming on the CPU: stages morph, skin, blend, bind and activate."""
