"""Programs for Windows: made here, and run here with Wine."""
