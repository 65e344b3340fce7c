"""The Editor side of the Unity package: what its tests are compiled from and compared with."""
