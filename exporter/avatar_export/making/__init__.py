"""From a film of a face to an avatar: the steps of `make`, each in a process of its own, and how far they have come."""
