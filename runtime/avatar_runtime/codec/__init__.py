"""Parts of a bundle: bytes to arrays and back, one file a format."""
