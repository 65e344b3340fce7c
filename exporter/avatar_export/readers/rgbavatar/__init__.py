"""The reader of RGBAvatar."""
