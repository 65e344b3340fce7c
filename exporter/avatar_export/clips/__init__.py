"""From files that hold poses to the clips of an avatar, and from clips to poses."""
