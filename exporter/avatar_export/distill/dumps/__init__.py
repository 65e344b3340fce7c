"""Posed dumps: their files and numbers, what is wrong with them, which frames are held out."""
