"""SplattingAvatar (arXiv 2403.05087) as a trainable system."""
