"""PSAvatar (arXiv 2401.12900) as a trainable system."""
