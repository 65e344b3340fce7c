"""Registration: a template fitted to scans of one person."""
