"""`height_px` and the choice of a level, by the vectors of all players."""
