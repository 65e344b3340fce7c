"""The core of the Unity player plays frames: a program in C#, and the GPU that Python is for it."""
