"""The reader of SplattingAvatar."""
