"""Do inputs that come from different files belong together? Distances, known mistakes, and the doubts that follow."""
