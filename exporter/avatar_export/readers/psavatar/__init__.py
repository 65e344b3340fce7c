"""The reader of PSAvatar."""
