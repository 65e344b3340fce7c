"""Do inputs that come from different files belong together? Distances, known mistakes, and what is said of them."""
