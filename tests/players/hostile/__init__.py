"""The packs that Python and every player must refuse."""
